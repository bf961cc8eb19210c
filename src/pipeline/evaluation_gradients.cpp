#include "evaluation_gradients.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gdfmap/edt/sample_lattice.hpp>

namespace gdfmap {
namespace {

/// Gradients are judged beyond this distance (metres), as by the ancestor's evaluator.
constexpr double kLeastDistance = 0.1;
/// Half widths of the differences of the exact field, in edges: a narrow one for the true
/// direction, a wide one whose norm falls short of 1 where the medial axis is near.
constexpr double kNarrow = 1.0 / 512, kWide = 0.1;
constexpr double kOffAxisNorm = 0.97;

/// Half widths in steps, by the cube that holds each sample.
std::vector<std::int64_t> half_widths(std::span<const EvaluationSample> samples,
                                      std::span<const std::size_t> judged, double edges) {
  std::vector<std::int64_t> widths;
  for (const std::size_t i : judged) {
    const auto edge = static_cast<double>(steps_per_cube(std::max(samples[i].level, 0)));
    widths.push_back(std::llround(edges * edge));
  }
  return widths;
}

double angle_deg(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

}  // namespace

std::vector<GradientJudgement> GradientJudge::judge(std::span<const EvaluationSample> samples,
                                                    std::span<const FieldSample> answers) {
  std::vector<std::size_t> judged;
  std::vector<LatticePoint> places;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (num_samples_++ % stride_ != 0 || samples[i].distance <= kLeastDistance) continue;
    judged.push_back(i);
    places.push_back(samples[i].p);
  }
  const std::vector<Vector3> narrow =
      truth_.gradients(places, half_widths(samples, judged, kNarrow));
  const std::vector<Vector3> wide = truth_.gradients(places, half_widths(samples, judged, kWide));
  std::vector<GradientJudgement> result(samples.size());
  for (std::size_t j = 0; j < judged.size(); ++j) {
    const Vector3& gradient = answers[judged[j]].gradient;
    result[judged[j]] = {true, !gradient.allFinite(), wide[j].norm() >= kOffAxisNorm,
                         static_cast<float>(gradient.norm()),
                         static_cast<float>(angle_deg(gradient, narrow[j]))};
  }
  return result;
}

}  // namespace gdfmap
