#include <algorithm>
#include <new>

#include <gdfmap/query/decoded_tile.hpp>

namespace gdfmap {
namespace {

constexpr std::align_val_t kAlignment{64};

constexpr std::size_t round_up(std::size_t value, std::size_t step) {
  return (value + step - 1) / step * step;
}

}  // namespace

void DecodedTile::Free::operator()(float* data) const { ::operator delete[](data, kAlignment); }

DecodedTile::DecodedTile(const TileRecord& tile) {
  slots_.fill(-1);
  cubes_.reserve(tile.cubes.size());
  for (const CubeRecord& cube : tile.cubes) {
    slots_[static_cast<std::size_t>(cube.index)] = static_cast<std::int16_t>(cubes_.size());
    const std::size_t count = cube.gaussians.size(), stride = round_up(count, kAlignedFloats);
    cubes_.push_back({num_floats_, static_cast<std::uint32_t>(stride),
                      static_cast<std::uint32_t>(count), cube.status, cube.cube_class,
                      cube.errors.mae, cube.errors.max});
    num_floats_ += stride * kNumGaussianRows;
  }
  data_.reset(static_cast<float*>(::operator new[](num_floats_ * sizeof(float), kAlignment)));
  std::fill_n(data_.get(), num_floats_, 0.0f);
  for (std::size_t i = 0; i < cubes_.size(); ++i) {
    write_kernel(tile.cubes[i].gaussians, data_.get() + cubes_[i].first, cubes_[i].stride, 0);
  }
}

std::size_t DecodedTile::num_bytes() const {
  return sizeof(*this) + cubes_.capacity() * sizeof(Cube) + num_floats_ * sizeof(float);
}

}  // namespace gdfmap
