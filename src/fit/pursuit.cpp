#include "pursuit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace gdfmap {
namespace {

using Problem = TensorProblem<double>;

constexpr int kAtomsPerRound = 4;
constexpr double kRidge = 1e-6;

/// Atoms of one width along an axis, in edges; they reach from −extension to 1 + extension.
struct AtomFamily {
  double sigma, spacing, extension;
};
constexpr std::array<AtomFamily, 4> kFamilies = {
    {{0.12, 0.25, -0.125}, {0.25, 0.25, 0.0}, {0.5, 0.5, 0.25}, {1.2, 1.0, 0.25}}};

/// The 1-D dictionary with what pursuit needs of it. A tensor atom is a triple of its atoms.
struct Dictionary {
  std::vector<double> mean, sigma;
  Eigen::MatrixXd weighted;  ///< samples × atoms, times the axis weights
  Eigen::MatrixXd gram;      ///< weighted inner products

  Dictionary() {
    for (const AtomFamily& family : kFamilies) {
      const double length = 1.0 + 2.0 * family.extension;
      const int count = static_cast<int>(std::floor(length / family.spacing + 1e-9)) + 1;
      for (int i = 0; i < count; ++i) {
        mean.push_back(0.5 + family.spacing * (i - 0.5 * (count - 1)));
        sigma.push_back(family.sigma);
      }
    }
    const auto num_atoms = static_cast<Eigen::Index>(mean.size());
    Eigen::MatrixXd values(kSamplesPerAxis, num_atoms);
    for (int i = 0; i < kSamplesPerAxis; ++i) {
      for (Eigen::Index j = 0; j < num_atoms; ++j) {
        const auto atom = static_cast<std::size_t>(j);
        const double u = (sample_position(i) - mean[atom]) / sigma[atom];
        values(i, j) = std::exp(-0.5 * u * u);
      }
    }
    const Eigen::Map<const Eigen::VectorXd> weights(axis_weights().data(), kSamplesPerAxis);
    weighted = weights.asDiagonal() * values;
    gram = values.transpose() * weighted;
  }

  [[nodiscard]] Eigen::Index size() const { return gram.cols(); }
};

const Dictionary& dictionary() {
  static const Dictionary instance;
  return instance;
}

using Atom = std::array<Eigen::Index, 3>;

/// Correlation of every tensor atom with what the model still misses. Rows run along x, columns
/// along y and z (z fastest).
class Correlations {
 public:
  explicit Correlations(const Problem::Grid& residual)
      : n_(dictionary().size()), values_(n_, n_ * n_) {
    const Eigen::MatrixXd& basis = dictionary().weighted;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const RowMajor over_x = -(basis.transpose() * residual);
    for (Eigen::Index x = 0; x < n_; ++x) {
      const Eigen::Map<const RowMajor> plane(over_x.row(x).data(), kSamplesPerAxis,
                                             kSamplesPerAxis);
      Eigen::Map<RowMajor>(values_.row(x).data(), n_, n_) = basis.transpose() * plane * basis;
    }
  }

  /// The atom that lowers the cost most: largest correlation²/norm².
  [[nodiscard]] Atom best() const {
    const Eigen::MatrixXd& gram = dictionary().gram;
    Atom best_atom{};
    double best_gain = -1.0;
    for (Eigen::Index x = 0; x < n_; ++x) {
      for (Eigen::Index y = 0; y < n_; ++y) {
        for (Eigen::Index z = 0; z < n_; ++z) {
          const double c = values_(x, y * n_ + z);
          const double gain = c * c / (gram(x, x) * gram(y, y) * gram(z, z));
          if (gain > best_gain) {
            best_gain = gain;
            best_atom = {x, y, z};
          }
        }
      }
    }
    return best_atom;
  }

  /// Subtracts the projection on an atom, so that the next best one is another.
  void deflate(const Atom& atom) {
    const Eigen::MatrixXd& gram = dictionary().gram;
    const double weight =
        values_(atom[0], atom[1] * n_ + atom[2]) /
        (gram(atom[0], atom[0]) * gram(atom[1], atom[1]) * gram(atom[2], atom[2]));
    for (Eigen::Index x = 0; x < n_; ++x) {
      for (Eigen::Index y = 0; y < n_; ++y) {
        values_.row(x).segment(y * n_, n_) -=
            weight * gram(x, atom[0]) * gram(y, atom[1]) * gram.col(atom[2]).transpose();
      }
    }
  }

 private:
  Eigen::Index n_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> values_;
};

void set_atom(Problem::Parameters& parameters, Eigen::Index k, const Atom& atom) {
  parameters(kFitWeight, k) = 0.0;
  for (int a = 0; a < 3; ++a) {
    const auto index = static_cast<std::size_t>(atom[static_cast<std::size_t>(a)]);
    parameters(kFitMean + a, k) = dictionary().mean[index];
    parameters(kFitLogSigma + a, k) = std::log(dictionary().sigma[index]);
  }
}

}  // namespace

Problem::Parameters add_gaussians(Problem& problem, const Problem::Parameters& start, int count) {
  Problem::Parameters parameters = start;
  problem.evaluate(parameters);
  while (count > 0) {
    const int added = std::min(count, kAtomsPerRound);
    const Eigen::Index first = parameters.cols();
    parameters.conservativeResize(Eigen::NoChange, first + added);
    Correlations correlations(problem.residual());
    for (int i = 0; i < added; ++i) {
      const Atom atom = correlations.best();
      correlations.deflate(atom);
      set_atom(parameters, first + i, atom);
    }
    problem.evaluate(parameters);
    parameters.row(kFitWeight) = problem.solve_weights(kRidge).transpose();
    problem.evaluate(parameters);
    count -= added;
  }
  return parameters;
}

}  // namespace gdfmap
