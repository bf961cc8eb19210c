#pragma once

namespace gdfmap {

enum class KernelKind { kNone, kHuber, kCauchy, kGemanMcClure };

/// A robust cost ρ(r) of a residual r ≥ 0 in metres, ½r² for residuals far below the scale c:
///   none ½r²; Huber ½r² up to c, then c(r − ½c); Cauchy ½c² ln(1 + (r/c)²);
///   Geman–McClure ½r² / (1 + (r/c)²).
struct RobustKernel {
  KernelKind kind = KernelKind::kNone;
  double scale = 1.0;  ///< c, metres, positive

  [[nodiscard]] double cost(double r) const;
  /// ρ'(r) / r: how a residual counts in the normal equations.
  [[nodiscard]] double weight(double r) const;
  /// ρ''(r), which is negative where a residual is taken for an outlier.
  [[nodiscard]] double curvature(double r) const;
};

/// A kernel whose scale falls from `first` to `last` by a constant factor an iteration, so that
/// what is far away draws at first and is left out at last.
struct KernelSchedule {
  KernelKind kind = KernelKind::kNone;
  double first = 1.0, last = 1.0;  ///< metres, first ≥ last > 0
  double factor = 0.7;             ///< in (0, 1)

  [[nodiscard]] RobustKernel at(int iteration) const;
  /// Whether the scale has reached its last value.
  [[nodiscard]] bool is_final(int iteration) const;
};

}  // namespace gdfmap
