#include "evaluation_truth.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <system_error>

#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/parallel.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/tiling/ingest.hpp>

namespace gdfmap {
namespace {

/// Steps from the origin of a look-up within which its places lie, along each axis.
constexpr std::int64_t kLookUpReach = std::int64_t{1} << 22;

bool is_near(const LatticePoint& p, const LatticePoint& origin) {
  return std::max({std::abs(p.x - origin.x), std::abs(p.y - origin.y), std::abs(p.z - origin.z)}) <
         kLookUpReach;
}

Eigen::Vector3i difference(const LatticePoint& p, const LatticePoint& origin) {
  return {static_cast<int>(p.x - origin.x), static_cast<int>(p.y - origin.y),
          static_cast<int>(p.z - origin.z)};
}

}  // namespace

EvaluationTruth::EvaluationTruth(Map* map, const Lattice& lattice, const EvaluateOptions& options,
                                 const RunContext& context)
    : lattice_(lattice), options_(options), num_threads_(context.threads()) {
  if (!options.truth_scene.empty()) scene_.emplace(options.truth_scene, options.truth_size);
  if (!options.cloud.empty()) {
    use_cloud(context);
  } else if (map != nullptr && map->has_points()) {
    store_ = &map->points();
  }
  if (store_ != nullptr) {
    store_->for_each_tile([&](const TilePoints& tile) {
      tiles_.push_back(tile);
      masks_.emplace(tile.key, tile.cubes);
    });
    exact_distance_ = std::make_unique<ExactDistance>(*store_, tiles_, context.memory() / 2);
  }
  if (!scene_ && tiles_.empty()) {
    throw Error(ErrorCode::kUsage,
                "nothing to compare with: name a cloud or an analytic scene (--truth)");
  }
}

EvaluationTruth::~EvaluationTruth() {
  exact_distance_.reset();
  temporary_store_.reset();
  std::error_code ignored;
  if (!temporary_directory_.empty()) std::filesystem::remove_all(temporary_directory_, ignored);
}

void EvaluationTruth::use_cloud(const RunContext& context) {
  std::string name = (std::filesystem::temp_directory_path() / "gdfmap-evaluate-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) {
    throw Error(ErrorCode::kIo,
                "cannot create " + name + ": " + std::generic_category().message(errno));
  }
  temporary_directory_ = name;
  temporary_store_ =
      std::make_unique<PointStore>(temporary_directory_ / "points.db", db::OpenMode::kCreate);
  const auto reader = open_point_cloud(options_.cloud);
  static_cast<void>(
      ingest_points(*reader, options_.cloud.string(), lattice_, *temporary_store_, {}, context));
  store_ = temporary_store_.get();
}

std::vector<double> EvaluationTruth::to_points(std::span<const LatticePoint> places) {
  std::vector<double> result(places.size());
  constexpr std::size_t kPerTask = 256;
  parallel_for((places.size() + kPerTask - 1) / kPerTask, num_threads_, [&](std::size_t task) {
    const std::size_t end = std::min(places.size(), (task + 1) * kPerTask);
    for (std::size_t i = task * kPerTask; i < end;) {
      const LatticePoint& origin = places[i];
      std::vector<Eigen::Vector3i> near;
      while (i + near.size() < end && is_near(places[i + near.size()], origin)) {
        const LatticePoint& p = places[i + near.size()];
        near.push_back(difference(p, origin));
      }
      const std::vector<double> found =
          exact_distance_->nearest(origin, near, SampleOrder::kScattered);
      std::copy(found.begin(), found.end(), result.begin() + static_cast<std::ptrdiff_t>(i));
      i += near.size();
    }
  });
  return result;
}

std::vector<double> EvaluationTruth::distances(std::span<const LatticePoint> places) {
  if (!scene_) {
    std::vector<double> result = to_points(places);
    for (double& distance : result) distance *= lattice_.step();
    return result;
  }
  std::vector<double> result(places.size());
  constexpr std::size_t kPerTask = 64;
  parallel_for((places.size() + kPerTask - 1) / kPerTask, num_threads_, [&](std::size_t task) {
    const std::size_t end = std::min(places.size(), (task + 1) * kPerTask);
    for (std::size_t i = task * kPerTask; i < end; ++i) {
      result[i] = scene_->distance(lattice_.to_world(places[i]));
    }
  });
  return result;
}

std::vector<Vector3> EvaluationTruth::gradients(std::span<const LatticePoint> places,
                                                std::span<const std::int64_t> half_widths) {
  std::vector<LatticePoint> around;
  around.reserve(6 * places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto [x, y, z] = places[i];
    const std::int64_t h = half_widths[i];
    around.insert(
        around.end(),
        {{x + h, y, z}, {x - h, y, z}, {x, y + h, z}, {x, y - h, z}, {x, y, z + h}, {x, y, z - h}});
  }
  const std::vector<double> d = distances(around);
  std::vector<Vector3> gradients(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double width = 2.0 * static_cast<double>(half_widths[i]) * lattice_.step();
    const std::size_t j = 6 * i;
    gradients[i] = Vector3(d[j] - d[j + 1], d[j + 2] - d[j + 3], d[j + 4] - d[j + 5]) / width;
  }
  return gradients;
}

std::vector<bool> EvaluationTruth::is_told_by_points(std::span<const LatticePoint> places,
                                                     std::span<const double> distances) {
  std::vector<bool> result(places.size(), true);
  if (!scene_ || !exact_distance_) return result;
  const std::vector<double> nearest = to_points(places);
  for (std::size_t i = 0; i < places.size(); ++i) {
    result[i] = std::abs(nearest[i] * lattice_.step() - distances[i]) <= options_.truth_gap;
  }
  return result;
}

std::optional<CubeMask> EvaluationTruth::populated(const TileKey& tile) const {
  if (masks_.empty()) return std::nullopt;
  const auto found = masks_.find(tile);
  return found == masks_.end() ? CubeMask{} : found->second;
}

}  // namespace gdfmap
