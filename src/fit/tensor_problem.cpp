#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/field/blending.hpp>
#include <gdfmap/fit/tensor_problem.hpp>

namespace gdfmap {
namespace {

constexpr int kN = kSamplesPerAxis;
constexpr double kLeastMarginWeight = 0.15;

/// Which of an axis' three vectors (value, d/dµ, d/dlog σ) a parameter asks for.
constexpr int basis_kind(int parameter, int axis) {
  if (parameter == kFitMean + axis) return 1;
  if (parameter == kFitLogSigma + axis) return 2;
  return 0;
}

template <typename Scalar>
using SquareN = Eigen::Matrix<Scalar, kN, kN, Eigen::RowMajor>;

}  // namespace

const std::array<double, kSamplesPerAxis>& axis_weights() {
  static const auto weights = [] {
    std::array<double, kSamplesPerAxis> result;
    for (int i = 0; i < kN; ++i) {
      const double x = sample_position(i);
      const double outside = std::max({-x, x - 1.0, 0.0});
      const double share = smoothstep((kMarginRatio - outside) / (2.0 * kMarginRatio));
      result[static_cast<std::size_t>(i)] =
          outside > 0.0 ? std::max(share, kLeastMarginWeight) : 1.0;
    }
    return result;
  }();
  return weights;
}

template <typename Scalar>
TensorProblem<Scalar>::TensorProblem(std::span<const float, kNumSamples> targets, double scale) {
  const Eigen::Map<const Eigen::Matrix<float, kN, kN * kN, Eigen::RowMajor>> grid(targets.data());
  target_ = (grid.template cast<double>() * scale).template cast<Scalar>();
}

template <typename Scalar>
Scalar TensorProblem<Scalar>::evaluate(const Parameters& parameters) {
  parameters_ = parameters;
  const Eigen::Index num_gaussians = parameters.cols();
  for (int a = 0; a < 3; ++a) {
    Basis& basis = basis_[static_cast<std::size_t>(a)];
    basis.resize(kN, 3 * num_gaussians);
    for (Eigen::Index k = 0; k < num_gaussians; ++k) {
      const Scalar mean = parameters(kFitMean + a, k);
      const Scalar inverse_sigma = std::exp(-parameters(kFitLogSigma + a, k));
      for (int i = 0; i < kN; ++i) {
        const Scalar u = (static_cast<Scalar>(sample_position(i)) - mean) * inverse_sigma;
        const Scalar value = std::exp(Scalar(-0.5) * u * u);
        basis(i, 3 * k) = value;
        basis(i, 3 * k + 1) = value * u * inverse_sigma;
        basis(i, 3 * k + 2) = value * u * u;
      }
    }
  }
  // model = Σ_k w_k x_k ⊗ (y_k ⊗ z_k): one matrix product over k.
  Eigen::Matrix<Scalar, kN, Eigen::Dynamic> x(kN, num_gaussians);
  Eigen::Matrix<Scalar, Eigen::Dynamic, kN * kN, Eigen::RowMajor> yz(num_gaussians, kN * kN);
  for (Eigen::Index k = 0; k < num_gaussians; ++k) {
    x.col(k) = basis_[0].col(3 * k) * parameters(kFitWeight, k);
    Eigen::Map<SquareN<Scalar>>(yz.row(k).data()) =
        basis_[1].col(3 * k) * basis_[2].col(3 * k).transpose();
  }
  residual_.noalias() = x * yz;
  residual_ -= target_;
  return Scalar(0.5) * residual_.cwiseProduct(weighted(residual_)).sum();
}

template <typename Scalar>
typename TensorProblem<Scalar>::Grid TensorProblem<Scalar>::weighted(const Grid& grid) const {
  static const Grid weights = [] {
    Grid result;
    const auto& w = axis_weights();
    for (std::size_t x = 0; x < kN; ++x) {
      for (std::size_t yz = 0; yz < kN * kN; ++yz) {
        result(static_cast<Eigen::Index>(x), static_cast<Eigen::Index>(yz)) =
            static_cast<Scalar>(w[x] * w[yz / kN] * w[yz % kN]);
      }
    }
    return result;
  }();
  return grid.cwiseProduct(weights);
}

template <typename Scalar>
typename TensorProblem<Scalar>::Matrix TensorProblem<Scalar>::gram(int axis) const {
  const Basis& basis = basis_[static_cast<std::size_t>(axis)];
  Eigen::Matrix<Scalar, kN, 1> weights;
  for (int i = 0; i < kN; ++i) {
    weights[i] = static_cast<Scalar>(axis_weights()[static_cast<std::size_t>(i)]);
  }
  return basis.transpose() * weights.asDiagonal() * basis;
}

template <typename Scalar>
void TensorProblem<Scalar>::normal_equations(Matrix& normal_matrix, Vector& gradient) const {
  const Eigen::Index num_gaussians = parameters_.cols();
  const std::array<Matrix, 3> grams = {gram(0), gram(1), gram(2)};
  normal_matrix.resize(kFitParameters * num_gaussians, kFitParameters * num_gaussians);
  for (Eigen::Index l = 0; l < num_gaussians; ++l) {
    for (Eigen::Index k = l; k < num_gaussians; ++k) {
      for (int q = 0; q < kFitParameters; ++q) {
        const Scalar q_factor = q == kFitWeight ? Scalar(1) : parameters_(kFitWeight, l);
        for (int p = 0; p < kFitParameters; ++p) {
          Scalar entry = p == kFitWeight ? q_factor : q_factor * parameters_(kFitWeight, k);
          for (int a = 0; a < 3; ++a) {
            entry *= grams[static_cast<std::size_t>(a)](3 * k + basis_kind(p, a),
                                                        3 * l + basis_kind(q, a));
          }
          normal_matrix(kFitParameters * k + p, kFitParameters * l + q) = entry;
          normal_matrix(kFitParameters * l + q, kFitParameters * k + p) = entry;
        }
      }
    }
  }

  // Jᵀr: contract the weighted residual with the x vectors, then per Gaussian with y and z.
  const Eigen::Matrix<Scalar, Eigen::Dynamic, kN * kN, Eigen::RowMajor> over_x =
      basis_[0].transpose() * weighted(residual_);
  gradient.resize(kFitParameters * num_gaussians);
  for (Eigen::Index k = 0; k < num_gaussians; ++k) {
    for (int p = 0; p < kFitParameters; ++p) {
      const Eigen::Map<const SquareN<Scalar>> plane(over_x.row(3 * k + basis_kind(p, 0)).data());
      const Scalar contracted = basis_[1].col(3 * k + basis_kind(p, 1)).transpose() * plane *
                                basis_[2].col(3 * k + basis_kind(p, 2));
      gradient[kFitParameters * k + p] =
          p == kFitWeight ? contracted : contracted * parameters_(kFitWeight, k);
    }
  }
}

template <typename Scalar>
typename TensorProblem<Scalar>::Vector TensorProblem<Scalar>::solve_weights(Scalar ridge) const {
  const Eigen::Index num_gaussians = parameters_.cols();
  const std::array<Matrix, 3> grams = {gram(0), gram(1), gram(2)};
  Matrix normal_matrix(num_gaussians, num_gaussians);
  for (Eigen::Index l = 0; l < num_gaussians; ++l) {
    for (Eigen::Index k = 0; k < num_gaussians; ++k) {
      normal_matrix(k, l) =
          grams[0](3 * k, 3 * l) * grams[1](3 * k, 3 * l) * grams[2](3 * k, 3 * l);
    }
  }
  const Eigen::Matrix<Scalar, Eigen::Dynamic, kN * kN, Eigen::RowMajor> over_x =
      basis_[0].transpose() * weighted(target_);
  Vector right(num_gaussians);
  for (Eigen::Index k = 0; k < num_gaussians; ++k) {
    const Eigen::Map<const SquareN<Scalar>> plane(over_x.row(3 * k).data());
    right[k] = basis_[1].col(3 * k).transpose() * plane * basis_[2].col(3 * k);
  }
  normal_matrix.diagonal().array() +=
      ridge * normal_matrix.trace() / static_cast<Scalar>(num_gaussians);
  return normal_matrix.ldlt().solve(right);
}

template class TensorProblem<float>;
template class TensorProblem<double>;

}  // namespace gdfmap
