#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// SplitMix64's finaliser (Steele, Lea, Flood 2014): the bits of number `counter` of a seed.
[[nodiscard]] std::uint64_t random_bits(std::uint64_t seed, std::uint64_t counter);

/// The cube of a level that holds a lattice point.
[[nodiscard]] CubeKey cube_at_level(const LatticePoint& p, int level);

/// The judged cubes of one tile.
struct JudgedTile {
  TileKey key;
  CubeMask cubes;
  CubeMask populated;    ///< as the trainer saw it; empty for imported cubes
  CubeMask outer_shell;  ///< lack one of their 26 neighbours
};

/// The judged cubes of one level. Immutable.
class JudgedLevel {
 public:
  /// @param tiles  of this level, each once, without the outer shell, which is worked out here
  JudgedLevel(int level, std::vector<JudgedTile> tiles);

  [[nodiscard]] int level() const { return level_; }
  [[nodiscard]] std::span<const JudgedTile> tiles() const { return tiles_; }
  [[nodiscard]] std::uint64_t num_cubes() const { return num_cubes_; }
  /// Cube n of [0, num_cubes()), in the order of tiles and of cubes in a tile.
  [[nodiscard]] CubeKey cube(std::uint64_t n) const;
  [[nodiscard]] bool holds(const CubeKey& cube) const;
  /// Null when the tile holds no judged cube.
  [[nodiscard]] const JudgedTile* find(const TileKey& key) const;

 private:
  void mark_outer_shell();

  int level_;
  std::vector<JudgedTile> tiles_;
  std::vector<std::uint64_t> first_cube_;  ///< of each tile, counted over all
  std::unordered_map<TileKey, std::size_t, TileKeyHash> by_key_;
  std::uint64_t num_cubes_ = 0;
};

/// The tile's cubes, without failed ones and, when `skip_poor`, without what an export leaves out.
[[nodiscard]] JudgedTile judged_tile(const TileRecord& record, bool skip_poor);

/// The space in which a field is judged, in regions that share no place: the cubes of each level
/// without those of finer ones, and what lies in none, in coarse cells around the occupied tiles.
/// Immutable.
class EvaluationDomain {
 public:
  /// @param levels    by ascending level; outlive this object
  /// @param occupied  level-0 tiles around which places in no cube are judged; may be empty
  EvaluationDomain(std::span<const JudgedLevel> levels, std::span<const OccupiedTile> occupied,
                   const Lattice& lattice);

  [[nodiscard]] std::size_t num_regions() const {
    return levels_.size() + (cells_.empty() ? 0 : 1);
  }
  /// kNoLevel for what lies in no cube.
  [[nodiscard]] int level(std::size_t region) const;
  /// The finest level that has a cube here, or kNoLevel.
  [[nodiscard]] int level_at(const LatticePoint& p) const;

  /// Cubic metres of the boxes that places of a region are drawn from.
  [[nodiscard]] double drawn_volume(std::size_t region) const;
  /// Place i of a region's random sequence, uniform in those boxes; empty when it belongs to
  /// another region.
  [[nodiscard]] std::optional<LatticePoint> draw(std::size_t region, std::uint64_t seed,
                                                 std::uint64_t i) const;

 private:
  std::span<const JudgedLevel> levels_;
  const Lattice& lattice_;
  std::int64_t cell_steps_;          ///< edge of a cell
  std::vector<LatticePoint> cells_;  ///< corners, sorted
};

}  // namespace gdfmap
