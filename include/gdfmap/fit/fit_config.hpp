#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <gdfmap/field/quantization.hpp>

namespace gdfmap {

/// Which optimiser fits the cubes.
enum class Solver : std::uint8_t {
  kTensor,  ///< ours: Levenberg–Marquardt on the tensor structure of regular samples
  kCeres,   ///< Ceres on the same residuals: slower, for comparison
};

/// Points on the way from speed and small maps to accuracy; figures in BENCHMARK.md.
enum class FitPreset : std::uint8_t { kFast, kBalanced, kBest };

/// What a name means; nothing for other names.
[[nodiscard]] std::optional<Solver> find_solver(std::string_view name);    ///< tensor, ceres
[[nodiscard]] std::optional<CubeCodec> find_codec(std::string_view name);  ///< quantized, float32
[[nodiscard]] std::optional<FitPreset> find_preset(
    std::string_view name);  ///< fast, balanced, best

/// Everything that decides a cube's Gaussians, besides the samples. Lengths in metres at level 0;
/// at level n they count 4ⁿ times as much.
struct FitConfig {
  std::vector<int> populated_steps = {8, 16, 32};  ///< numbers of Gaussians tried, ascending
  std::vector<int> empty_steps = {3, 5, 8, 12};    ///< the same for cubes without points
  double mae_threshold = 0.0115;          ///< held-out mean absolute error at which growth ends
  double empty_mae_threshold = 0.007;     ///< the same for cubes without points
  double mae_threshold_max = 0.30;        ///< beyond it a cube is marked poor
  double empty_distance_threshold = 2.0;  ///< cubes whose centre is this near to a point are fitted
  int max_iterations = 20;                ///< of the optimiser, for each number of Gaussians
  Solver solver = Solver::kTensor;
  CubeCodec codec = CubeCodec::kQuantized;  ///< the precision that Gaussians are rounded to

  /// A preset for a map: thresholds grow with the cube. The members' own defaults are kBalanced for
  /// cubes of 1 m.
  [[nodiscard]] static FitConfig preset(FitPreset preset, double cube_size);
  [[nodiscard]] static FitConfig defaults(double cube_size) {
    return preset(FitPreset::kBalanced, cube_size);
  }

  /// One line "key = value" for each member, keys as in the configuration file: equal
  /// configurations, equal text. The form in which a map stores its configuration.
  [[nodiscard]] std::string canonical() const;
  /// The inverse. @throws Error kCorrupt naming the line that canonical() cannot have written.
  [[nodiscard]] static FitConfig from_canonical(const std::string& text);
  /// Keys whose values differ.
  [[nodiscard]] std::vector<std::string> differing_keys(const FitConfig& other) const;

  bool operator==(const FitConfig&) const = default;
};

/// Counts every change of the fit that changes stored bytes; part of what makes a tile stale.
inline constexpr std::uint32_t kFitVersion = 4;

/// One step of a ladder may not exceed this: the normal equations have 7 K rows.
inline constexpr int kMaxGaussians = 64;

}  // namespace gdfmap
