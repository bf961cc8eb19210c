#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/store/tile_codec.hpp>

#include "quantized_cubes.hpp"

namespace gdfmap {
namespace {

constexpr char kMagic[4] = {'G', 'D', 'T', '1'};
constexpr std::uint16_t kVersion = 2;
constexpr std::size_t kCubeBytes = 41;
constexpr std::size_t kGaussianBytes = kNumGaussianRows * sizeof(float);

/// Whether all values of a row are finite and, in the rows of root sigmas, not too small. Without
/// branches, so that several values are compared at once.
bool is_usable(std::size_t row, std::span<const float> values) {
  const bool is_root_sigma = row >= kRootSigmaX && row < kWeight;
  const float least = is_root_sigma ? kMinRootSigma : 0.0f;
  constexpr float kMost = std::numeric_limits<float>::max();
  int num_usable = 0;
  for (const float value : values) {
    const float magnitude = std::fabs(value);  // NaN fails both comparisons
    num_usable += static_cast<int>(magnitude >= least) & static_cast<int>(magnitude <= kMost);
  }
  return num_usable == static_cast<int>(values.size());
}

/// What is wrong with a cube, or null: the rules that writer and reader share.
const char* fault_of(const CubeRecord& cube, int previous_index) {
  if (cube.index <= previous_index) return "index is not above the one before";
  if (cube.index >= kCubesPerTile) return "index is out of range";
  if (cube.num_iterations < 0) return "number of iterations is out of range";
  if (cube.input > kMaxInputDigest) return "input digest has more than 48 bits";
  const bool failed = cube.status == CubeStatus::kFailed;
  if (failed != (cube.gaussians.size() == 0)) return "status contradicts the number of Gaussians";
  if (failed != (cube.failure != FailureReason::kNone)) return "status contradicts the failure";
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    if (!is_usable(row, cube.gaussians.row(row))) return "a parameter of a Gaussian cannot be used";
  }
  return nullptr;
}

void check_cubes(const std::vector<CubeRecord>& cubes, ErrorCode code) {
  int previous_index = -1;
  for (const CubeRecord& cube : cubes) {
    if (const char* const fault = fault_of(cube, previous_index)) {
      throw Error(code, "cube " + std::to_string(cube.index) + ": " + fault);
    }
    previous_index = cube.index;
  }
}

std::uint32_t count_gaussians(const std::vector<CubeRecord>& cubes) {
  std::size_t total = 0;
  for (const CubeRecord& cube : cubes) total += cube.gaussians.size();
  if (total > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::kInternal, "a tile holds " + std::to_string(total) + " Gaussians");
  }
  return static_cast<std::uint32_t>(total);
}

void put_errors(ByteWriter& writer, const CubeErrors& errors) {
  writer.put(errors.mae);
  writer.put(errors.rmse);
  writer.put(errors.p95);
  writer.put(errors.max);
}

void put_row(ByteWriter& writer, std::span<const float> row) {
  if constexpr (std::endian::native == std::endian::little) {
    writer.put_bytes(std::as_bytes(row));
  } else {
    for (const float value : row) writer.put(value);
  }
}

void get_row(ByteReader& reader, std::span<float> row) {
  const std::span<const std::byte> bytes = reader.get_bytes(row.size_bytes());
  if constexpr (std::endian::native == std::endian::little) {
    if (!row.empty()) std::memcpy(row.data(), bytes.data(), bytes.size());
  } else {
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = load<float>(&bytes[i * sizeof(float)]);
  }
}

void put_cube(ByteWriter& writer, const CubeRecord& cube) {
  writer.put(static_cast<std::uint16_t>(cube.index));
  writer.put(static_cast<std::uint8_t>(cube.status));
  writer.put(static_cast<std::uint8_t>(cube.cube_class));
  writer.put(static_cast<std::uint8_t>(cube.failure));
  writer.put(static_cast<std::uint32_t>(cube.num_iterations));
  writer.put(static_cast<std::uint32_t>(cube.gaussians.size()));
  put_errors(writer, cube.errors);
  writer.put(cube.reach);
  writer.put(cube.input);
}

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorCode::kCorrupt, what); }

[[noreturn]] void fail_size(std::size_t num_cubes, std::size_t num_gaussians) {
  fail("size does not match " + std::to_string(num_cubes) + " cubes and " +
       std::to_string(num_gaussians) + " Gaussians");
}

template <typename Enum>
Enum get_enum(ByteReader& reader, Enum last, const char* name) {
  const auto value = reader.get<std::uint8_t>();
  if (value > static_cast<std::uint8_t>(last)) {
    fail(std::string(name) + " " + std::to_string(value) + " is not known");
  }
  return static_cast<Enum>(value);
}

/// A cube without its Gaussians, and how many it has.
struct CubeHead {
  CubeRecord cube;
  std::uint32_t num_gaussians = 0;
};

