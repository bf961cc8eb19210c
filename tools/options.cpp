#include "options.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

#include <CLI/CLI.hpp>

#include <gdfmap/align/rigid_motion.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/core/run_context.hpp>

#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr const char* kCommonGroup = "Common options";
constexpr int kMaxThreads = 1024;

[[noreturn]] void fail(const std::string& option, std::string_view text, const std::string& need) {
  throw Error(ErrorCode::kUsage, option + ": '" + std::string(text) + "' is not " + need);
}

/// Numbers separated by commas, exactly `count` of them.
template <typename T>
std::vector<T> parse_list(std::string_view text, std::size_t count, const std::string& option,
                          const std::string& need) {
  std::vector<T> values;
  std::string_view rest = text;
  for (std::size_t i = 0; i < count; ++i) {
    T value{};
    if (rest.starts_with('+')) rest.remove_prefix(1);
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    if (error != std::errc{}) fail(option, text, need);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    const bool last = i + 1 == count;
    if (last ? !rest.empty() : !rest.starts_with(',')) fail(option, text, need);
    if (!last) rest.remove_prefix(1);
    values.push_back(value);
  }
  return values;
}

std::vector<double> parse_numbers(std::string_view text, std::size_t count,
                                  const std::string& option, const std::string& need) {
  std::vector<double> values = parse_list<double>(text, count, option, need);
  for (const double value : values) {
    if (!std::isfinite(value)) fail(option, text, need);
  }
  return values;
}

template <typename T>
CLI::Option* add_ranged(CLI::App& app, const std::string& name, T& value, const std::string& unit,
                        Range range, const std::string& text) {
  const auto violation = [range](const std::string& given) {
    double number = 0.0;
    if (!CLI::detail::lexical_cast(given, number)) return given + " is not a number";
    if (number >= range.min && number <= range.max) return std::string();
    return given + " is not between " + exact(range.min) + " and " + exact(range.max);
  };
  return app.add_option(name, value, text)->option_text(unit)->check(violation, "");
}

std::string range_text(Range range) { return exact(range.min) + " to " + exact(range.max); }

std::string with_default(const std::string& text, Range range, double value) {
  return text + " (" + range_text(range) + ", default " + exact(value) + ")";
}

}  // namespace

CLI::Option* add_number(CLI::App& app, const std::string& name, double& value,
                        const std::string& unit, Range range, const std::string& text) {
  return add_ranged(app, name, value, unit, range, with_default(text, range, value));
}

CLI::Option* add_number(CLI::App& app, const std::string& name, int& value, const std::string& unit,
                        Range range, const std::string& text) {
  return add_ranged(app, name, value, unit, range, with_default(text, range, value));
}

CLI::Option* add_number(CLI::App& app, const std::string& name, std::optional<double>& value,
                        const std::string& unit, Range range, const std::string& text) {
  return add_ranged(app, name, value, unit, range, text + " (" + range_text(range) + ")");
}

CLI::App* add_subcommand(CLI::App& program, const Help& help) {
  CLI::App* const app =
      program.add_subcommand(help.name, std::string(help.summary) + "\n\n" + help.description);
  app->footer(std::string("Examples:\n") + help.examples);
  return app;
}

void add_common_options(CLI::App& app, CommonOptions& options, unsigned which) {
  options.command = app.get_name();
  if ((which & kThreads) != 0) {
    add_number(app, "--threads", options.num_threads, "N", {0, kMaxThreads},
               "Threads; 0 is one per core. No result depends on it")
        ->group(kCommonGroup);
  }
  if ((which & kMemory) != 0) {
    app.add_option("--memory", options.memory,
                   "Budget of the whole process, in bytes or with K, M, G (at least " +
                       byte_text(kMinMemoryBytes) +
                       ", default a quarter of the machine's memory, at most 4 GiB). No result "
                       "depends on it")
        ->option_text("SIZE")
        ->group(kCommonGroup);
  }
  if ((which & kJson) != 0) {
    app.add_flag("--json", options.json, "Print the result as one JSON object")
        ->group(kCommonGroup);
  }
  if ((which & kProgress) == 0) return;
  CLI::Option* const progress =
      app.add_option("--progress", options.progress,
                     "Progress on standard error: a line on a terminal or in a log (auto, the "
                     "default), a JSON object a line (json), or none")
          ->option_text("STYLE")
          ->check(CLI::IsMember({"auto", "json", "none"}))
          ->group(kCommonGroup);
  app.add_flag("--quiet", options.quiet, "Print neither progress nor notes, warnings alone")
      ->excludes(progress)
      ->group(kCommonGroup);
}

BlendMode BlendOption::mode() const {
  return name == "gdf1" ? BlendMode::kGdf1 : BlendMode::kPartition;
}

void add_blend_option(CLI::App& app, BlendOption& option) {
  app.add_option("--blend", option.name,
                 "How neighbouring cubes are combined: gdf1 is G-EDF's formula, for comparison "
                 "(default: a smooth partition of unity)")
      ->option_text("gdf1")
      ->check(CLI::IsMember({"gdf1"}));
}

std::size_t parse_size(std::string_view text, const std::string& option) {
  const std::string need = "a number of bytes such as 67108864, 256M or 2G";
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string_view unit = text.substr(static_cast<std::size_t>(end - text.data()));
  const std::size_t power = unit.empty() ? 0 : std::string_view("KMGT").find(unit) + 1;
  const bool known = unit.empty() || (unit.size() == 1 && power > 0);
  if (error != std::errc{} || !known) fail(option, text, need);
  const std::uint64_t scale = std::uint64_t{1} << (10 * power);
  if (value > std::numeric_limits<std::size_t>::max() / scale) fail(option, text, need);
  return value * scale;
}

Vector3 parse_point(std::string_view text, const std::string& option) {
  const auto v = parse_numbers(text, 3, option, "three finite numbers X,Y,Z");
  return {v[0], v[1], v[2]};
}

Ray parse_ray(std::string_view text, const std::string& option) {
  const std::string need = "a ray X,Y,Z,DX,DY,DZ of finite numbers with a direction";
  const auto v = parse_numbers(text, 6, option, need);
  const Ray ray{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  if (ray.direction_world.isZero(0.0)) fail(option, text, need);
  return ray;
}

Box3 parse_box(std::string_view text, const std::string& option) {
  const std::string need = "a box X0,Y0,Z0,X1,Y1,Z1 with its lower corner first";
  const auto v = parse_numbers(text, 6, option, need);
  const Box3 box(Vector3(v[0], v[1], v[2]), Vector3(v[3], v[4], v[5]));
  if (box.isEmpty()) fail(option, text, need);
  return box;
}

Eigen::Isometry3d parse_pose(std::string_view text, const std::string& option) {
  const auto values = parse_numbers(
      text, 6, option, "six numbers X,Y,Z,ROLL,PITCH,YAW in metres and degrees, nor a file");
  const double degree = std::numbers::pi / 180.0;
  return motion_from_angles({values[0], values[1], values[2]},
                            degree * Vector3(values[3], values[4], values[5]));
}

TileKey parse_tile_key(std::string_view text, const std::string& option) {
  const std::string need = "a tile LEVEL,X,Y,Z of whole numbers with a level from 0 to " +
                           std::to_string(kMaxLevels - 1);
  const auto v = parse_list<std::int32_t>(text, 4, option, need);
  if (v[0] < 0 || v[0] >= kMaxLevels) fail(option, text, need);
  return {v[0], v[1], v[2], v[3]};
}

}  // namespace gdfmap::cli
