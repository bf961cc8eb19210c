#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <unordered_set>
#include <vector>

#include <gdfmap/gdf1/model.hpp>

#include "placement.hpp"

namespace gdfmap::gdf1 {

/// A Gaussian as files hold it: mean (absolute, shifted), root sigma (any sign), weight.
using FileGaussian = std::array<float, kNumGaussianRows>;

/// Turns what a file says of one cube after another into cubes, passing over and counting what
/// cannot be used.
class CubeBuilder {
 public:
  /// @param visit  outlives the builder
  CubeBuilder(const Placement& placement, const CubeVisitor& visit)
      : placement_(placement), visit_(&visit) {}

  void begin(const std::array<float, 3>& file_origin, float mae, float standard_deviation);
  void add(const FileGaussian& gaussian);
  /// Hands the cube over, or counts it as dropped.
  void end();

  [[nodiscard]] const ModelReadCounts& counts() const { return counts_; }

 private:
  struct KeyHash {
    std::size_t operator()(const CubeKey& key) const noexcept;
  };

  Placement placement_;
  const CubeVisitor* visit_;
  ModelReadCounts counts_;
  std::unordered_set<CubeKey, KeyHash> seen_;
  std::optional<CubeKey> key_;  ///< of the cube that is open, where it can be used
  float mae_ = 0.0f;
  float standard_deviation_ = 0.0f;
  std::vector<FileGaussian> gaussians_;  ///< cube-local by now
};

}  // namespace gdfmap::gdf1
