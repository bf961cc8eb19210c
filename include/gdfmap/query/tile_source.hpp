#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/cube_mask.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/core/pool.hpp>
#include <gdfmap/gdf1/model.hpp>
#include <gdfmap/store/cube_store.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// What tells one state of a stored tile from another.
struct TileVersion {
  Digest surroundings, configuration, content;  ///< see TileState
  bool operator==(const TileVersion&) const = default;
};

/// Where a field's tiles come from. Every member is thread-safe.
class TileSource {
 public:
  explicit TileSource(const Geometry& geometry) : geometry_(geometry) {}
  virtual ~TileSource() = default;
  TileSource(const TileSource&) = delete;
  TileSource& operator=(const TileSource&) = delete;

  [[nodiscard]] const Geometry& geometry() const { return geometry_; }

  /// The tile's cubes; empty where nothing is stored. @throws Error kCorrupt or kIo.
  [[nodiscard]] virtual std::optional<TileRecord> load(const TileKey& key) = 0;
  /// Which state of the tile load() would give; empty where nothing is stored. The base class is a
  /// source that never changes. @throws Error kCorrupt or kIo.
  [[nodiscard]] virtual std::optional<TileVersion> version(const TileKey& key);
  /// Level-0 tiles that hold points, each once, in any order. @throws Error kCorrupt or kIo.
  [[nodiscard]] virtual std::vector<OccupiedTile> occupied() = 0;
  /// Whether there is any cube at all. @throws Error kCorrupt or kIo.
  [[nodiscard]] virtual bool has_cubes() = 0;

 private:
  Geometry geometry_;
};

/// Tiles of a cubes.db, read through as many connections as threads ask at the same time.
class StoreTileSource : public TileSource {
 public:
  /// @throws Error kCorrupt or kIo when the database cannot be read.
  StoreTileSource(const std::filesystem::path& path, const Geometry& geometry);

  [[nodiscard]] std::optional<TileRecord> load(const TileKey& key) override;
  [[nodiscard]] std::optional<TileVersion> version(const TileKey& key) override;
  [[nodiscard]] std::vector<OccupiedTile> occupied() override;
  [[nodiscard]] bool has_cubes() override;

 private:
  [[nodiscard]] Pool<CubeStore>::Lease connection();

  std::filesystem::path path_;
  db::OpenMode mode_;
  Pool<CubeStore> connections_;
};

/// Tiles in memory.
class MemoryTileSource : public TileSource {
 public:
  /// @throws Error kUsage when a tile is there twice.
  MemoryTileSource(const Geometry& geometry, std::vector<TileRecord> tiles,
                   std::vector<OccupiedTile> occupied);

  [[nodiscard]] std::optional<TileRecord> load(const TileKey& key) override;
  [[nodiscard]] std::vector<OccupiedTile> occupied() override;
  [[nodiscard]] bool has_cubes() override;

 private:
  std::unordered_map<TileKey, TileRecord, TileKeyHash> tiles_;
  std::vector<OccupiedTile> occupied_;
};

/// The cubes of a GDF1 model as tiles, in key order: fitted, of unknown class, with mean absolute
/// and root mean square error. @throws Error kUsage for a cube that is not of level 0 or is there
/// twice.
[[nodiscard]] std::vector<TileRecord> tiles_of_model(std::span<const Gdf1Cube> cubes);

/// Every cube of level-0 tiles as occupied: what is known of a model, since GDF1 does not say which
/// cubes hold points. A far bound is then the distance to the nearest cube of the model.
[[nodiscard]] std::vector<OccupiedTile> cubes_as_occupied(std::span<const TileRecord> tiles);

/// A model as a source of one level, with the header's cube size and margin.
[[nodiscard]] std::shared_ptr<TileSource> model_tile_source(const Model& model);

}  // namespace gdfmap
