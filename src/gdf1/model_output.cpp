#include "model_output.hpp"

#include <string>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/core/failpoint.hpp>

#include "format.hpp"
#include "sidecar.hpp"

namespace gdfmap::gdf1 {
namespace {

Placement checked_placement(const std::filesystem::path& path, double cube_size,
                            const Vector3& shift) {
  const auto placement = Placement::make(cube_size, shift);
  if (!placement) {
    throw Error(ErrorCode::kUsage, path.string() +
                                       ": the cube size must be positive and the shift "
                                       "a whole number of cubes");
  }
  return *placement;
}

}  // namespace

ModelOutput::ModelOutput(const std::filesystem::path& path, ModelFormat format, double cube_size,
                         const Vector3& shift, const Digest& content_digest)
    : path_(path),
      placement_(checked_placement(path, cube_size, shift)),
      content_digest_(content_digest),
      file_(path) {
  const Bytes front(digest_offset(format));
  if (!front.empty()) file_.write(front);
}

std::array<float, 3> ModelOutput::admit(const Gdf1Cube& cube) {
  if (cube.key.level != 0 || cube.gaussians.size() == 0) {
    throw Error(ErrorCode::kInternal, path_.string() +
                                          ": only level-0 cubes with Gaussians belong "
                                          "into a model");
  }
  const std::array<std::int64_t, 3> key = {cube.key.x, cube.key.y, cube.key.z};
  std::array<float, 3> origin{};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto value = placement_.file_origin(key[a], a);
    if (!value) {
      throw Error(ErrorCode::kUsage, path_.string() + ": float32 cannot tell cubes of " +
                                         std::to_string(placement_.cube_size()) +
                                         " m apart as far out as cube " + std::to_string(key[a]) +
                                         ": export parts of the map with --region");
    }
    origin[a] = *value;
  }
  ++num_cubes_;
  return origin;
}

void ModelOutput::append(std::span<const std::byte> bytes) {
  file_.write(bytes);
  hasher_.update(bytes);
}

void ModelOutput::publish(const Gdf1Header& header) {
  if (header.num_cubes != num_cubes_ || header.cube_size != placement_.cube_size()) {
    throw Error(ErrorCode::kInternal, path_.string() +
                                          ": the header speaks of other cubes than "
                                          "the " +
                                          std::to_string(num_cubes_) + " that were written");
  }
  const Vector3 shift = placement_.shift();
  const bool is_shifted = !shift.isZero(0.0);
  if (is_shifted) {
    write_sidecar(path_, {shift, placement_.cube_size(), content_digest_, hasher_.digest()});
    failpoint("gdf1.sidecar_published");
  }
  file_.commit();
  failpoint("gdf1.model_published");
  if (!is_shifted) remove_sidecar(path_);
}

}  // namespace gdfmap::gdf1
