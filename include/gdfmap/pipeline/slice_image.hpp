#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace gdfmap {

/// Distances on a plane, to be drawn as a figure. Samples are row-major, u to the right, v upwards;
/// sample (i, j) lies at (u0 + i · resolution, v0 + j · resolution).
struct SliceImage {
  int width = 0, height = 0;  ///< samples
  double resolution = 0.05;   ///< metres between samples
  double u0 = 0.0, v0 = 0.0;  ///< metres, of the first sample
  std::string u_axis = "x", v_axis = "y";
  std::string title;                   ///< may be empty
  std::vector<float> distance;         ///< metres; NaN: unknown
  std::vector<std::uint8_t> is_bound;  ///< not 0: a lower bound only (kFar); empty: none is
  /// The gradient's parts along u and v; empty: no arrows. NaN: none here.
  std::vector<float> gradient_u, gradient_v;
  double largest_distance = 0.0;  ///< metres that the colours reach at least, for a common scale
};

/// The largest distance that is neither unknown nor a bound, metres; 0 without any.
[[nodiscard]] double largest_estimate(const SliceImage& slice);

/// The longest side of a picture, pixels.
inline constexpr int kMaxPictureSide = 16384;

/// Draws a figure as a PNG file, which appears complete or not at all: colours with their scale,
/// the surface, iso-lines at round distances, axes in metres, a legend of what else is shown.
/// Unknown samples are hatched, lower bounds pale; arrows show the gradient at regular places, a
/// slope of 1 in the plane as the longest. Small slices are enlarged by a whole factor. The
/// bytes depend on the arguments and on the installed version of cairo and its fonts alone. Needs 4
/// bytes of memory per pixel.
/// @throws Error kUsage when sizes do not match or the picture would exceed kMaxPictureSide; kIo.
void draw_slice(const SliceImage& slice, const std::filesystem::path& png);

}  // namespace gdfmap
