#include <charconv>
#include <cmath>
#include <random>
#include <system_error>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/failpoint.hpp>
#include <gdfmap/map/map.hpp>

#include "file_lock.hpp"

namespace gdfmap {
namespace {

constexpr const char* kPointsFile = "points.db";
constexpr const char* kCubesFile = "cubes.db";
constexpr const char* kLockFile = "lock";
constexpr const char* kOriginTrained = "trained";
constexpr const char* kOriginImported = "imported";

std::string number_text(double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof(text), value);
  return {text, end};
}

double parse_number(const std::string& text, const std::string& what) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
    throw Error(ErrorCode::kCorrupt, what + " is not a number: " + text);
  }
  return value;
}

std::string new_map_id() {
  std::random_device device;
  const auto word = [&] { return std::uint64_t{device()} << 32 | device(); };
  return Digest{word(), word()}.hex();
}

/// Identity and geometry, as both databases carry them.
struct Identity {
  std::string id;
  std::string origin;
  Geometry geometry;
  bool operator==(const Identity&) const = default;
};

template <typename Store>
void write_identity(Store& store, const Identity& identity) {
  store.set_meta("cube_size", number_text(identity.geometry.cube_size));
  store.set_meta("margin", number_text(identity.geometry.margin));
  store.set_meta("num_levels", std::to_string(identity.geometry.num_levels));
  store.set_meta("origin", identity.origin);
  store.set_meta("map_id", identity.id);
}

template <typename Store>
std::optional<Identity> read_identity(Store& store, const std::filesystem::path& file) {
  const auto id = store.meta("map_id");
  if (!id) return std::nullopt;
  const auto value = [&](const char* key) {
    const auto text = store.meta(key);
    if (!text) throw Error(ErrorCode::kCorrupt, file.string() + ": meta has no " + key);
    return *text;
  };
  const auto number = [&](const char* key) {
    return parse_number(value(key), file.string() + ": " + key);
  };
  Identity identity{
      *id,
      value("origin"),
      {number("cube_size"), number("margin"), static_cast<int>(number("num_levels"))}};
  const Geometry& g = identity.geometry;
  if (g.cube_size <= 0.0 || g.margin <= 0.0 || g.margin > g.cube_size / 2 || g.num_levels < 1 ||
      g.num_levels > kMaxLevels) {
    throw Error(ErrorCode::kCorrupt, file.string() + ": impossible geometry");
  }
  return identity;
}

void check_geometry(const Geometry& geometry) {
  // A step must be far coarser than what a double resolves at the lattice's far end.
  if (!std::isfinite(geometry.cube_size) || geometry.cube_size < 1e-3 || geometry.cube_size > 1e4) {
    throw Error(ErrorCode::kUsage, "cube_size must be between 0.001 and 10000 metres, not " +
                                       number_text(geometry.cube_size));
  }
  if (!(geometry.margin > 0.0 && geometry.margin <= geometry.cube_size / 2)) {
    throw Error(ErrorCode::kUsage, "margin must be positive and at most half of cube_size, not " +
                                       number_text(geometry.margin));
  }
  if (geometry.num_levels < 1 || geometry.num_levels > kMaxLevels) {
    throw Error(ErrorCode::kUsage, "num_levels must be between 1 and 3");
  }
}

/// A writer's page cache takes an eighth of the budget, split over both databases.
std::size_t cache_bytes(const RunContext& context) { return context.memory() / 16; }

}  // namespace

struct Map::Impl {
  /// @param lock  of a writer; null for a reader
  static std::unique_ptr<Impl> open(const std::filesystem::path& path,
                                    std::unique_ptr<FileLock> lock, const RunContext& context);

  std::filesystem::path path;
  std::size_t store_cache_bytes = 0;
  std::unique_ptr<FileLock> lock;  // first in, last out: the stores close before it is released
  std::unique_ptr<PointStore> points;
  std::unique_ptr<CubeStore> cubes;
  Identity identity;
  std::unique_ptr<Lattice> lattice;

