#include <algorithm>
#include <new>

#include <gdfmap/query/decoded_tile.hpp>

namespace gdfmap {
namespace {

constexpr std::align_val_t kRowAlignment{64};
constexpr std::size_t kRowFloats = 16;  ///< 64 bytes
constexpr std::size_t kCubeFloats = 8;  ///< 32 bytes

constexpr std::size_t round_up(std::size_t value, std::size_t step) {
  return (value + step - 1) / step * step;
}

}  // namespace

void DecodedTile::Free::operator()(float* data) const { ::operator delete[](data, kRowAlignment); }

DecodedTile::DecodedTile(const TileRecord& tile) {
  slots_.fill(-1);
  cubes_.reserve(tile.cubes.size());
  std::size_t columns = 0;
  for (const CubeRecord& cube : tile.cubes) {
    slots_[static_cast<std::size_t>(cube.index)] = static_cast<std::int16_t>(cubes_.size());
    cubes_.push_back({static_cast<std::uint32_t>(columns),
                      static_cast<std::uint32_t>(cube.gaussians.size()), cube.status,
                      cube.cube_class, cube.errors.mae});
    columns += round_up(cube.gaussians.size(), kCubeFloats);
  }
  stride_ = round_up(columns, kRowFloats);
  const std::size_t num_floats = stride_ * kNumGaussianRows;
  data_.reset(static_cast<float*>(::operator new[](num_floats * sizeof(float), kRowAlignment)));
  std::fill_n(data_.get(), num_floats, 0.0f);
  for (std::size_t i = 0; i < cubes_.size(); ++i) {
    write_kernel(tile.cubes[i].gaussians, data_.get(), stride_, cubes_[i].first);
  }
}

std::size_t DecodedTile::num_bytes() const {
  return sizeof(*this) + cubes_.capacity() * sizeof(Cube) +
         stride_ * kNumGaussianRows * sizeof(float);
}

}  // namespace gdfmap
