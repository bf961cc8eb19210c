#include "quantized_cubes.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <vector>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/field/quantization.hpp>

namespace gdfmap {
namespace {

/// Edges, in metres, that a map can have at any level.
constexpr double kMinEdge = 1e-6, kMaxEdge = 1e9;
/// Between a weight scale's 9 bits, without their sign, and a float's bits.
constexpr int kScaleShift = 15;

[[noreturn]] void fail(const std::string& what) { throw Error(ErrorCode::kCorrupt, what); }

std::string name_of(const CubeRecord& cube) { return "cube " + std::to_string(cube.index); }

[[noreturn]] void fail_to_write(const CubeRecord& cube, const char* what) {
  throw Error(ErrorCode::kInternal, name_of(cube) + " " + what);
}

bool same_bits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

const GaussianGrid& grid_of(const CubeRecord& cube) {
  return gaussian_grid(cube.cube_class == CubeClass::kEmpty);
}

/// What is stored for each code of a mean and of a standard deviation, and how codes are packed.
class GaussianCode {
 public:
  GaussianCode(const GaussianGrid& grid, double edge) : grid_(grid), edge_(edge) {
    for (int code = 0; code <= grid.max_mean_code(); ++code) {
      means_.push_back(stored_mean(grid.mean_of_code(code), edge));
    }
    for (int code = 0; code <= grid.max_sigma_code(); ++code) {
      root_sigmas_.push_back(stored_root_sigma(grid.sigma_of_code(code), edge));
    }
  }

  [[nodiscard]] std::uint64_t encode(const Gaussians& gaussians, std::size_t k, float scale) const {
    std::uint64_t bits = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const double root_sigma = gaussians.at(kRootSigmaX + a, k);
      bits |= unsigned_code(grid_.mean_code(gaussians.at(kMeanX + a, k) / edge_)) << mean_shift(a);
      bits |= unsigned_code(grid_.sigma_code(root_sigma * root_sigma / edge_)) << sigma_shift(a);
    }
    const int weight = grid_.weight_code(gaussians.at(kWeight, k), scale);
    return bits | unsigned_code(weight + grid_.max_weight_code()) << weight_shift();
  }

  /// False when it is not what encode() gives.
  [[nodiscard]] bool decode(std::uint64_t bits, float scale, Gaussians& gaussians,
                            std::size_t k) const {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::uint64_t mean = bits >> mean_shift(a) & ((1u << grid_.mean_bits()) - 1);
      if (mean >= means_.size()) return false;
      gaussians.at(kMeanX + a, k) = means_[mean];
      gaussians.at(kRootSigmaX + a, k) =
          root_sigmas_[bits >> sigma_shift(a) & (root_sigmas_.size() - 1)];
    }
    const int weight = static_cast<int>(bits >> weight_shift()) - grid_.max_weight_code();
    gaussians.at(kWeight, k) = grid_.weight_of_code(weight, scale);
    return weight <= grid_.max_weight_code() && (scale > 0.0f || weight == 0);
  }

 private:
  static std::uint64_t unsigned_code(int code) { return static_cast<std::uint64_t>(code); }
  [[nodiscard]] std::size_t mean_shift(std::size_t axis) const {
    return axis * static_cast<std::size_t>(grid_.mean_bits());
  }
  [[nodiscard]] std::size_t sigma_shift(std::size_t axis) const {
    return mean_shift(3) + axis * static_cast<std::size_t>(grid_.sigma_bits());
  }
  [[nodiscard]] std::size_t weight_shift() const { return sigma_shift(3); }

  const GaussianGrid& grid_;
  double edge_;
  std::vector<float> means_, root_sigmas_;
};

/// The codes of both grids at one edge.
class GaussianCodes {
 public:
  explicit GaussianCodes(double edge)
      : fine_(GaussianGrid::fine(), edge), coarse_(GaussianGrid::coarse(), edge) {}
  [[nodiscard]] const GaussianCode& of(const GaussianGrid& grid) const {
    return &grid == &GaussianGrid::coarse() ? coarse_ : fine_;
  }

 private:
  GaussianCode fine_, coarse_;
};

/// @tparam Cube  CubeRecord, const or not
template <typename Cube>
auto lengths_of(Cube& cube) {
  return std::array{&cube.errors.mae, &cube.errors.rmse, &cube.errors.p95, &cube.errors.max,
                    &cube.reach};
}

void put_record(ByteWriter& writer, const CubeRecord& cube, const LengthGrid& grid) {
  if (cube.num_iterations > kMostQuantizedIterations || cube.gaussians.size() > 0xff) {
    fail_to_write(cube, "is too large for the quantised codec");
  }
  writer.put(static_cast<std::uint8_t>(static_cast<unsigned>(cube.status) |
                                       static_cast<unsigned>(cube.cube_class) << 2 |
                                       static_cast<unsigned>(cube.failure) << 4));
  writer.put(static_cast<std::uint8_t>(cube.num_iterations));
  writer.put(static_cast<std::uint8_t>(cube.gaussians.size()));
  for (const float* const length : lengths_of(cube)) {
    const std::uint8_t code = grid.nearest(*length);
    if (!same_bits(grid.of_code(code), *length)) fail_to_write(cube, "has an error off the grid");
    writer.put(code);
  }
  writer.put(static_cast<std::uint32_t>(cube.input));
  writer.put(static_cast<std::uint16_t>(cube.input >> 32));
  const float scale = grid_of(cube).weight_scale(cube.gaussians);
  writer.put(static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(scale) >> kScaleShift));
}

