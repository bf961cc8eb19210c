#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <gdfmap/align/factor.hpp>
#include <gdfmap/align/surface_cloud.hpp>

namespace gdfmap {

/// How a point p of the source is compared with its match q, s = T·p:
enum class SurfaceResidual {
  kPoint,  ///< |s − q|
  kPlane,  ///< n·(s − q), n the normal at q
  /// √((s − q)ᵀ M (s − q)): M is the inverse of the sum of both regularised covariances, held while
  /// the matches are, times 2·kFlatness, so that between parallel planes it is their distance in
  /// metres.
  kGicp,
};

/// Residuals between two clouds, each point of the source against the nearest of the target.
class SurfaceFactor final : public Factor {
 public:
  struct Options {
    SurfaceResidual residual = SurfaceResidual::kPlane;
    double max_distance = 1.0;  ///< of a match, metres
    int num_threads = 1;
  };

  /// Both clouds must outlive the factor.
  SurfaceFactor(const SurfaceCloud& target, const SurfaceCloud& source, const Options& options);

  void match(const Eigen::Isometry3d& T) override;
  [[nodiscard]] std::size_t num_matched() const override { return num_matched_; }
  [[nodiscard]] double cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const override;
  [[nodiscard]] Linearization linearize(const Eigen::Isometry3d& T,
                                        const RobustKernel& kernel) const override;

  [[nodiscard]] const SurfaceCloud& target() const { return target_; }
  [[nodiscard]] const SurfaceCloud& source() const { return source_; }
  [[nodiscard]] SurfaceResidual residual() const { return options_.residual; }
  /// Of every point of the source, its match in the target.
  [[nodiscard]] const std::vector<std::optional<std::uint32_t>>& matches() const {
    return matches_;
  }

 private:
  template <SurfaceResidual kResidual>
  [[nodiscard]] Linearization sum(const Eigen::Isometry3d& T, const RobustKernel& kernel) const;

  const SurfaceCloud& target_;
  const SurfaceCloud& source_;
  Options options_;
  std::vector<std::optional<std::uint32_t>> matches_;
  std::vector<Eigen::Matrix3d> metrics_;  ///< M of every match, kGicp alone
  std::size_t num_matched_ = 0;
};

}  // namespace gdfmap
