#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/query/path_queries.hpp>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace gdfmap::cli {

/// What many subcommands have in common.
struct CommonOptions {
  std::string command;  ///< name of the subcommand
  int num_threads = 0;  ///< 0: one per core
  std::string memory;   ///< as given; empty: the library's default
  bool quiet = false;
  bool json = false;
  std::string progress = "auto";
};

enum CommonOption : unsigned {
  kThreads = 1,
  kMemory = 2,
  kProgress = 4,  ///< --progress and --quiet
  kJson = 8,
};

/// What a subcommand says of itself.
struct Help {
  const char* name;
  const char* summary;      ///< one line, for the list of subcommands
  const char* description;  ///< a paragraph
  const char* examples;     ///< one command a line
};
CLI::App* add_subcommand(CLI::App& program, const Help& help);

/// Declares some of the common options; `which` is a sum of CommonOption.
void add_common_options(CLI::App& app, CommonOptions& options, unsigned which);

/// The closed interval that an option's value must lie in.
struct Range {
  double min, max;
};

/// Declares an option that takes a number; its help states range and default.
/// @param value  its initial value is the default
/// @param unit   "M" for metres
CLI::Option* add_number(CLI::App& app, const std::string& name, double& value,
                        const std::string& unit, Range range, const std::string& text);
CLI::Option* add_number(CLI::App& app, const std::string& name, int& value, const std::string& unit,
                        Range range, const std::string& text);
/// The same without a default.
CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& value,
                        const std::string& unit, Range range, const std::string& text);

/// `--blend gdf1`
struct BlendOption {
  std::string name;
  [[nodiscard]] BlendMode mode() const;
};
void add_blend_option(CLI::App& app, BlendOption& option);

/// @name Values of options. @throws Error kUsage naming the option.
/// @{
/// "256M", "2G", "65536": bytes; K, M, G and T count in powers of 1024.
[[nodiscard]] std::size_t parse_size(std::string_view text, const std::string& option);
/// "X,Y,Z", finite, metres.
[[nodiscard]] Vector3 parse_point(std::string_view text, const std::string& option);
/// "X,Y,Z,DX,DY,DZ", finite, metres; the direction is not zero.
[[nodiscard]] Ray parse_ray(std::string_view text, const std::string& option);
/// "X0,Y0,Z0,X1,Y1,Z1", lower corner first, metres.
[[nodiscard]] Box3 parse_box(std::string_view text, const std::string& option);
/// "X,Y,Z,ROLL,PITCH,YAW", finite, metres and degrees: R = Rz(yaw) · Ry(pitch) · Rx(roll).
[[nodiscard]] Eigen::Isometry3d parse_pose(std::string_view text, const std::string& option);
/// "LEVEL,X,Y,Z"
[[nodiscard]] TileKey parse_tile_key(std::string_view text, const std::string& option);
/// @}

}  // namespace gdfmap::cli
