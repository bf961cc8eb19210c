#pragma once

namespace gdfmap {

/// Errors of a cube's own Gaussians (no blending) at its held-out samples, in metres, after
/// rounding to the stored precision. NaN where unknown (imported cubes carry mae and rmse alone).
struct CubeErrors {
  float mae = 0.0f, rmse = 0.0f, p95 = 0.0f, max = 0.0f;
};

}  // namespace gdfmap
