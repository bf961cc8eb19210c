#pragma once

#include "kernels.hpp"

namespace gdfmap {

/// The atoms that pursuit chooses from: Gaussians of four widths, each at regular places along an
/// axis, in all combinations over the axes. `Scalar` is float or double; the grid is one of
/// kTrainingGrids.
template <typename Scalar>
[[nodiscard]] const PursuitDictionary<Scalar>& pursuit_dictionary(const TrainingGrid& grid);

}  // namespace gdfmap