  [[nodiscard]] std::filesystem::path file(const char* name) const { return path / name; }

 private:
  [[nodiscard]] db::OpenMode mode(const char* name, db::OpenMode writing) const {
    return lock ? writing : db::reading_mode(file(name));
  }
  /// Empty when the file is not there.
  std::optional<Identity> open_points();
  std::optional<Identity> open_cubes(const std::optional<Identity>& of_points);
};

std::optional<Identity> Map::Impl::open_points() {
  const std::filesystem::path place = file(kPointsFile);
  if (!std::filesystem::exists(place)) return std::nullopt;
  points = std::make_unique<PointStore>(place, mode(kPointsFile, db::OpenMode::kWrite),
                                        store_cache_bytes);
  auto stated = read_identity(*points, place);
  if (!stated) throw Error(ErrorCode::kCorrupt, place.string() + " has no map identity");
  return stated;
}

/// A writer makes a lost cubes.db anew: training fills it again from the points.
std::optional<Identity> Map::Impl::open_cubes(const std::optional<Identity>& of_points) {
  const std::filesystem::path place = file(kCubesFile);
  const bool can_be_made = lock != nullptr && of_points.has_value();
  if (!std::filesystem::exists(place) && !can_be_made) return std::nullopt;
  const db::OpenMode writing = can_be_made ? db::OpenMode::kCreate : db::OpenMode::kWrite;
  cubes = std::make_unique<CubeStore>(place, mode(kCubesFile, writing), store_cache_bytes);
  const auto stated = read_identity(*cubes, place);
  if (stated || !can_be_made) return stated;
  write_identity(*cubes, *of_points);
  return of_points;
}

