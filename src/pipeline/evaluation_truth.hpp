#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/map/map.hpp>
#include <gdfmap/pipeline/evaluate.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>
#include <gdfmap/train/exact_distance.hpp>

namespace gdfmap {

/// True distances: to the nearest point of a cloud, to an analytic scene, or to both.
class EvaluationTruth {
 public:
  /// @param map  of the field that is judged; null for a model file. Outlives this object.
  EvaluationTruth(Map* map, const Lattice& lattice, const EvaluateOptions& options,
                  const RunContext& context);
  ~EvaluationTruth();

  /// Distances (metres) at lattice points, given relative to `origin`.
  [[nodiscard]] std::vector<double> distances(const LatticePoint& origin,
                                              std::span<const Eigen::Vector3i> samples);
  /// With a scene and points: whether the points tell the scene's distance within truth_gap at each
  /// sample. True everywhere otherwise.
  [[nodiscard]] std::vector<bool> is_told_by_points(const LatticePoint& origin,
                                                    std::span<const Eigen::Vector3i> samples,
                                                    std::span<const double> distances);
  /// Which cubes of a level-0 tile hold points of the truth; empty when it has no points.
  [[nodiscard]] std::optional<CubeMask> populated(const TileKey& tile) const;

 private:
  /// Distances in steps to the nearest point.
  [[nodiscard]] std::vector<double> to_points(const LatticePoint& origin,
                                              std::span<const Eigen::Vector3i> samples);
  void use_cloud(const RunContext& context);

  const Lattice& lattice_;
  const EvaluateOptions& options_;
  int num_threads_;
  std::optional<SyntheticScene> scene_;
  std::filesystem::path temporary_directory_;
  std::unique_ptr<PointStore> temporary_store_;
  PointStore* store_ = nullptr;
  std::vector<TilePoints> tiles_;
  std::unordered_map<TileKey, CubeMask, TileKeyHash> masks_;
  std::unique_ptr<ExactDistance> exact_distance_;
};

}  // namespace gdfmap
