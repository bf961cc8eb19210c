#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/query/path_queries.hpp>

namespace gdfmap {
namespace {

constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
/// Where nothing is known, a walk looks for an end of that so often in a cube: unknown are tiles,
/// and margins of a quarter of a cube around those that cannot be read.
constexpr double kUnknownStep = 0.25;

void check_length(double value, double least, const char* name) {
  if (std::isfinite(value) && value >= least) return;
  throw Error(ErrorCode::kUsage, std::string(name) + " must be a number of metres" +
                                     (least > 0.0 ? " above 0" : " from 0") + ", not " +
                                     std::to_string(value));
}
constexpr double kAboveZero = std::numeric_limits<double>::min();

/// How far nothing can be, for steps: the distance itself where no bound of its error is known.
double clear_radius(const FieldSample& sample) {
  const double conservative = sample.conservative_distance();
  return std::isnan(conservative) ? std::max(0.0, sample.distance) : conservative;
}

/// The part of a walk that is free: all that is known to keep more than the radius.
class FreeLength {
 public:
  explicit FreeLength(double radius) : radius_(radius) {}

  /// The answer at `at`, which comes behind all before.
  void take(double at, const FieldSample& sample) {
    if (ended_) return;
    const double margin = sample.conservative_distance() - radius_;
    if (margin > 0.0) {
      length_ = at;
      reach_ = at + margin;
    } else {
      // What the last place saw free lies before this one.
      ended_ = true;
      length_ = std::clamp(reach_, length_, at);
      if (std::isnan(margin) && sample.status < FieldStatus::kUnknown) length_ = kNotKnown;
    }
  }
  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] bool goes_on() const { return !ended_; }

 private:
  double radius_;
  double length_ = 0.0;
  double reach_ = 0.0;
  bool ended_ = false;
};

class RayWalk {
 public:
  RayWalk(const Ray& ray, const RayOptions& options)
      : origin_(ray.origin_world),
        direction_(ray.direction_world.normalized()),
        options_(options),
        free_(options.radius) {
    if (!origin_.allFinite() || !direction_.allFinite() || direction_.isZero()) {
      throw Error(ErrorCode::kUsage,
                  "a ray needs a finite origin and a direction that is not zero");
    }
  }

  [[nodiscard]] Vector3 place() const { return origin_ + range_ * direction_; }

  /// The answer at place(); false when the ray ends there.
  bool take(const FieldSample& sample) {
    free_.take(range_, sample);
    result_.sample = sample;
    if (sample.status >= FieldStatus::kUnknown) return end(RayEnd::kUnknown);
    if (sample.distance <= options_.radius) return end(RayEnd::kHit);
    if (range_ >= options_.max_range) return end(RayEnd::kMaxRange);
    const double step = std::max(clear_radius(sample) - options_.radius, options_.tolerance);
    range_ = std::min(range_ + step, options_.max_range);
    return true;
  }
  [[nodiscard]] const RayHit& result() const { return result_; }

 private:
  bool end(RayEnd how) {
    result_.end = how;
    result_.range = range_;
    result_.free_range = free_.length();
    result_.place = place();
    return false;
  }

  Vector3 origin_, direction_;
  RayOptions options_;
  double range_ = 0.0;
  FreeLength free_;
  RayHit result_;
};

class PathWalk {
 public:
  PathWalk(std::span<const Vector3> path, double cube_size, const PathOptions& options)
      : path_(path),
        options_(options),
        unknown_step_(kUnknownStep * cube_size),
        free_(options.radius) {
    if (path.empty()) throw Error(ErrorCode::kUsage, "a path needs at least one point");
    ends_.reserve(path.size());
    double length = 0.0;
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (!path[i].allFinite()) {
        throw Error(ErrorCode::kUsage,
                    "point " + std::to_string(i + 1) + " of a path is not finite");
      }
      if (i > 0) length += (path[i] - path[i - 1]).norm();
      ends_.push_back(length);
    }
    result_.length = length;
    result_.distance = result_.lower_bound = kNotKnown;
    result_.place = path.front();
  }

  [[nodiscard]] Vector3 place() const {
    if (corner_ == 0) return path_[0];
    const double segment = ends_[corner_] - ends_[corner_ - 1];
    const double part = segment > 0.0 ? (at_ - ends_[corner_ - 1]) / segment : 1.0;
    return path_[corner_ - 1] + std::min(part, 1.0) * (path_[corner_] - path_[corner_ - 1]);
  }

  /// The answer at place(); false at the end of the path.
  bool take(const FieldSample& sample) {
    free_.take(at_, sample);
    const bool is_known = sample.status < FieldStatus::kUnknown;
    if (is_known) keep_least(sample);
    bound(sample, is_known);
    if (at_ >= result_.length) return end();
    last_clear_ = is_known ? clear_radius(sample) : kNotKnown;
    last_at_ = at_;
    go(is_known ? std::max(last_clear_ - least_clear_, options_.tolerance) : unknown_step_);
    return true;
  }
  [[nodiscard]] const PathClearance& result() const { return result_; }

