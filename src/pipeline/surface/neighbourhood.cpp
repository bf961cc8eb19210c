#include "neighbourhood.hpp"

#include <algorithm>

namespace gdfmap::surface {

Neighbourhood::Neighbourhood(TileCache& cache, const CubeKey& low, const CubeKey& high)
    : low_(low), high_(high) {
  cubes_.resize(place_of(high) + 1);
  const TileKey first = tile_of(low), last = tile_of(high);
  for (std::int32_t x = first.x; x <= last.x; ++x) {
    for (std::int32_t y = first.y; y <= last.y; ++y) {
      for (std::int32_t z = first.z; z <= last.z; ++z) {
        if (auto tile = cache.get({low.level, x, y, z}).tile)
          tiles_.push_back(std::move(tile));
        else
          tiles_.push_back(nullptr);
      }
    }
  }
  const auto tile_at = [&](const TileKey& key) {
    const auto along = [](std::int32_t from, std::int32_t to) {
      return static_cast<std::size_t>(to - from);
    };
    const std::size_t ny = along(first.y, last.y) + 1, nz = along(first.z, last.z) + 1;
    const std::size_t place =
        (along(first.x, key.x) * ny + along(first.y, key.y)) * nz + along(first.z, key.z);
    return tiles_[place].get();
  };
  for_each([&](const CubeKey& key, const Cube*) {
    const DecodedTile* const tile = tile_at(tile_of(key));
    if (tile == nullptr) return;
    const DecodedTile::Cube* const cube = tile->find_served(cube_index_in_tile(key));
    if (cube == nullptr) return;
    cubes_[place_of(key)] = {true, tile->kernel(*cube), static_cast<double>(cube->mae)};
  });
}

std::size_t Neighbourhood::place_of(const CubeKey& key) const {
  const auto along = [](std::int64_t from, std::int64_t to) {
    return static_cast<std::size_t>(to - from);
  };
  const std::size_t ny = along(low_.y, high_.y) + 1, nz = along(low_.z, high_.z) + 1;
  return (along(low_.x, key.x) * ny + along(low_.y, key.y)) * nz + along(low_.z, key.z);
}

const Neighbourhood::Cube* Neighbourhood::find(const CubeKey& key) const {
  const bool is_inside = key.x >= low_.x && key.x <= high_.x && key.y >= low_.y &&
                         key.y <= high_.y && key.z >= low_.z && key.z <= high_.z;
  return is_inside ? at(place_of(key)) : nullptr;
}

GaussianRows GaussianRowsBuffer::fill(const KernelView& cube) {
  const std::size_t stride = padded(cube.count);
  floats_.resize(stride * kNumGaussianRows);
  float* const rows = floats_.data();
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    float* const end = std::copy_n(cube.row(row), cube.count, rows + row * stride);
    std::fill(end, rows + (row + 1) * stride, 0.0f);
  }
  const auto row = [&](std::size_t r) { return rows + r * stride; };
  return {{row(0), row(1), row(2)}, {row(3), row(4), row(5)}, row(kWeight), cube.count, stride};
}

}  // namespace gdfmap::surface
