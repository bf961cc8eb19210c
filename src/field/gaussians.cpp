#include <cmath>

#include <gdfmap/field/gaussians.hpp>

namespace gdfmap {

void write_kernel(const Gaussians& gaussians, float* data, std::size_t stride, std::size_t first) {
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    const bool is_sigma = row >= kRootSigmaX && row < kWeight;
    for (std::size_t k = 0; k < gaussians.size(); ++k) {
      const double value = gaussians.at(row, k);
      const double sigma = value * value;
      data[row * stride + first + k] = static_cast<float>(is_sigma ? 1.0 / (sigma * sigma) : value);
    }
  }
}

Kernel::Kernel(const Gaussians& gaussians)
    : data_(gaussians.size() * kNumGaussianRows), count_(gaussians.size()) {
  write_kernel(gaussians, data_.data(), count_, 0);
}

double evaluate(const KernelView& kernel, const Vector3& p_local) {
  double value = 0.0;
  for (std::size_t k = 0; k < kernel.count; ++k) {
    double exponent = 0.0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double d = p_local[static_cast<Eigen::Index>(a)] - kernel.row(kMeanX + a)[k];
      exponent += d * d * kernel.row(kRootSigmaX + a)[k];
    }
    value += kernel.row(kWeight)[k] * std::exp(-0.5 * exponent);
  }
  return value;
}

ValueGradient evaluate_with_gradient(const KernelView& kernel, const Vector3& p_local) {
  ValueGradient result;
  for (std::size_t k = 0; k < kernel.count; ++k) {
    const Vector3 mean(kernel.row(kMeanX)[k], kernel.row(kMeanX + 1)[k], kernel.row(kMeanX + 2)[k]);
    const Vector3 inverse_variance(kernel.row(kRootSigmaX)[k], kernel.row(kRootSigmaX + 1)[k],
                                   kernel.row(kRootSigmaX + 2)[k]);
    const Vector3 d = p_local - mean;
    const Vector3 scaled = d.cwiseProduct(inverse_variance);
    const double term = kernel.row(kWeight)[k] * std::exp(-0.5 * d.dot(scaled));
    result.value += term;
    result.gradient -= term * scaled;
  }
  return result;
}

}  // namespace gdfmap
