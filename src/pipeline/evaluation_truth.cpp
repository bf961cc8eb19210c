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

std::vector<double> EvaluationTruth::to_points(const LatticePoint& origin,
                                               std::span<const Eigen::Vector3i> samples) {
  std::vector<double> result(samples.size());
  constexpr std::size_t kPerTask = 256;
  parallel_for((samples.size() + kPerTask - 1) / kPerTask, num_threads_, [&](std::size_t task) {
    const std::size_t begin = task * kPerTask;
    const auto part = samples.subspan(begin, std::min(kPerTask, samples.size() - begin));
    const std::vector<double> found =
        exact_distance_->nearest(origin, part, SampleOrder::kScattered);
    std::copy(found.begin(), found.end(), result.begin() + static_cast<std::ptrdiff_t>(begin));
  });
  return result;
}

std::vector<double> EvaluationTruth::distances(const LatticePoint& origin,
                                               std::span<const Eigen::Vector3i> samples) {
  if (!scene_) {
    std::vector<double> result = to_points(origin, samples);
    for (double& distance : result) distance *= lattice_.step();
    return result;
  }
  std::vector<double> result(samples.size());
  constexpr std::size_t kPerTask = 64;
  parallel_for((samples.size() + kPerTask - 1) / kPerTask, num_threads_, [&](std::size_t task) {
    const std::size_t end = std::min(samples.size(), (task + 1) * kPerTask);
    for (std::size_t i = task * kPerTask; i < end; ++i) {
      result[i] = scene_->distance(lattice_.to_world(
          {origin.x + samples[i].x(), origin.y + samples[i].y(), origin.z + samples[i].z()}));
    }
  });
  return result;
}

std::vector<bool> EvaluationTruth::is_told_by_points(const LatticePoint& origin,
                                                     std::span<const Eigen::Vector3i> samples,
                                                     std::span<const double> distances) {
  std::vector<bool> result(samples.size(), true);
  if (!scene_ || !exact_distance_) return result;
  const std::vector<double> nearest = to_points(origin, samples);
  for (std::size_t i = 0; i < samples.size(); ++i) {
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
