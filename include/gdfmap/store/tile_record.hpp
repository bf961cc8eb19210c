#pragma once

#include <cstdint>
#include <vector>

#include <gdfmap/core/hash.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/field/cube_errors.hpp>
#include <gdfmap/field/gaussians.hpp>
#include <gdfmap/field/quantization.hpp>

namespace gdfmap {

enum class CubeStatus : std::uint8_t {
  kFitted = 0,
  kPoor = 1,    ///< its error exceeds mae_threshold_max: served, with its error, but not exported
  kFailed = 2,  ///< has no Gaussians; see FailureReason
};

enum class CubeClass : std::uint8_t {
  kEmpty = 0,      ///< holds no point
  kPopulated = 1,  ///< holds points
  kUnknown = 2,    ///< imported: GDF1 does not say
};

enum class FailureReason : std::uint8_t {
  kNone = 0,
  kNotFinite = 1,  ///< the fit diverged
};

/// 48 bits: a cube whose surroundings changed is taken for unchanged once in 3 · 10¹⁴ times.
inline constexpr std::uint64_t kMaxInputDigest = (std::uint64_t{1} << 48) - 1;
/// What more iterations are written as by the quantised codec.
inline constexpr int kMostQuantizedIterations = 255;

/// One attempted cube. It has Gaussians unless it failed, and a FailureReason only if it failed.
struct CubeRecord {
  int index = 0;  ///< in its tile, see cube_index()
  CubeStatus status = CubeStatus::kFitted;
  CubeClass cube_class = CubeClass::kEmpty;
  FailureReason failure = FailureReason::kNone;
  int num_iterations = 0;
  CubeErrors errors;
  float reach = 0.0f;       ///< largest training target, metres: points farther away cannot matter
  std::uint64_t input = 0;  ///< digest of everything that the fit saw, at most kMaxInputDigest
  Gaussians gaussians;
};

/// The points of one tile as those around it saw them when they were trained.
struct SurroundingTile {
  TileKey key;    ///< of the level of the tile that saw it
  Digest digest;  ///< of its points, not zero
  bool operator==(const SurroundingTile&) const = default;
};

/// All attempted cubes of one tile, by ascending index, and what they were made from.
struct TileRecord {
  TileKey key;
  /// Every tile whose points could matter to this one's cubes, those without points left out, in
  /// key order.
  std::vector<SurroundingTile> surroundings;
  Digest configuration;  ///< of the fit configuration and the fit version
  /// How its Gaussians are stored. With kQuantized they stand on the GaussianGrid of their cube's
  /// class, errors and reach on the LengthGrid, and iterations and numbers of Gaussians are below
  /// 2⁸.
  CubeCodec codec = CubeCodec::kFloat32;
  double cube_edge = 0.0;  ///< metres; wanted for kQuantized alone
  std::vector<CubeRecord> cubes;
};

}  // namespace gdfmap
