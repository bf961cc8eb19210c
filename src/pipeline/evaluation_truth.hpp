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

  /// Distances in metres. The nearer neighbours in the list stand to each other, the faster.
  [[nodiscard]] std::vector<double> distances(std::span<const LatticePoint> places);
  /// Central differences of the distance at each place, over ± so many steps.
  [[nodiscard]] std::vector<Vector3> gradients(std::span<const LatticePoint> places,
                                               std::span<const std::int64_t> half_widths);
  /// With a scene and points: whether the points tell the scene's distance within truth_gap at each
  /// place. True everywhere otherwise.
  [[nodiscard]] std::vector<bool> is_told_by_points(std::span<const LatticePoint> places,
                                                    std::span<const double> distances);
  /// Which cubes of a level-0 tile hold points of the truth; empty when it has no points.
  [[nodiscard]] std::optional<CubeMask> populated(const TileKey& tile) const;

 private:
  /// Distances in steps to the nearest point.
  [[nodiscard]] std::vector<double> to_points(std::span<const LatticePoint> places);
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
