#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/hash.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/field/gaussians.hpp>

namespace gdfmap {

/// A cube as GDF1 and its CSV twin carry it. Gaussians are cube-local, as everywhere in gdfmap;
/// only the files hold absolute positions. The errors are not-a-number where a file states none
/// that make sense (negative or not finite).
struct Gdf1Cube {
  CubeKey key;                      ///< level 0
  float mae = 0.0f;                 ///< metres
  float standard_deviation = 0.0f;  ///< of the absolute errors, metres
  Gaussians gaussians;              ///< at least one
};

/// What stands before the cubes. Read from a file, num_cubes, averages and bounds are what the file
/// states, dropped cubes included; a CSV states none, there they are computed from its rows.
struct Gdf1Header {
  std::uint32_t num_cubes = 0;
  float average_mae = 0.0f;                 ///< over cubes, metres
  float average_standard_deviation = 0.0f;  ///< over cubes, metres
  Box3 bounds;                              ///< world frame, metres, the union of the cubes' boxes
  double cube_size = 1.0;                   ///< metres
  double empty_search_margin = 0.0;         ///< of the ancestor's trainer, metres; gdfmap writes 0
  double margin = kMarginRatio;             ///< blending margin, metres, in [0, cube_size / 2]
};

enum class ModelFormat { kGdf1, kCsv };

/// By extension, in any case: .bin is GDF1, .csv is CSV. @throws Error kUsage for another one.
[[nodiscard]] ModelFormat model_format(const std::filesystem::path& path);

/// Beyond this bound (metres) float32 steps exceed 0.5 mm and the exported minimum is subtracted.
inline constexpr double kMaxUnshiftedBound = 8192.0;
/// An extent (metres) above which float32 steps exceed 0.5 mm after the shift: a warning.
inline constexpr double kMaxPreciseExtent = 8192.0;
/// An extent (metres) that float32 cannot carry usefully (steps of 8 mm): refused.
inline constexpr double kMaxExtent = 65536.0;

/// What is subtracted from world coordinates before they are written, world frame, metres: zero
/// while every bound is below kMaxUnshiftedBound in magnitude (or the box is empty), else the
/// minimum floored to 1024 cubes. @throws Error kUsage when an extent exceeds kMaxExtent, naming
/// --region.
[[nodiscard]] Vector3 export_shift(const Box3& bounds, double cube_size);

/// The warning that an export of these bounds is due, one line: the extent or a shifted coordinate
/// exceeds kMaxPreciseExtent; it states the float32 step. Empty when the export is precise.
/// @throws Error kUsage as export_shift.
[[nodiscard]] std::optional<std::string> export_warning(const Box3& bounds, double cube_size);

/// Writes a model file cube by cube, to a temporary name, renamed by finish(); destroyed without
/// it, it leaves nothing. Not thread-safe.
///
/// A shift that is not zero goes to PATH.json beside it, with the content digest and the digest of
/// the model's own bytes. PATH.json is renamed before the model, and one that a new model does not
/// need is removed after it, so that a crash between the two leaves a pair whose digests differ,
/// which readers refuse, and never a shifted model that is taken for an unshifted one.
class ModelWriter {
 public:
  virtual ~ModelWriter() = default;
  /// Cubes come in Morton order of their keys, level 0, each with at least one Gaussian.
  /// @throws Error kIo; kUsage when float32 cannot tell the cube's origin from its neighbours'
  ///         (cubes under a centimetre, kilometres away).
  virtual void write(const Gdf1Cube& cube) = 0;
  /// @param header  num_cubes must be the number of cubes written, cube_size that of create_model;
  ///                bounds are in the world frame: the shift is applied here
  /// @throws Error kIo
  virtual void finish(const Gdf1Header& header) = 0;
};

/// @param path   its extension decides the format
/// @param shift  world frame, metres, a whole number of cubes along each axis: export_shift()
/// @throws Error kUsage for another extension, cube_size or shift; kIo.
[[nodiscard]] std::unique_ptr<ModelWriter> create_model(const std::filesystem::path& path,
                                                        double cube_size, const Vector3& shift,
                                                        const Digest& content_digest);

/// What reading a model passed over.
struct ModelReadCounts {
  std::uint64_t num_dropped_gaussians = 0;  ///< standard deviation under 1 mm, or not finite
  /// Origin not finite or not on the lattice, key twice (the first is kept), or no Gaussian left.
  std::uint64_t num_dropped_cubes = 0;
  bool operator==(const ModelReadCounts&) const = default;
};

struct ModelSummary {
  Gdf1Header header;
  ModelReadCounts counts;
};

struct Model {
  Gdf1Header header;
  std::vector<Gdf1Cube> cubes;  ///< in file order
  ModelReadCounts counts;
};

using CubeVisitor = std::function<void(Gdf1Cube&&)>;

/// Reads GDF1 or CSV in file order, one cube in memory at a time (and the keys of those before it),
/// applying PATH.json's shift. CSV knows neither cube size nor margin: `cube_size` (metres) is then
/// taken from the argument, else from PATH.json, else deduced from the origins (their greatest
/// common step); margin = kMarginRatio · cube_size. GDF1 ignores the argument. Any bytes are
/// survived, every count is checked against the file's size before anything is allocated.
/// @throws Error kIo or kCorrupt, with path and place; kUsage when a CSV's origins do not tell the
///         cube size, or for an extension as in model_format(). A damaged file may throw after some
///         cubes have been handed to `visit`.
ModelSummary visit_model(const std::filesystem::path& path, const CubeVisitor& visit,
                         std::optional<double> cube_size = std::nullopt);

/// The same, all cubes at once.
[[nodiscard]] Model read_model(const std::filesystem::path& path,
                               std::optional<double> cube_size = std::nullopt);

/// The header alone, shift applied; for a CSV the whole file is read.
[[nodiscard]] Gdf1Header read_model_header(const std::filesystem::path& path,
                                           std::optional<double> cube_size = std::nullopt);

}  // namespace gdfmap
