#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/store/tile_codec.hpp>

namespace gdfmap {
namespace {

constexpr char kMagic[4] = {'G', 'D', 'T', '1'};
constexpr std::uint16_t kVersion = 1;
constexpr std::size_t kCubeBytes = 49;
constexpr std::size_t kShortCubeBytes = 36;
/// Edges, in metres, that a map can have at any level.
constexpr double kMinEdge = 1e-6, kMaxEdge = 1e9;
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
  float largest_weight = 0.0f;  ///< quantised cubes alone
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
  cube.input = reader.get_digest();
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

/// Checks the counts against the size, so that nothing is allocated for a count that cannot be
/// true.
void check_size(const ByteReader& reader, const TileHead& head, std::size_t cube_bytes,
                std::size_t gaussian_bytes) {
  if (reader.remaining() != head.num_cubes * cube_bytes + head.num_gaussians * gaussian_bytes) {
    fail("size does not match " + std::to_string(head.num_cubes) + " cubes and " +
         std::to_string(head.num_gaussians) + " Gaussians");
  }
}

/// The heads of all cubes, each read by get_one(reader), with room for their Gaussians.
template <typename GetOne>
std::vector<CubeHead> get_heads(ByteReader& reader, const TileHead& tile, const GetOne& get_one) {
  std::vector<CubeHead> heads;
  heads.reserve(tile.num_cubes);
  std::uint64_t num_gaussians = 0;
  for (std::size_t i = 0; i < tile.num_cubes; ++i) {
    heads.push_back(get_one(reader));
    num_gaussians += heads.back().num_gaussians;
  }
  if (num_gaussians != tile.num_gaussians) fail("cubes do not add up to the number of Gaussians");
  for (CubeHead& head : heads) head.cube.gaussians = Gaussians(head.num_gaussians);
  return heads;
}

std::vector<CubeRecord> cubes_of(std::vector<CubeHead> heads) {
  std::vector<CubeRecord> cubes;
  cubes.reserve(heads.size());
  for (CubeHead& head : heads) cubes.push_back(std::move(head.cube));
  return cubes;
}

void get_rows(ByteReader& reader, std::vector<CubeRecord>& cubes) {
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    for (CubeRecord& cube : cubes) {
      get_row(reader, cube.gaussians.row(row));
    }
  }
}

void put_float_cubes(ByteWriter& writer, const TileRecord& tile) {
  for (const CubeRecord& cube : tile.cubes) put_cube(writer, cube);
  for (std::size_t row = 0; row < kNumGaussianRows; ++row) {
    for (const CubeRecord& cube : tile.cubes) put_row(writer, cube.gaussians.row(row));
  }
}

std::vector<CubeRecord> get_float_cubes(ByteReader& reader, const TileHead& head) {
  check_size(reader, head, kCubeBytes, kGaussianBytes);
  std::vector<CubeRecord> cubes = cubes_of(get_heads(reader, head, get_cube));
  get_rows(reader, cubes);
  return cubes;
}

/// Errors and reach of a quantised cube: the upper half of the float's bits.
std::uint16_t short_float(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  if ((bits & 0xffffu) != 0) {
    throw Error(ErrorCode::kInternal, "an error of a quantised cube has more than 8 bits");
  }
  return static_cast<std::uint16_t>(bits >> 16);
}

float get_short_float(ByteReader& reader) {
  return std::bit_cast<float>(std::uint32_t{reader.get<std::uint16_t>()} << 16);
}

/// What is stored for each code of a mean and of a standard deviation, at one edge.
class ShapeTable {
 public:
  explicit ShapeTable(double edge) {
    for (int code = 0; code <= kMaxMeanCode; ++code) {
      means_[static_cast<std::size_t>(code)] = stored_mean(mean_of_code(code), edge);
    }
    for (int code = 0; code <= kMaxSigmaCode; ++code) {
      root_sigmas_[static_cast<std::size_t>(code)] = stored_root_sigma(sigma_of_code(code), edge);
    }
  }
  [[nodiscard]] float mean(std::uint64_t code) const { return means_[code & kMaxMeanCode]; }
  [[nodiscard]] float root_sigma(std::uint64_t code) const {
    return root_sigmas_[code & kMaxSigmaCode];
  }

 private:
  std::array<float, kMaxMeanCode + 1> means_;
  std::array<float, kMaxSigmaCode + 1> root_sigmas_;
};

std::uint64_t code_of(const Gaussians& gaussians, std::size_t k, double edge, float largest) {
  std::uint64_t code = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double root_sigma = gaussians.at(kRootSigmaX + a, k);
    const auto mean = static_cast<std::uint64_t>(mean_code(gaussians.at(kMeanX + a, k) / edge));
    const auto sigma = static_cast<std::uint64_t>(sigma_code(root_sigma * root_sigma / edge));
    code |= mean << (9 * a) | sigma << (27 + 8 * a);
  }
  const int weight = weight_code(gaussians.at(kWeight, k), largest);
  return code | static_cast<std::uint64_t>(weight + kMaxWeightCode) << 51;
}