/// A cube with room for its Gaussians, and the scale of their weights.
struct CubeHead {
  CubeRecord cube;
  float scale = 0.0f;
};

CubeHead get_record(ByteReader& reader, int index, const LengthGrid& grid) {
  CubeHead head;
  CubeRecord& cube = head.cube;
  cube.index = index;
  const auto kind = reader.get<std::uint8_t>();
  const unsigned status = kind & 3u, of_class = kind >> 2 & 3u, failure = kind >> 4;
  if (status > 2 || of_class > 2 || failure > 1) {
    fail(name_of(cube) + ": kind " + std::to_string(kind) + " is not known");
  }
  cube.status = static_cast<CubeStatus>(status);
  cube.cube_class = static_cast<CubeClass>(of_class);
  cube.failure = static_cast<FailureReason>(failure);
  cube.num_iterations = reader.get<std::uint8_t>();
  cube.gaussians = Gaussians(reader.get<std::uint8_t>());
  for (float* const length : lengths_of(cube)) *length = grid.of_code(reader.get<std::uint8_t>());
  cube.input = reader.get<std::uint32_t>();
  cube.input |= std::uint64_t{reader.get<std::uint16_t>()} << 32;
  head.scale = std::bit_cast<float>(std::uint32_t{reader.get<std::uint16_t>()} << kScaleShift);
  return head;
}

void put_gaussians(ByteWriter& writer, const CubeRecord& cube, const GaussianCodes& codes) {
  const GaussianGrid& grid = grid_of(cube);
  const GaussianCode& code = codes.of(grid);
  const float scale = grid.weight_scale(cube.gaussians);
  Gaussians decoded(cube.gaussians.size());
  for (std::size_t k = 0; k < decoded.size(); ++k) {
    const std::uint64_t bits = code.encode(cube.gaussians, k, scale);
    static_cast<void>(code.decode(bits, scale, decoded, k));
    std::array<std::byte, sizeof(bits)> bytes;
    store(bytes.data(), bits);
    writer.put_bytes(std::span(bytes).first(grid.num_bytes()));
  }
  if (!(decoded == cube.gaussians)) fail_to_write(cube, "is not on the grid of its codec");
}

void get_gaussians(ByteReader& reader, CubeHead& head, const GaussianCodes& codes) {
  const GaussianGrid& grid = grid_of(head.cube);
  const GaussianCode& code = codes.of(grid);
  Gaussians& gaussians = head.cube.gaussians;
  for (std::size_t k = 0; k < gaussians.size(); ++k) {
    std::array<std::byte, sizeof(std::uint64_t)> bytes{};
    std::ranges::copy(reader.get_bytes(grid.num_bytes()), bytes.begin());
    if (!code.decode(load<std::uint64_t>(bytes.data()), head.scale, gaussians, k)) {
      fail(name_of(head.cube) + ": a mean or a weight is out of range");
    }
  }
  // Otherwise the same cube would be written in other bytes.
  if (!same_bits(grid.weight_scale(gaussians), head.scale)) {
    fail(name_of(head.cube) + ": the scale of its weights is not theirs");
  }
}

CubeMask get_mask(ByteReader& reader) {
  CubeMask mask;
  for (std::uint64_t& word : mask.words()) word = reader.get<std::uint64_t>();
  return mask;
}

}  // namespace

void put_quantized_cubes(ByteWriter& writer, const TileRecord& tile) {
  writer.put(tile.cube_edge);
  CubeMask mask;
  for (const CubeRecord& cube : tile.cubes) mask.set(cube.index);
  for (const std::uint64_t word : mask.words()) writer.put(word);
  const LengthGrid lengths(tile.cube_edge);
  for (const CubeRecord& cube : tile.cubes) put_record(writer, cube, lengths);
  const GaussianCodes codes(tile.cube_edge);
  for (const CubeRecord& cube : tile.cubes) put_gaussians(writer, cube, codes);
}

void get_quantized_cubes(ByteReader& reader, std::size_t num_cubes, std::size_t num_gaussians,
                         TileRecord& tile) {
  tile.cube_edge = reader.get<double>();
  if (!(tile.cube_edge >= kMinEdge && tile.cube_edge <= kMaxEdge)) {
    fail("the cubes' edge is out of range");
  }
  const CubeMask mask = get_mask(reader);
  if (static_cast<std::size_t>(mask.count()) != num_cubes) {
    fail("the mask does not hold " + std::to_string(num_cubes) + " cubes");
  }
  const LengthGrid lengths(tile.cube_edge);
  std::vector<CubeHead> heads;
  std::size_t num_found = 0, num_bytes = 0;
  for (int index = 0; index < kCubesPerTile; ++index) {
    if (!mask.test(index)) continue;
    const CubeHead& head = heads.emplace_back(get_record(reader, index, lengths));
    num_found += head.cube.gaussians.size();
    num_bytes += head.cube.gaussians.size() * grid_of(head.cube).num_bytes();
  }
  if (num_found != num_gaussians) fail("cubes do not add up to the number of Gaussians");
  if (reader.remaining() != num_bytes) {
    fail("size does not match " + std::to_string(num_cubes) + " cubes and " +
         std::to_string(num_gaussians) + " Gaussians");
  }
  const GaussianCodes codes(tile.cube_edge);
  for (CubeHead& head : heads) {
    get_gaussians(reader, head, codes);
    tile.cubes.push_back(std::move(head.cube));
  }
}

}  // namespace gdfmap
