#include "cube_builder.hpp"

#include <cmath>
#include <limits>

#include "format.hpp"

namespace gdfmap::gdf1 {
namespace {

std::optional<CubeKey> key_of(const Placement& placement, const std::array<float, 3>& origin) {
  const auto x = placement.key(origin[0], 0);
  const auto y = placement.key(origin[1], 1);
  const auto z = placement.key(origin[2], 2);
  if (!x || !y || !z) return std::nullopt;
  return CubeKey{0, *x, *y, *z};
}

float error_or_unknown(float value) {
  return std::isfinite(value) && value >= 0.0f ? value : std::numeric_limits<float>::quiet_NaN();
}

bool is_usable(const FileGaussian& local) {
  for (const float value : local) {
    if (!std::isfinite(value)) return false;
  }
  for (std::size_t row = kRootSigmaX; row < kWeight; ++row) {
    const auto root_sigma = static_cast<double>(local[row]);
    if (root_sigma * root_sigma < kMinStandardDeviation) return false;
  }
  return true;
}

Gaussians to_rows(const std::vector<FileGaussian>& list) {
  Gaussians gaussians(list.size());
  for (std::size_t k = 0; k < list.size(); ++k) {
    for (std::size_t row = 0; row < kNumGaussianRows; ++row) gaussians.at(row, k) = list[k][row];
  }
  return gaussians;
}

}  // namespace

std::size_t CubeBuilder::KeyHash::operator()(const CubeKey& key) const noexcept {
  const std::size_t tile = TileKeyHash{}(tile_of(key));
  return tile * kCubesPerTile + static_cast<std::size_t>(cube_index_in_tile(key));
}

void CubeBuilder::begin(const std::array<float, 3>& file_origin, float mae,
                        float standard_deviation) {
  key_ = key_of(placement_, file_origin);
  if (key_ && seen_.contains(*key_)) key_.reset();
  mae_ = error_or_unknown(mae);
  standard_deviation_ = error_or_unknown(standard_deviation);
  gaussians_.clear();
}

void CubeBuilder::add(const FileGaussian& gaussian) {
  if (!key_) return;
  FileGaussian local = gaussian;
  const std::array<std::int64_t, 3> key = {key_->x, key_->y, key_->z};
  for (std::size_t a = 0; a < 3; ++a) {
    local[kMeanX + a] = placement_.local_mean(key[a], a, gaussian[kMeanX + a]);
    local[kRootSigmaX + a] = std::abs(gaussian[kRootSigmaX + a]);
  }
  if (is_usable(local)) {
    gaussians_.push_back(local);
  } else {
    ++counts_.num_dropped_gaussians;
  }
}

void CubeBuilder::end() {
  // A cube without Gaussians would evaluate to 0 everywhere, which says "surface".
  if (!key_ || gaussians_.empty()) {
    ++counts_.num_dropped_cubes;
    return;
  }
  seen_.insert(*key_);
  (*visit_)({*key_, mae_, standard_deviation_, to_rows(gaussians_)});
}

}  // namespace gdfmap::gdf1