void decode_gaussian(std::uint64_t code, const ShapeTable& shapes, float largest,
                     Gaussians& gaussians, std::size_t k) {
  for (std::size_t a = 0; a < 3; ++a) {
    gaussians.at(kMeanX + a, k) = shapes.mean(code >> (9 * a));
    gaussians.at(kRootSigmaX + a, k) = shapes.root_sigma(code >> (27 + 8 * a));
  }
  const int weight = static_cast<int>(code >> 51) - kMaxWeightCode;
  if (weight > kMaxWeightCode || (largest == 0.0f && weight != 0)) {
    fail("a weight of a quantised Gaussian is out of range");
  }
  gaussians.at(kWeight, k) = weight_of_code(weight, largest);
}

void put_short_cube(ByteWriter& writer, const CubeRecord& cube) {
  if (cube.num_iterations > 0xffff || cube.gaussians.size() > 0xff) {
    throw Error(ErrorCode::kInternal,
                "cube " + std::to_string(cube.index) + " is too large for the quantised codec");
  }
  writer.put(static_cast<std::uint16_t>(cube.index));
  writer.put(static_cast<std::uint8_t>(static_cast<unsigned>(cube.status) |
                                       static_cast<unsigned>(cube.cube_class) << 2 |
                                       static_cast<unsigned>(cube.failure) << 4));
  writer.put(static_cast<std::uint16_t>(cube.num_iterations));
  writer.put(static_cast<std::uint8_t>(cube.gaussians.size()));
  for (const float error :
       {cube.errors.mae, cube.errors.rmse, cube.errors.p95, cube.errors.max, cube.reach}) {
    writer.put(short_float(error));
  }
  writer.put(cube.input);
  writer.put(largest_weight(cube.gaussians));
}

void put_short_cubes(ByteWriter& writer, const TileRecord& tile) {
  writer.put(tile.cube_edge);
  for (const CubeRecord& cube : tile.cubes) put_short_cube(writer, cube);
  const ShapeTable shapes(tile.cube_edge);
  for (const CubeRecord& cube : tile.cubes) {
    const float largest = largest_weight(cube.gaussians);
    Gaussians decoded(cube.gaussians.size());
    for (std::size_t k = 0; k < decoded.size(); ++k) {
      const std::uint64_t code = code_of(cube.gaussians, k, tile.cube_edge, largest);
      decode_gaussian(code, shapes, largest, decoded, k);
      writer.put(code);
    }
    if (!(decoded == cube.gaussians)) {
      throw Error(ErrorCode::kInternal,
                  "cube " + std::to_string(cube.index) + " is not on the grid of its codec");
    }
  }
}

CubeHead get_short_cube(ByteReader& reader) {
  CubeHead head;
  CubeRecord& cube = head.cube;
  cube.index = reader.get<std::uint16_t>();
  const auto kind = reader.get<std::uint8_t>();
  const unsigned status = kind & 3u, of_class = kind >> 2 & 3u, failure = kind >> 4;
  if (status > 2 || of_class > 2 || failure > 1) {
    fail("cube " + std::to_string(cube.index) + ": kind " + std::to_string(kind) + " is not known");
  }
  cube.status = static_cast<CubeStatus>(status);
  cube.cube_class = static_cast<CubeClass>(of_class);
  cube.failure = static_cast<FailureReason>(failure);
  cube.num_iterations = reader.get<std::uint16_t>();
  head.num_gaussians = reader.get<std::uint8_t>();
  for (float* const error :
       {&cube.errors.mae, &cube.errors.rmse, &cube.errors.p95, &cube.errors.max, &cube.reach}) {
    *error = get_short_float(reader);
  }
  cube.input = reader.get_digest();
  head.largest_weight = reader.get<float>();
  return head;
}

std::vector<CubeRecord> get_short_cubes(ByteReader& reader, const TileHead& head, double edge) {
  check_size(reader, head, kShortCubeBytes, sizeof(std::uint64_t));
  std::vector<CubeHead> heads = get_heads(reader, head, get_short_cube);
  const ShapeTable shapes(edge);
  for (CubeHead& h : heads) {
    Gaussians& gaussians = h.cube.gaussians;
    for (std::size_t k = 0; k < gaussians.size(); ++k) {
      decode_gaussian(reader.get<std::uint64_t>(), shapes, h.largest_weight, gaussians, k);
    }
    // Otherwise the same cube would be written in other bytes.
    if (std::bit_cast<std::uint32_t>(largest_weight(gaussians)) !=
        std::bit_cast<std::uint32_t>(h.largest_weight)) {
      fail("cube " + std::to_string(h.cube.index) + ": largest weight is not that of a Gaussian");
    }
  }
  return cubes_of(std::move(heads));
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
    put_short_cubes(writer, tile);
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
    tile.cube_edge = reader.get<double>();
    if (!(tile.cube_edge >= kMinEdge && tile.cube_edge <= kMaxEdge)) {
      fail("the cubes' edge is out of range");
    }
    tile.cubes = get_short_cubes(reader, head, tile.cube_edge);
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
