#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>

#include "cube_builder.hpp"
#include "cube_size.hpp"
#include "format.hpp"
#include "input_file.hpp"
#include "sidecar.hpp"

namespace gdfmap::gdf1 {
namespace {

[[noreturn]] void throw_corrupt(const InputFile& file, const std::string& what) {
  throw Error(ErrorCode::kCorrupt, file.path().string() + ": " + what);
}

Vector3 get_vector(ByteReader& in) {
  Vector3 v;
  for (Eigen::Index a = 0; a < 3; ++a) v[a] = static_cast<double>(in.get<float>());
  return v;
}

/// Cube size and blending margin are all that reading and evaluating depend on.
void check(const InputFile& file, const Gdf1Header& header) {
  if (!std::isfinite(header.cube_size) || header.cube_size <= 0.0) {
    throw_corrupt(file, "header: cube size " + std::to_string(header.cube_size) + " m");
  }
  if (!(header.margin >= 0.0 && header.margin <= 0.5 * header.cube_size)) {
    throw_corrupt(file, "header: margin " + std::to_string(header.margin) +
                            " m is not between 0 and half a cube");
  }
  if (header.num_cubes > file.remaining() / kCubeBytes) {
    throw_corrupt(
        file, "header: " + std::to_string(header.num_cubes) + " cubes do not fit into the file");
  }
}

Gdf1Header read_header(InputFile& file) {
  std::array<std::byte, kHeaderBytes> bytes{};
  file.read(bytes, "header");
  ByteReader in(bytes, file.path().string());
  const auto magic = in.get_bytes(kMagic.size());
  if (!std::equal(magic.begin(), magic.end(), std::as_bytes(std::span(kMagic)).begin())) {
    throw_corrupt(file, "not a GDF1 file");
  }
  if (const auto version = in.get<std::uint32_t>(); version != kVersion) {
    throw_corrupt(file, "GDF1 version " + std::to_string(version) + ", only 1 can be read");
  }
  Gdf1Header header;
  header.num_cubes = in.get<std::uint32_t>();
  header.average_mae = in.get<float>();
  header.average_standard_deviation = in.get<float>();
  const Vector3 min = get_vector(in), max = get_vector(in);
  if (min.allFinite() && max.allFinite()) header.bounds = Box3(min, max);
  header.cube_size = decimal_of(in.get<float>());
  header.empty_search_margin = decimal_of(in.get<float>());
  header.margin = decimal_of(in.get<float>());
  check(file, header);
  return header;
}

/// The header with what PATH.json knows better.
Placement place(Gdf1Header& header, const InputFile& file) {
  const auto sidecar = read_sidecar(file.path(), ModelFormat::kGdf1);
  const Vector3 shift = sidecar ? sidecar->shift : Vector3::Zero();
  if (sidecar && sidecar->cube_size) {
    if (static_cast<float>(*sidecar->cube_size) != static_cast<float>(header.cube_size)) {
      throw_corrupt(
          file, "cube_size differs from that in " + sidecar_path(file.path()).filename().string());
    }
    header.cube_size = *sidecar->cube_size;
  }
  const auto placement = Placement::make(header.cube_size, shift);
  if (!placement) {
    throw_corrupt(file, "the shift in " + sidecar_path(file.path()).filename().string() +
                            " is not a whole number of cubes");
  }
  if (!header.bounds.isEmpty()) header.bounds.translate(placement->shift());
  return *placement;
}

FileGaussian read_gaussian(ByteReader& in) {
  [[maybe_unused]] const auto id = in.get<std::uint32_t>();
  FileGaussian gaussian;
  for (float& value : gaussian) value = in.get<float>();
  return gaussian;
}

void read_cube(InputFile& file, CubeBuilder& builder, const std::string& place_name) {
  std::array<std::byte, kCubeBytes> bytes{};
  file.read(bytes, place_name);
  ByteReader in(bytes, place_name);
  std::array<float, 3> origin{};
  for (float& value : origin) value = in.get<float>();
  const auto mae = in.get<float>();
  builder.begin(origin, mae, in.get<float>());
  const auto num_gaussians = in.get<std::uint32_t>();
  if (num_gaussians > file.remaining() / kGaussianBytes) {
    throw_corrupt(file, place_name + ": " + std::to_string(num_gaussians) +
                            " Gaussians do not fit into the file");
  }
  for (std::uint32_t k = 0; k < num_gaussians; ++k) {
    std::array<std::byte, kGaussianBytes> record{};
    file.read(record, place_name);
    ByteReader fields(record, place_name);
    builder.add(read_gaussian(fields));
  }
  builder.end();
}

}  // namespace

ModelSummary visit_gdf1(const std::filesystem::path& path, const CubeVisitor& visit) {
  InputFile file(path);
  ModelSummary summary;
  summary.header = read_header(file);
  CubeBuilder builder(place(summary.header, file), visit);
  const std::uint32_t num_cubes = summary.header.num_cubes;
  for (std::uint32_t i = 0; i < num_cubes; ++i) {
    read_cube(file, builder, "cube " + std::to_string(i + 1) + " of " + std::to_string(num_cubes));
  }
  // The ancestor's trainer counts cubes when it ends: a file of a killed one says 0.
  if (file.remaining() > 0) {
    throw_corrupt(file, std::to_string(file.remaining()) + " bytes after the last of " +
                            std::to_string(num_cubes) + " cubes");
  }
  summary.counts = builder.counts();
  return summary;
}

Gdf1Header read_gdf1_header(const std::filesystem::path& path) {
  InputFile file(path);
  Gdf1Header header = read_header(file);
  (void)place(header, file);
  return header;
}

}  // namespace gdfmap::gdf1
