#pragma once

#include <cstdint>
#include <vector>

#include <gdfmap/align/factor.hpp>
#include <gdfmap/align/surface_cloud.hpp>
#include <gdfmap/query/distance_field.hpp>

namespace gdfmap {

/// Points of a source against a distance field: the residual is the distance at T·p, its derivative
/// the gradient there, J = [gᵀ, (s × g)ᵀ]. A match is a point where the finest level of the field
/// answers; the others cost as much as one at max_distance.
///
/// An unsigned distance has a kink at the surface, which a fitted field rounds off, as √(x² + ε²)
/// rounds |x|: its gradient vanishes there, and JᵀJ with it, though half its square is as steep as
/// ½x². The hessian is therefore made of the gradients' directions, which is right on both sides.
class FieldFactor final : public Factor {
 public:
  struct Options {
    double max_distance = 1.0;  ///< what a point outside the field costs as much as, metres
    int num_threads = 1;
  };

  /// @param origin_world  of the local frame that poses lead to
  /// @param source        metres, local frame. Both must outlive the factor.
  FieldFactor(const DistanceField& field, const Vector3& origin_world,
              const std::vector<Vector3>& source, const Options& options);

  void match(const Eigen::Isometry3d& T) override;
  [[nodiscard]] std::size_t num_matched() const override { return num_matched_; }
  [[nodiscard]] double cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const override;
  [[nodiscard]] Linearization linearize(const Eigen::Isometry3d& T,
                                        const RobustKernel& kernel) const override;

 private:
  const DistanceField& field_;
  Vector3 origin_world_;
  const std::vector<Vector3>& source_;
  Options options_;
  std::vector<std::uint8_t> is_matched_;
  std::size_t num_matched_ = 0;
};

/// Points of a source against a distance field, seen from both sides of their surface: with the
/// normal n of a point p and a length h, the residual is half of what the distance at T·(p + h·n)
/// exceeds that at T·(p − h·n). Near a plane that is the signed distance of T·p from it, exactly,
/// though the field is unsigned; the field is not asked where it is rounded off, errors that its
/// sides have in common cancel, and its gradients there have unit length. J = ½(J₊ − J₋), J± as of
/// FieldFactor. The lengths of the points differ, so that errors of the field at one distance do
/// not add up.
///
/// A match is a point with the surface between its sides and nothing else near: the finest level
/// answers at both, and the distances add up to 2h within half of h. From further away than h there
/// is none, which is what FieldFactor is for.
class TwoSidedFieldFactor final : public Factor {
 public:
  struct Options {
    double min_half_width = 0.15;  ///< of h, metres
    double max_half_width = 0.45;
    double max_distance = 0.2;  ///< what a point without a match costs as much as, metres
    int num_threads = 1;
  };

  /// @param origin_world  of the local frame that poses lead to
  /// @param source        metres, local frame
  /// The field must outlive the factor.
  TwoSidedFieldFactor(const DistanceField& field, const Vector3& origin_world,
                      const SurfaceCloud& source, const Options& options);

  void match(const Eigen::Isometry3d& T) override;
  [[nodiscard]] std::size_t num_matched() const override { return num_matched_; }
  [[nodiscard]] double cost(const Eigen::Isometry3d& T, const RobustKernel& kernel) const override;
  [[nodiscard]] Linearization linearize(const Eigen::Isometry3d& T,
                                        const RobustKernel& kernel) const override;

 private:
  const DistanceField& field_;
  Vector3 origin_world_;
  std::vector<double> half_widths_;  ///< h of each point
  std::vector<Vector3> sides_;       ///< p + h·n and p − h·n of each point
  Options options_;
  std::vector<std::uint8_t> is_matched_;
  std::size_t num_matched_ = 0;
};

}  // namespace gdfmap
