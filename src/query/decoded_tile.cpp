#include <algorithm>
#include <new>

#include <gdfmap/query/decoded_tile.hpp>

namespace gdfmap {
namespace {

constexpr std::align_val_t kAlignment{64};

}  // namespace

void DecodedTile::Free::operator()(float* data) const { ::operator delete[](data, kAlignment); }

DecodedTile::DecodedTile(const TileRecord& tile) : num_cubes_(tile.cubes.size()) {
  std::size_t num_units = 0;
  for (const CubeRecord& record : tile.cubes) {
    const std::size_t count = record.gaussians.size();
    const std::size_t stride = (count + kAlignedFloats - 1) / kAlignedFloats;
    cubes_[static_cast<std::size_t>(record.index)] = {static_cast<std::uint32_t>(num_units),
                                                      static_cast<std::uint32_t>(stride),
                                                      static_cast<std::uint32_t>(count),
                                                      record.errors.mae,
                                                      record.errors.max,
                                                      record.status,
                                                      record.cube_class,
                                                      true};
    num_units += stride * kNumGaussianRows;
  }
  num_floats_ = num_units * kAlignedFloats;
  data_.reset(static_cast<float*>(::operator new[](num_floats_ * sizeof(float), kAlignment)));
  std::fill_n(data_.get(), num_floats_, 0.0f);
  for (const CubeRecord& record : tile.cubes) {
    const Cube& cube = cubes_[static_cast<std::size_t>(record.index)];
    write_kernel(record.gaussians, data_.get() + cube.first * kAlignedFloats,
                 cube.stride * kAlignedFloats, 0);
  }
}

std::size_t DecodedTile::num_bytes() const { return sizeof(*this) + num_floats_ * sizeof(float); }

}  // namespace gdfmap