 private:
  void keep_least(const FieldSample& sample) {
    if (sample.distance >= result_.distance) return;  // false for the first one
    result_.distance = sample.distance;
    result_.place = place();
    result_.place_at = at_;
    result_.status = sample.status;
  }

  /// From both ends of a step the distance falls by at most its length.
  void bound(const FieldSample& sample, bool is_known) {
    const double step = at_ - last_at_;
    if (at_ > 0.0 && std::isnan(last_clear_)) result_.unknown_length += step;
    if (!is_known) {
      if (!std::isnan(last_clear_)) lower_ = std::min(lower_, last_clear_ - step);
      return;
    }
    const double clear = clear_radius(sample);
    has_bounds_ = has_bounds_ && !std::isnan(sample.error_bound);
    least_clear_ = std::min(least_clear_, clear);
    lower_ = std::min(lower_, clear);
    if (!std::isnan(last_clear_)) lower_ = std::min(lower_, (last_clear_ + clear - step) / 2.0);
  }

  void go(double step) {
    at_ = std::min(at_ + step, result_.length);
    while (ends_[corner_] < at_) ++corner_;
  }

  bool end() {
    if (has_bounds_ && std::isfinite(lower_)) result_.lower_bound = std::max(0.0, lower_);
    result_.free_length = free_.length();
    result_.is_free = free_.goes_on();
    return false;
  }

  std::span<const Vector3> path_;
  std::vector<double> ends_;  ///< of the segments that end at each corner, along the path
  PathOptions options_;
  double unknown_step_;
  double at_ = 0.0;
  std::size_t corner_ = 0;  ///< the first one at or behind at_
  double last_at_ = 0.0, last_clear_ = kNotKnown;
  double least_clear_ = std::numeric_limits<double>::infinity();
  double lower_ = std::numeric_limits<double>::infinity();
  bool has_bounds_ = true;
  FreeLength free_;
  PathClearance result_;
};

/// Takes every walk to its end, a step of all that still go at a time, so that each batch is large.
template <typename Walk>
void walk_all(const DistanceField& field, std::vector<Walk>& walks) {
  std::vector<Walk*> going;
  for (Walk& walk : walks) going.push_back(&walk);
  std::vector<Vector3> places;
  std::vector<FieldSample> samples;
  while (!going.empty()) {
    places.clear();
    for (const Walk* walk : going) places.push_back(walk->place());
    samples.resize(places.size());
    field.at(places, samples);
    std::size_t num_kept = 0;
    for (std::size_t i = 0; i < going.size(); ++i) {
      if (going[i]->take(samples[i])) going[num_kept++] = going[i];
    }
    going.resize(num_kept);
  }
}

template <typename Answer, typename Walk>
std::vector<Answer> results(const std::vector<Walk>& walks) {
  std::vector<Answer> answers;
  for (const Walk& walk : walks) answers.push_back(walk.result());
  return answers;
}

void check(const PathOptions& options) {
  check_length(options.radius, 0.0, "radius");
  check_length(options.tolerance, kAboveZero, "tolerance");
}

}  // namespace

PathClearance clearance_along(const DistanceField& field, std::span<const Vector3> path_world,
                              const PathOptions& options) {
  check(options);
  std::vector<PathWalk> walk;
  walk.emplace_back(path_world, field.geometry().cube_size, options);
  walk_all(field, walk);
  return walk[0].result();
}

std::vector<PathClearance> clearances_along(const DistanceField& field,
                                            std::span<const std::vector<Vector3>> paths_world,
                                            const PathOptions& options) {
  check(options);
  std::vector<PathWalk> walks;
  for (const std::vector<Vector3>& path : paths_world) {
    walks.emplace_back(path, field.geometry().cube_size, options);
  }
  walk_all(field, walks);
  return results<PathClearance>(walks);
}

RayHit cast_ray(const DistanceField& field, const Ray& ray, const RayOptions& options) {
  return cast_rays(field, std::span(&ray, 1), options)[0];
}

std::vector<RayHit> cast_rays(const DistanceField& field, std::span<const Ray> rays,
                              const RayOptions& options) {
  check_length(options.max_range, kAboveZero, "max_range");
  check_length(options.radius, 0.0, "radius");
  check_length(options.tolerance, kAboveZero, "tolerance");
  std::vector<RayWalk> walks;
  for (const Ray& ray : rays) walks.emplace_back(ray, options);
  walk_all(field, walks);
  return results<RayHit>(walks);
}

}  // namespace gdfmap