CubeHead get_cube(ByteReader& reader) {
  CubeHead head;
  CubeRecord& cube = head.cube;
  cube.index = reader.get<std::uint16_t>();
  cube.status = get_enum(reader, CubeStatus::kFailed, "status");
  cube.cube_class = get_enum(reader, CubeClass::kUnknown, "class");
  cube.failure = get_enum(reader, FailureReason::kNotFinite, "failure");
  const auto iterations = reader.get<std::uint32_t>();
  if (iterations > std::numeric_limits<std::int32_t>::max()) {
    fail("cube " + std::to_string(cube.index) + ": number of iterations is out of range");
  }
  cube.num_iterations = static_cast<int>(iterations);
  head.num_gaussians = reader.get<std::uint32_t>();
  cube.errors.mae = reader.get<float>();
  cube.errors.rmse = reader.get<float>();
  cube.errors.p95 = reader.get<float>();
  cube.errors.max = reader.get<float>();
  cube.reach = reader.get<float>();
  cube.input = reader.get<std::uint64_t>();
  return head;
}

struct TileHead {
  CubeCodec codec = CubeCodec::kFloat32;
  std::size_t num_cubes = 0;
  std::size_t num_gaussians = 0;
};

TileHead get_header(ByteReader& reader) {
  const auto magic = reader.get_bytes(sizeof(kMagic));
  if (std::memcmp(magic.data(), kMagic, sizeof(kMagic)) != 0) fail("not a tile");
  const auto version = reader.get<std::uint16_t>();
  if (version != kVersion) {
    fail("tile format version " + std::to_string(version) + ", this build reads version " +
         std::to_string(kVersion));
  }
  const auto codec = reader.get<std::uint16_t>();
  if (codec > static_cast<std::uint16_t>(CubeCodec::kQuantized)) {
    fail("tile codec " + std::to_string(codec) + " is not known");
  }
  TileHead head;
  head.codec = static_cast<CubeCodec>(codec);
  head.num_cubes = reader.get<std::uint16_t>();
  head.num_gaussians = reader.get<std::uint32_t>();
  if (head.num_cubes > kCubesPerTile) fail(std::to_string(head.num_cubes) + " cubes in a tile");
  return head;
}

/// Whether the counts match the size is checked first, so that nothing is allocated for a count
/// that cannot be true.
std::vector<CubeRecord> get_float_cubes(ByteReader& reader, const TileHead& tile) {
  if (reader.remaining() != tile.num_cubes * kCubeBytes + tile.num_gaussians * kGaussianBytes) {
    fail_size(tile.num_cubes, tile.num_gaussians);
  }
  std::vector<CubeRecord> cubes;
  std::vector<std::uint32_t> counts;
  for (std::size_t i = 0; i < tile.num_cubes; ++i) {
    CubeHead head = get_cube(reader);
    cubes.push_back(std::move(head.cube));
    counts.push_back(head.num_gaussians);
  }
  if (std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}) != tile.num_gaussians) {
    fail("cubes do not add up to the number of Gaussians");
  }
  for (std::size_t i = 0; i < cubes.size(); ++i) cubes[i].gaussians = Gaussians(counts[i]);
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    for (CubeRecord& cube : cubes) get_row(reader, cube.gaussians.row(row));
  }
  return cubes;
}

void put_float_cubes(ByteWriter& writer, const TileRecord& tile) {
  for (const CubeRecord& cube : tile.cubes) put_cube(writer, cube);
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    for (const CubeRecord& cube : tile.cubes) put_row(writer, cube.gaussians.row(row));
  }
}

}  // namespace

Bytes encode_tile(const TileRecord& tile) {
  check_cubes(tile.cubes, ErrorCode::kInternal);
  ByteWriter writer;
  writer.put_bytes(std::as_bytes(std::span(kMagic)));
  writer.put(kVersion);
  writer.put(static_cast<std::uint16_t>(tile.codec));
  writer.put(static_cast<std::uint16_t>(tile.cubes.size()));
  writer.put(count_gaussians(tile.cubes));
  if (tile.codec == CubeCodec::kQuantized) {
    put_quantized_cubes(writer, tile);
  } else {
    put_float_cubes(writer, tile);
  }
  return writer.take();
}

TileRecord decode_tile(std::span<const std::byte> bytes) {
  ByteReader reader(bytes, "tile");
  const TileHead head = get_header(reader);
  TileRecord tile;
  tile.codec = head.codec;
  if (head.codec == CubeCodec::kQuantized) {
    get_quantized_cubes(reader, head.num_cubes, head.num_gaussians, tile);
  } else {
    tile.cubes = get_float_cubes(reader, head);
  }
  check_cubes(tile.cubes, ErrorCode::kCorrupt);
  return tile;
}

Digest content_digest(const TileRecord& tile) {
  ByteWriter writer;
  writer.put(tile.key.level);
  writer.put(tile.key.x);
  writer.put(tile.key.y);
  writer.put(tile.key.z);
  for (const CubeRecord& cube : tile.cubes) {
    writer.put(static_cast<std::uint16_t>(cube.index));
    writer.put(static_cast<std::uint8_t>(cube.status));
    put_errors(writer, cube.errors);
    writer.put(static_cast<std::uint32_t>(cube.gaussians.size()));
    for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
      put_row(writer, cube.gaussians.row(row));
    }
  }
  return hash128(writer.bytes());
}

}  // namespace gdfmap
