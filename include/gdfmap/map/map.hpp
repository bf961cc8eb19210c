#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <gdfmap/core/lattice.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/store/cube_store.hpp>
#include <gdfmap/tiling/point_store.hpp>

namespace gdfmap {

enum class Access {
  kRead,  ///< beside other readers and one writer; never changes a file
  kWrite  ///< alone: holds the map's lock until destroyed
};

/// A map: the directory NAME.gdfmap with points.db (what was ingested), cubes.db (what was trained)
/// and a lock file. cubes.db alone can be read and queried. Movable; not thread-safe.
class Map {
 public:
  /// Makes a new, empty map and opens it for writing.
  /// @throws Error kUsage when there already is a map or the geometry cannot be used, kIo.
  [[nodiscard]] static Map create(const std::filesystem::path& path, const Geometry& geometry = {});

  /// Makes a map of cubes that were trained elsewhere: it has no points, so that it can be queried
  /// and exported but neither ingested into nor trained.
  [[nodiscard]] static Map create_imported(const std::filesystem::path& path,
                                           const Geometry& geometry);

  /// @throws Error kIo when there is no map, it cannot be read, or another process writes to it
  ///         (kWrite; the message names the process and its host); kCorrupt when its two databases
  ///         are not of one map or of another version.
  [[nodiscard]] static Map open(const std::filesystem::path& path, Access access,
                                const RunContext& context = {});

  [[nodiscard]] static bool exists(const std::filesystem::path& path);

  Map(Map&&) noexcept;
  Map& operator=(Map&&) noexcept;
  ~Map();

  [[nodiscard]] const std::filesystem::path& path() const;
  [[nodiscard]] const std::string& id() const;  ///< 32 hexadecimal digits, shared by both databases
  [[nodiscard]] const Geometry& geometry() const;
  [[nodiscard]] const Lattice& lattice() const;
  [[nodiscard]] bool is_imported() const;
  [[nodiscard]] bool has_points() const;  ///< points.db is there

  /// This map's own connections, opened with its access.
  /// @throws Error kUsage from points() for an imported map, kIo when points.db is missing.
  [[nodiscard]] PointStore& points();
  [[nodiscard]] CubeStore& cubes();

  /// For connections of other threads.
  [[nodiscard]] std::filesystem::path cubes_path() const;

 private:
  struct Impl;
  explicit Map(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap
