#include "projector.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace gdfmap::surface {
namespace {

/// Distances from the surface, in edges of a cube, from the least at which the field can be steep.
constexpr std::array kOffsets = {0.04, 0.05, 0.06, 0.07, 0.08, 0.10, 0.12};
/// That at which the far side is asked.
constexpr double kFarOffset = 0.05;
/// How near a walk must end to its offset, as a share of it.
constexpr double kTolerance = 0.1;
/// The slope of an exact distance is 1; where it is less than this, the field is rounded off.
constexpr double kLeastSlope = 0.6;
/// Of a Newton step, so that it does not jump where the field is flat.
constexpr double kLeastSlopeOfStep = 0.5;
constexpr int kSteps = 2;
/// By how much farther than the distance stated at a point its surface may be, in edges; what is
/// farther away is another surface.
constexpr double kSlack = 0.03;
/// Two sides whose answers are farther apart than this, in edges, are those of two surfaces.
constexpr double kMostGap = 0.08;
/// The cosine between the normals of two sides of one surface is at most this.
constexpr double kMostCosine = -0.5;

Vector3 unit(const Vector3& gradient) {
  const double slope = gradient.norm();
  return slope > 0.0 ? Vector3(gradient / slope) : Vector3::Zero();
}

}  // namespace

Vector3 Projector::Walker::foot() const { return position - value.distance * unit(value.gradient); }

ProjectedPoint Projector::Walker::projected(bool is_on_surface) const {
  return {foot(), unit(value.gradient), 0.0, 0.0, is_on_surface};
}

bool Projector::Walker::has_arrived(double offset) const {
  return std::abs(value.distance - offset) < kTolerance * offset &&
         value.gradient.norm() > kLeastSlope && (foot() - from).norm() < reach;
}

std::span<const ProjectedPoint> Projector::project(std::span<const Vector3> points_world) {
  find_near_sides(points_world);
  ask_far_sides();
  describe_places();
  return projected_;
}

std::span<const ProjectedPoint> Projector::describe(std::span<const Vector3> points_world) {
  projected_.clear();
  for (const Vector3& p : points_world) projected_.push_back({.position = p});
  describe_places();
  for (std::size_t i = 0; i < projected_.size(); ++i) {
    projected_[i].normal = unit(values_[i].gradient);
  }
  return projected_;
}

/// Completes the points where they stand now.
void Projector::describe_places() {
  positions_.clear();
  for (const ProjectedPoint& point : projected_) positions_.push_back(point.position);
  values_.resize(positions_.size());
  evaluator_.evaluate(positions_, values_);
  for (std::size_t i = 0; i < projected_.size(); ++i) {
    projected_[i].distance = values_[i].distance;
    projected_[i].expected_error = values_[i].expected_error;
  }
}

void Projector::evaluate(Walkers& walkers) {
  positions_.clear();
  for (const Walker& walker : walkers) positions_.push_back(walker.position);
  values_.resize(walkers.size());
  evaluator_.evaluate(positions_, values_);
  for (std::size_t i = 0; i < walkers.size(); ++i) walkers[i].value = values_[i];
}

/// Newton's steps to where the distance is the offset.
void Projector::walk(Walkers& walkers, double offset) {
  for (int step = 0; step < kSteps; ++step) {
    for (Walker& walker : walkers) {
      const double slope = std::max(walker.value.gradient.norm(), kLeastSlopeOfStep);
      const double length = (offset - walker.value.distance) / slope;
      // Whatever the field says, the points of a batch stay near each other.
      walker.position += std::clamp(length, -edge_, edge_) * unit(walker.value.gradient);
    }
    evaluate(walkers);
  }
}

void Projector::find_near_sides(std::span<const Vector3> points_world) {
  Walkers walkers;
  for (std::size_t i = 0; i < points_world.size(); ++i) {
    walkers.push_back({i, points_world[i], points_world[i]});
  }
  evaluate(walkers);
  projected_.clear();
  for (Walker& walker : walkers) {
    projected_.push_back(walker.projected(false));
    walker.reach = std::abs(walker.value.distance) + kSlack * edge_;
  }
  for (const double offset : kOffsets) {
    walk(walkers, offset * edge_);
    std::erase_if(walkers, [&](const Walker& walker) {
      const bool has_arrived = walker.has_arrived(offset * edge_);
      if (has_arrived) projected_[walker.point] = walker.projected(true);
      return has_arrived;
    });
  }
}

void Projector::ask_far_sides() {
  const double offset = kFarOffset * edge_;
  Walkers walkers;
  for (std::size_t i = 0; i < projected_.size(); ++i) {
    const ProjectedPoint& near = projected_[i];
    if (!near.is_on_surface) continue;
    walkers.push_back({i, near.position, near.position - offset * near.normal});
    walkers.back().reach = kMostGap * edge_;
  }
  evaluate(walkers);
  walk(walkers, offset);
  for (const Walker& walker : walkers) {
    ProjectedPoint& near = projected_[walker.point];
    const ProjectedPoint far = walker.projected(true);
    if (walker.has_arrived(offset) && far.normal.dot(near.normal) < kMostCosine) {
      near.position = 0.5 * (near.position + far.position);
    }
  }
}

}  // namespace gdfmap::surface
