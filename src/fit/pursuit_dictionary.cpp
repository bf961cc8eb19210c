#include "pursuit_dictionary.hpp"

#include <array>
#include <cmath>
#include <vector>

#include <gdfmap/fit/cube_problem.hpp>

namespace gdfmap {
namespace {

/// Atoms of one width along an axis, in edges; they reach from −extension to 1 + extension.
struct AtomFamily {
  double sigma, spacing, extension;
};
constexpr std::array<AtomFamily, 4> kFamilies = {
    {{0.12, 0.25, -0.125}, {0.25, 0.25, 0.0}, {0.5, 0.5, 0.25}, {1.2, 1.0, 0.25}}};

struct Atom {
  double mean, sigma;
  std::vector<double> value;  // at the samples of an axis
};

std::vector<Atom> make_atoms(const TrainingGrid& grid) {
  std::vector<Atom> atoms;
  for (const AtomFamily& family : kFamilies) {
    const double length = 1.0 + 2.0 * family.extension;
    const int count = static_cast<int>(std::floor(length / family.spacing + 1e-9)) + 1;
    for (int i = 0; i < count; ++i) {
      Atom atom{0.5 + family.spacing * (i - 0.5 * (count - 1)), family.sigma, {}};
      for (int j = 0; j < grid.per_axis(); ++j) {
        const double u = (grid.position(j) - atom.mean) / atom.sigma;
        atom.value.push_back(std::exp(-0.5 * u * u));
      }
      atoms.push_back(atom);
    }
  }
  return atoms;
}

double weighted_product(const Atom& a, const Atom& b, const std::vector<double>& weights) {
  double sum = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) sum += weights[i] * a.value[i] * b.value[i];
  return sum;
}

template <typename Scalar>
PursuitDictionary<Scalar> make_dictionary(const TrainingGrid& grid) {
  const std::vector<Atom> atoms = make_atoms(grid);
  const std::vector<double> weights = axis_weights(grid);
  const std::size_t n = atoms.size();
  PursuitDictionary<Scalar> d{};
  d.num_atoms = static_cast<int>(n);
  std::vector<double> norm(n);
  for (std::size_t i = 0; i < n; ++i) {
    d.mean[i] = static_cast<Scalar>(atoms[i].mean);
    d.log_sigma[i] = static_cast<Scalar>(std::log(atoms[i].sigma));
    for (std::size_t j = 0; j < weights.size(); ++j) {
      d.value[i][j] = static_cast<Scalar>(atoms[i].value[j]);
    }
    for (std::size_t j = 0; j < n; ++j) {
      d.gram[i][j] = static_cast<Scalar>(weighted_product(atoms[i], atoms[j], weights));
    }
    norm[i] = weighted_product(atoms[i], atoms[i], weights);
  }
  for (std::size_t x = 0; x < n; ++x) {
    for (std::size_t y = 0; y < n; ++y) {
      for (std::size_t z = 0; z < n; ++z) {
        d.inverse_norm[x][y][z] = static_cast<Scalar>(1.0 / (norm[x] * norm[y] * norm[z]));
      }
    }
  }
  return d;
}

}  // namespace

template <typename Scalar>
const PursuitDictionary<Scalar>& pursuit_dictionary(const TrainingGrid& grid) {
  static const PursuitDictionary<Scalar> populated = make_dictionary<Scalar>(kPopulatedGrid);
  static const PursuitDictionary<Scalar> empty = make_dictionary<Scalar>(kEmptyGrid);
  return grid == kPopulatedGrid ? populated : empty;
}

template const PursuitDictionary<float>& pursuit_dictionary<float>(const TrainingGrid&);
template const PursuitDictionary<double>& pursuit_dictionary<double>(const TrainingGrid&);

}  // namespace gdfmap
