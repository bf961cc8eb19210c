#include <cmath>
#include <cstdint>

#include <gdfmap/gdf1/model.hpp>

#include "harness.hpp"

namespace gdfmap::fuzz {
namespace {

/// A Gaussian of a CSV takes at least 13 digits and their separators.
constexpr std::uint64_t kLeastGaussianBytes = 26;

void check_cube(const Gdf1Cube& cube) {
  require(cube.key.level == 0 && cube.gaussians.size() > 0, "a cube has Gaussians");
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    for (const float value : cube.gaussians.row(row)) {
      require(std::isfinite(value), "parameters are finite");
    }
  }
}

bool read_model_bytes(MemoryFile& file, Input bytes) {
  const std::filesystem::path& path = file.hold(bytes);
  return accepts({ErrorCode::kCorrupt, ErrorCode::kUsage}, [&] {
    std::uint64_t num_gaussians = 0;
    static_cast<void>(visit_model(path, [&](Gdf1Cube&& cube) {
      check_cube(cube);
      num_gaussians += cube.gaussians.size();
    }));
    require(num_gaussians <= bytes.size() / kLeastGaussianBytes, "Gaussians need bytes");
    static_cast<void>(read_model_header(path));
  });
}

}  // namespace

bool fuzz_gdf1(Input bytes) {
  static MemoryFile file(".bin");
  return read_model_bytes(file, bytes);
}

bool fuzz_csv(Input bytes) {
  static MemoryFile file(".csv");
  return read_model_bytes(file, bytes);
}

}  // namespace gdfmap::fuzz
