#pragma once

#include <filesystem>
#include <optional>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/hash.hpp>
#include <gdfmap/gdf1/model.hpp>

namespace gdfmap::gdf1 {

/// What stands in PATH.json beside a shifted model.
struct Sidecar {
  Vector3 shift = Vector3::Zero();  ///< world minus file coordinates, metres
  std::optional<double> cube_size;  ///< metres, in full precision, where the header has float32
  std::optional<Digest> content_digest;  ///< of the map's cubes
  std::optional<Digest> model_digest;    ///< of the model's bytes from digest_offset() on
};

[[nodiscard]] std::filesystem::path sidecar_path(const std::filesystem::path& model);

/// Publishes PATH.json. @throws Error kIo
void write_sidecar(const std::filesystem::path& model, const Sidecar& sidecar);
/// @throws Error kIo when it is there and stays.
void remove_sidecar(const std::filesystem::path& model);

/// Empty when there is no PATH.json.
/// @throws Error kIo; kCorrupt when it is no sidecar, or belongs to other bytes than the model's.
[[nodiscard]] std::optional<Sidecar> read_sidecar(const std::filesystem::path& model,
                                                  ModelFormat format);

}  // namespace gdfmap::gdf1
