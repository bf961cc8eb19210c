#include <algorithm>
#include <cmath>

#include <gdfmap/align/robust_kernel.hpp>

namespace gdfmap {

double RobustKernel::cost(double r) const {
  const double ratio = r * r / (scale * scale);
  switch (kind) {
    case KernelKind::kHuber:
      return r <= scale ? 0.5 * r * r : scale * (r - 0.5 * scale);
    case KernelKind::kCauchy:
      return 0.5 * scale * scale * std::log1p(ratio);
    case KernelKind::kGemanMcClure:
      return 0.5 * r * r / (1.0 + ratio);
    case KernelKind::kNone:
      break;
  }
  return 0.5 * r * r;
}

double RobustKernel::weight(double r) const {
  const double ratio = r * r / (scale * scale);
  switch (kind) {
    case KernelKind::kHuber:
      return r <= scale ? 1.0 : scale / r;
    case KernelKind::kCauchy:
      return 1.0 / (1.0 + ratio);
    case KernelKind::kGemanMcClure:
      return 1.0 / ((1.0 + ratio) * (1.0 + ratio));
    case KernelKind::kNone:
      break;
  }
  return 1.0;
}

double RobustKernel::curvature(double r) const {
  const double ratio = r * r / (scale * scale);
  switch (kind) {
    case KernelKind::kHuber:
      return r <= scale ? 1.0 : 0.0;
    case KernelKind::kCauchy:
      return (1.0 - ratio) / ((1.0 + ratio) * (1.0 + ratio));
    case KernelKind::kGemanMcClure:
      return (1.0 - 3.0 * ratio) / ((1.0 + ratio) * (1.0 + ratio) * (1.0 + ratio));
    case KernelKind::kNone:
      break;
  }
  return 1.0;
}

RobustKernel KernelSchedule::at(int iteration) const {
  return {kind, std::max(last, first * std::pow(factor, iteration))};
}

bool KernelSchedule::is_final(int iteration) const {
  return first * std::pow(factor, iteration) <= last;
}

}  // namespace gdfmap