namespace {

void write_new_databases(const std::filesystem::path& directory, const Identity& identity) {
  CubeStore cubes(directory / kCubesFile, db::OpenMode::kCreate);
  write_identity(cubes, identity);
  if (identity.origin == kOriginTrained) {
    PointStore points(directory / kPointsFile, db::OpenMode::kCreate);
    write_identity(points, identity);
  }
}

/// The directory in which a new map is made, beside its place. It goes, with all that is in it,
/// unless it was renamed. Its lock file is the map's own to be: whoever makes a map of this name
/// holds it, and what a killed process left is taken over.
class MapInTheMaking {
 public:
  explicit MapInTheMaking(std::filesystem::path path) : path_(std::move(path)) {
    std::filesystem::create_directories(path_);
    try {
      lock_ = std::make_unique<FileLock>(path_ / kLockFile);
    } catch (const Error&) {
      std::error_code ignored;
      std::filesystem::remove(path_, ignored);  // only if nobody has anything in it
      throw;
    }
    remove_databases();
  }
  ~MapInTheMaking() {
    if (!lock_) return;
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  MapInTheMaking(const MapInTheMaking&) = delete;
  MapInTheMaking& operator=(const MapInTheMaking&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Gives it its place; the lock goes with it.
  [[nodiscard]] std::unique_ptr<FileLock> rename_to(const std::filesystem::path& place) {
    std::filesystem::rename(path_, place);
    return std::move(lock_);
  }

 private:
  void remove_databases() const {
    std::vector<std::filesystem::path> left;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      if (entry.path().filename() != kLockFile) left.push_back(entry.path());
    }
    for (const auto& file : left) std::filesystem::remove(file);
  }

  std::filesystem::path path_;
  std::unique_ptr<FileLock> lock_;
};

/// Writes a new map beside its place and renames it there, so that no half-made map is ever seen.
/// Returns the map's lock.
std::unique_ptr<FileLock> make_map(const std::filesystem::path& path, const Identity& identity) {
  check_geometry(identity.geometry);
  const auto refuse_another = [&] {
    if (Map::exists(path)) throw Error(ErrorCode::kUsage, path.string() + " already is a map");
  };
  refuse_another();
  // "a/b.gdfmap/" names the same directory as "a/b.gdfmap", which the new one stands beside.
  const std::filesystem::path place = path.has_filename() ? path : path.parent_path();
  try {
    MapInTheMaking map(place.string() + ".new");
    refuse_another();  // it may have been made while this waited for the directory
    write_new_databases(map.path(), identity);
    failpoint("map.before_rename");
    return map.rename_to(place);
  } catch (const std::filesystem::filesystem_error& error) {
    throw Error(ErrorCode::kIo, "cannot create " + path.string() + ": " + error.code().message());
  }
}

}  // namespace

Map::Map(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Map::Map(Map&&) noexcept = default;
Map& Map::operator=(Map&&) noexcept = default;
Map::~Map() = default;

bool Map::exists(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::exists(path / kPointsFile, ignored) ||
         std::filesystem::exists(path / kCubesFile, ignored);
}

Map Map::create(const std::filesystem::path& path, const Geometry& geometry) {
  auto lock = make_map(path, {new_map_id(), kOriginTrained, geometry});
  return Map(Impl::open(path, std::move(lock), {}));
}

Map Map::create_imported(const std::filesystem::path& path, const Geometry& geometry) {
  auto lock = make_map(path, {new_map_id(), kOriginImported, geometry});
  return Map(Impl::open(path, std::move(lock), {}));
}

Map Map::open(const std::filesystem::path& path, Access access, const RunContext& context) {
  if (!exists(path)) {
    throw Error(ErrorCode::kIo,
                path.string() + " is not a map: no such directory with points.db or cubes.db");
  }
  auto lock = access == Access::kWrite ? std::make_unique<FileLock>(path / kLockFile) : nullptr;
  return Map(Impl::open(path, std::move(lock), context));
}

std::unique_ptr<Map::Impl> Map::Impl::open(const std::filesystem::path& path,
                                           std::unique_ptr<FileLock> lock,
                                           const RunContext& context) {
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->store_cache_bytes = cache_bytes(context);
  impl->lock = std::move(lock);
  const auto of_points = impl->open_points();
  const auto of_cubes = impl->open_cubes(of_points);
  if (!of_cubes) {
    throw Error(ErrorCode::kCorrupt, path.string() +
                                         ": cubes.db is missing; `gdfmap train` makes "
                                         "it anew from the points");
  }
  if (of_points && of_points->id != of_cubes->id) {
    throw Error(ErrorCode::kCorrupt,
                path.string() + ": points.db and cubes.db belong to different maps");
  }
  if (of_points && *of_points != *of_cubes) {
    throw Error(ErrorCode::kCorrupt,
                path.string() + ": points.db and cubes.db state different geometries");
  }
  impl->identity = *of_cubes;
  impl->lattice = std::make_unique<Lattice>(of_cubes->geometry.cube_size);
  return impl;
}

const std::filesystem::path& Map::path() const { return impl_->path; }
const std::string& Map::id() const { return impl_->identity.id; }
const Geometry& Map::geometry() const { return impl_->identity.geometry; }
const Lattice& Map::lattice() const { return *impl_->lattice; }
bool Map::is_imported() const { return impl_->identity.origin == kOriginImported; }
bool Map::has_points() const { return impl_->points != nullptr; }

PointStore& Map::points() {
  if (is_imported()) {
    throw Error(ErrorCode::kUsage, impl_->path.string() +
                                       " was imported: it has cubes but no points, and can be "
                                       "neither ingested into nor trained");
  }
  if (!impl_->points) {
    throw Error(ErrorCode::kIo, impl_->file(kPointsFile).string() +
                                    " is missing: this map can be "
                                    "queried but not changed");
  }
  return *impl_->points;
}

CubeStore& Map::cubes() { return *impl_->cubes; }

std::filesystem::path Map::cubes_path() const { return impl_->file(kCubesFile); }

}  // namespace gdfmap
