#include "sidecar.hpp"

#include <algorithm>
#include <string>
#include <system_error>
#include <vector>

#include <nlohmann/json.hpp>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/error.hpp>

#include "format.hpp"
#include "input_file.hpp"

namespace gdfmap::gdf1 {
namespace {

constexpr std::uint64_t kMaxSidecarBytes = 65536;

[[noreturn]] void throw_corrupt(const std::filesystem::path& path, const std::string& what) {
  throw Error(ErrorCode::kCorrupt, path.string() + ": " + what);
}

std::string read_text(const std::filesystem::path& path) {
  InputFile file(path);
  if (file.remaining() > kMaxSidecarBytes) throw_corrupt(path, "too long for a model's shift");
  std::string text(static_cast<std::size_t>(file.remaining()), '\0');
  file.read(std::as_writable_bytes(std::span(text)), "the shift");
  return text;
}

Vector3 parse_shift(const nlohmann::json& json, const std::filesystem::path& path) {
  const auto found = json.find("shift");
  const bool is_triple = found != json.end() && found->is_array() && found->size() == 3;
  Vector3 shift = Vector3::Zero();
  for (std::size_t a = 0; is_triple && a < 3; ++a) {
    if (!(*found)[a].is_number()) throw_corrupt(path, "shift: not a number");
    shift[static_cast<Eigen::Index>(a)] = (*found)[a].get<double>();
  }
  if (!is_triple || !shift.allFinite()) throw_corrupt(path, "shift: three numbers are expected");
  return shift;
}

std::optional<double> parse_cube_size(const nlohmann::json& json,
                                      const std::filesystem::path& path) {
  const auto found = json.find("cube_size");
  if (found == json.end()) return std::nullopt;
  if (!found->is_number() || !(found->get<double>() > 0.0)) {
    throw_corrupt(path, "cube_size: a positive number is expected");
  }
  return found->get<double>();
}

std::optional<Digest> parse_digest(const nlohmann::json& json, const char* key,
                                   const std::filesystem::path& path) {
  const auto found = json.find(key);
  if (found == json.end()) return std::nullopt;
  const auto digest =
      found->is_string() ? Digest::from_hex(found->get_ref<const std::string&>()) : std::nullopt;
  if (!digest) throw_corrupt(path, std::string(key) + ": 32 hexadecimal digits are expected");
  return digest;
}

Digest digest_of_model(const std::filesystem::path& model, ModelFormat format) {
  InputFile file(model);
  file.skip(digest_offset(format));
  StreamHasher hasher;
  std::vector<std::byte> chunk(std::size_t{1} << 18);
  while (file.remaining() > 0) {
    const auto size =
        static_cast<std::size_t>(std::min<std::uint64_t>(chunk.size(), file.remaining()));
    const std::span<std::byte> bytes(chunk.data(), size);
    file.read(bytes, "the cubes");
    hasher.update(bytes);
  }
  return hasher.digest();
}

}  // namespace

std::filesystem::path sidecar_path(const std::filesystem::path& model) {
  std::filesystem::path path = model;
  path += ".json";
  return path;
}

void write_sidecar(const std::filesystem::path& model, const Sidecar& sidecar) {
  nlohmann::ordered_json json;
  json["shift"] = {sidecar.shift.x(), sidecar.shift.y(), sidecar.shift.z()};
  if (sidecar.cube_size) json["cube_size"] = *sidecar.cube_size;
  if (sidecar.content_digest) json["content_digest"] = sidecar.content_digest->hex();
  if (sidecar.model_digest) json["model_digest"] = sidecar.model_digest->hex();
  AtomicFile file(sidecar_path(model));
  file.write(json.dump() + "\n");
  file.commit();
}

void remove_sidecar(const std::filesystem::path& model) {
  const std::filesystem::path path = sidecar_path(model);
  std::error_code error;
  std::filesystem::remove(path, error);
  if (error) {
    throw Error(ErrorCode::kIo, "cannot remove " + path.string() + ": " + error.message());
  }
}

std::optional<Sidecar> read_sidecar(const std::filesystem::path& model, ModelFormat format) {
  const std::filesystem::path path = sidecar_path(model);
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) return std::nullopt;
  const auto json = nlohmann::json::parse(read_text(path), nullptr, false);
  if (!json.is_object()) throw_corrupt(path, "not the shift of a model");
  Sidecar sidecar{parse_shift(json, path), parse_cube_size(json, path),
                  parse_digest(json, "content_digest", path),
                  parse_digest(json, "model_digest", path)};
  if (sidecar.model_digest && *sidecar.model_digest != digest_of_model(model, format)) {
    throw_corrupt(path, "belongs to other bytes than those of " + model.filename().string() +
                            " (an interrupted export?): export the model again");
  }
  return sidecar;
}

}  // namespace gdfmap::gdf1
