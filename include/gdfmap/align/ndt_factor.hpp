#pragma once

#include <vector>

#include <gdfmap/align/factor.hpp>
#include <gdfmap/align/ndt_cells.hpp>

namespace gdfmap {

/// The normal distributions transform (Magnusson, 2009, section 6.2): what a point costs in a cell
/// whose mean is at distance q and whose inverse covariance is C is d1·exp(−½ d2 qᵀCq), the fit of
/// a Gaussian to a mixture of the cell's normal distribution and a uniform one.
struct NdtConstants {
  double d1 = 0.0, d2 = 0.0, d3 = 0.0;

  /// c1 = 10(1 − o), c2 = o/r³; d3 = −ln c2, d1 = −ln(c1 + c2) − d3,
  /// d2 = −2 ln[(−ln(c1·exp(−½) + c2) − d3)/d1].
  /// @param resolution     r, edge of a cell, metres
  /// @param outlier_ratio  o
  [[nodiscard]] static NdtConstants of(double resolution, double outlier_ratio = 0.55);
};

/// Points of a source against the cells of a target. A point costs −d1, the most it can, less what
/// its cells give. Bounded as it is, it uses no kernel. Steps are (v, ω): T becomes
/// (exp(ω)·R, t + v), whose second derivatives are exact in linearize()'s hessian.
class NdtFactor final : public Factor {
 public:
  struct Options {
    NdtNeighborhood neighborhood = NdtNeighborhood::kOwn;  ///< kOwn or kFaces
    int num_threads = 1;
  };

  /// @param source  metres, local frame. Both must outlive the factor.
  NdtFactor(const NdtCells& target, const std::vector<Vector3>& source, const Options& options);

  void match(const Eigen::Isometry3d& T) override;
  [[nodiscard]] std::size_t num_matched() const override { return num_matched_; }
  [[nodiscard]] double cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const override;
  [[nodiscard]] Linearization linearize(const Eigen::Isometry3d& T,
                                        const RobustKernel& kernel) const override;
  [[nodiscard]] Eigen::Isometry3d retract(const Eigen::Isometry3d& T,
                                          const Twist& step) const override;

 private:
  const NdtCells& target_;
  const std::vector<Vector3>& source_;
  Options options_;
  NdtConstants constants_;
  std::size_t stride_;                 ///< most cells of a point
  std::vector<const NdtCell*> cells_;  ///< stride_ a point, null behind the last
  std::size_t num_matched_ = 0;
};

}  // namespace gdfmap
