#include "cube_selection.hpp"

#include <algorithm>
#include <array>

#include <gdfmap/edt/sample_lattice.hpp>

#include "morton_grid.hpp"

namespace gdfmap {
namespace {

/// Covers the rounding of distances and of the coordinates of boxes.
constexpr double kSlack = 1e-4;

Box3 cube_box(const CubeKey& cube) {  // in level-0 cubes
  const auto edge = static_cast<double>(level_scale(cube.level));
  const Vector3 low = edge * Vector3(static_cast<double>(cube.x), static_cast<double>(cube.y),
                                     static_cast<double>(cube.z));
  return {low, low + Vector3::Constant(edge)};
}

/// Whether a box is nearer than `distance` to any of the others; all in level-0 cubes.
bool is_reached(const Box3& box, double distance, std::span<const Box3> others) {
  const double limit = distance * (1.0 + kSlack) + kSlack;
  return std::ranges::any_of(
      others, [&](const Box3& other) { return box.exteriorDistance(other) <= limit; });
}

class Selector {
 public:
  Selector(const CandidateTile& tile, const Lattice& lattice, const FitConfig& config)
      : tile_(tile), lattice_(lattice), threshold_(config.empty_distance_threshold) {}

  /// Cubes with a record that a change may have reached, and those without one that may have come.
  [[nodiscard]] std::vector<int> touched(std::span<const CubeRecord> stored,
                                         std::span<const Box3> changes) const {
    std::vector<int> cubes;
    auto record = stored.begin();
    for (int i = 0; i < kCubesPerTile; ++i) {
      while (record != stored.end() && record->index < i) ++record;
      const bool has_record = record != stored.end() && record->index == i;
      if (has_record ? reaches(*record, changes) : may_have_come(i, changes)) {
        cubes.push_back(i);
      }
    }
    return cubes;
  }

  /// Of these cubes, those that are to be fitted.
  [[nodiscard]] std::vector<int> wanted(std::span<const int> cubes,
                                        ExactDistance& exact_distance) const {
    std::vector<int> found;
    std::vector<int> undecided;
    for (const int cube : cubes) {
      if (tile_.key.level > 0 ? tile_.wanted.test(cube) : tile_.populated.test(cube)) {
        found.push_back(cube);
      } else if (tile_.key.level == 0) {
        undecided.push_back(cube);
      }
    }
    add_near(undecided, exact_distance, found);
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  [[nodiscard]] bool reaches(const CubeRecord& record, std::span<const Box3> changes) const {
    Box3 box = cube_box(cube_at(tile_.key, record.index));
    const Vector3 margin = kMarginRatio * box.sizes();
    box.extend(Vector3(box.min() - margin)).extend(Vector3(box.max() + margin));
    return is_reached(box, static_cast<double>(record.reach) / lattice_.cube_size(), changes);
  }

  [[nodiscard]] bool may_have_come(int cube, std::span<const Box3> changes) const {
    if (tile_.key.level > 0) return tile_.wanted.test(cube);
    const Vector3 centre = cube_box(cube_at(tile_.key, cube)).center();
    return is_reached({centre, centre}, threshold_ / lattice_.cube_size(), changes);
  }

  /// Adds the level-0 cubes whose centre is within the threshold of a point.
  void add_near(std::span<const int> cubes, ExactDistance& exact_distance,
                std::vector<int>& found) const {
    std::vector<Eigen::Vector3i> centres;
    std::vector<int> order(cubes.begin(), cubes.end());
    std::ranges::sort(order, {}, [](int cube) { return morton_code_of_cube(cube); });
    for (const int cube : order) {
      const std::array<int, 3> c = cube_coordinates(cube);
      centres.push_back(kStepsPerCubeAxis * Eigen::Vector3i(c[0], c[1], c[2]) +
                        Eigen::Vector3i::Constant(kStepsPerCubeAxis / 2));
    }
    const std::vector<double> distances =
        exact_distance.nearest(tile_origin(tile_.key), centres, SampleOrder::kPackets);
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (static_cast<float>(distances[i] * lattice_.step()) <= threshold_) {
        found.push_back(order[i]);
      }
    }
  }

  const CandidateTile& tile_;
  const Lattice& lattice_;
  double threshold_;  // metres
};

std::vector<int> all_cubes() {
  std::vector<int> cubes(kCubesPerTile);
  for (int i = 0; i < kCubesPerTile; ++i) cubes[static_cast<std::size_t>(i)] = i;
  return cubes;
}

}  // namespace

CubeSelection select_cubes(const CandidateTile& tile, std::span<const CubeRecord> stored,
                           const std::optional<std::vector<Box3>>& changes, const Lattice& lattice,
                           const FitConfig& config, ExactDistance& exact_distance) {
  const Selector selector(tile, lattice, config);
  CubeSelection selection;
  const std::vector<int> touched = changes ? selector.touched(stored, *changes) : all_cubes();
  selection.looked_up = selector.wanted(touched, exact_distance);
  for (const CubeRecord& record : stored) {
    const bool stays = tile.key.level == 0 || tile.wanted.test(record.index);
    if (stays && !std::ranges::binary_search(touched, record.index)) {
      selection.kept.push_back(record.index);
    }
  }
  return selection;
}

}  // namespace gdfmap
