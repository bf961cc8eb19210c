#pragma once

#include <cstdint>
#include <vector>

#include <gdfmap/align/factor.hpp>
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
  [[nodiscard]] std::vector<FieldSample> samples_at(const Eigen::Isometry3d& T) const;

  const DistanceField& field_;
  Vector3 origin_world_;
  const std::vector<Vector3>& source_;
  Options options_;
  std::vector<std::uint8_t> is_matched_;
  std::size_t num_matched_ = 0;
};

}  // namespace gdfmap
