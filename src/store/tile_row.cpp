#include "tile_row.hpp"

#include <algorithm>
#include <cmath>

#include <gdfmap/core/error.hpp>
#include <gdfmap/store/surroundings.hpp>
#include <gdfmap/store/tile_codec.hpp>

namespace gdfmap {
namespace {

constexpr std::size_t kMaskBytes = kCubesPerTile / 8;

std::int32_t checked(std::int64_t value, std::int64_t low, std::int64_t high,
                     const std::string& database_name) {
  if (value < low || value > high) {
    throw Error(ErrorCode::kCorrupt, database_name + ": a row of tiles holds " +
                                         std::to_string(value) + " where at most " +
                                         std::to_string(high) + " is possible");
  }
  return static_cast<std::int32_t>(value);
}

}  // namespace

std::int32_t read_coordinate(const db::Statement& row, int column,
                             const std::string& database_name) {
  return checked(row.integer(column), -kMaxTileCoordinate, kMaxTileCoordinate, database_name);
}

TileState read_state(const db::Statement& row, const std::string& database_name) {
  const auto coordinate = [&](int column) { return read_coordinate(row, column, database_name); };
  const auto count = [&](int column) {
    return checked(row.integer(column), 0, kCubesPerTile, database_name);
  };
  TileState state;
  const std::int32_t level = checked(row.integer(0), 0, kMaxLevels - 1, database_name);
  state.key = {level, coordinate(1), coordinate(2), coordinate(3)};
  state.surroundings = row.digest(4);
  state.configuration = row.digest(5);
  state.content = row.digest(6);
  state.served = decode_mask(row.blob(7), database_name + ": a row of tiles");
  state.num_cubes = count(8);
  state.num_populated = count(9);
  state.num_poor = count(10);
  state.num_failed = count(11);
  state.num_gaussians = row.integer(12);
  state.num_measured = count(13);
  state.mean_mae = row.real(14);
  state.max_mae = row.real(15);
  state.num_bytes = row.integer(16);
  return state;
}

EncodedTile read_tile(const db::Statement& row, const TileState& state) {
  constexpr int kChecksum = kNumStateColumns;
  constexpr int kSurroundings = kChecksum + 1;
  constexpr int kCubes = kChecksum + 2;
  if (row.is_null(kCubes)) throw Error(ErrorCode::kCorrupt, "has no cubes");
  const auto bytes = [&](int column) {
    const std::span<const std::byte> blob = row.blob(column);
    return Bytes(blob.begin(), blob.end());
  };
  return {state, static_cast<std::uint64_t>(row.integer(kChecksum)), bytes(kSurroundings),
          bytes(kCubes)};
}

TileRecord decode(const EncodedTile& tile) {
  const TileState& state = tile.state;
  if (hash64(tile.cubes) != tile.checksum || hash128(tile.surroundings) != state.surroundings) {
    throw Error(ErrorCode::kCorrupt, "checksum does not match");
  }
  TileRecord record = decode_tile(tile.cubes);
  record.key = state.key;
  record.configuration = state.configuration;
  record.surroundings = decode_surroundings(state.key, tile.surroundings);
  return record;
}

TileState summarize(const TileRecord& tile, std::size_t num_bytes) {
  TileState state;
  state.key = tile.key;
  state.configuration = tile.configuration;
  state.content = content_digest(tile);
  state.num_cubes = static_cast<int>(tile.cubes.size());
  state.num_bytes = static_cast<std::int64_t>(num_bytes);
  double sum = 0.0;
  for (const CubeRecord& cube : tile.cubes) {
    state.num_populated += cube.cube_class == CubeClass::kPopulated;
    state.num_poor += cube.status == CubeStatus::kPoor;
    state.num_failed += cube.status == CubeStatus::kFailed;
    state.num_gaussians += static_cast<std::int64_t>(cube.gaussians.size());
    if (cube.gaussians.size() > 0) state.served.set(cube.index);
    if (cube.status == CubeStatus::kFailed || !std::isfinite(cube.errors.mae)) continue;
    ++state.num_measured;
    sum += cube.errors.mae;
    state.max_mae = std::max(state.max_mae, double{cube.errors.mae});
  }
  if (state.num_measured > 0) state.mean_mae = sum / state.num_measured;
  return state;
}

Bytes encode_mask(const CubeMask& mask) {
  ByteWriter writer;
  for (const std::uint64_t word : mask.words()) writer.put(word);
  return writer.take();
}

CubeMask decode_mask(std::span<const std::byte> bytes, const std::string& place) {
  if (bytes.size() != kMaskBytes) {
    throw Error(ErrorCode::kCorrupt, place + ": mask of cubes is not 64 bytes");
  }
  ByteReader reader(bytes, place);
  CubeMask mask;
  for (std::uint64_t& word : mask.words()) word = reader.get<std::uint64_t>();
  return mask;
}

std::string tile_name(const TileKey& key) {
  return "tile " + std::to_string(key.level) + "," + std::to_string(key.x) + "," +
         std::to_string(key.y) + "," + std::to_string(key.z);
}

}  // namespace gdfmap
