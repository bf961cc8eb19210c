#include <charconv>
#include <cmath>
#include <random>
#include <system_error>

#include <unistd.h>

#include <gdfmap/core/error.hpp>
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
  std::filesystem::path path;
  Access access;
  std::size_t store_cache_bytes;
  std::unique_ptr<FileLock> lock;  // first in, last out: the stores close before it is released
  std::unique_ptr<PointStore> points;
  std::unique_ptr<CubeStore> cubes;
  Identity identity;
  std::unique_ptr<Lattice> lattice;

  [[nodiscard]] std::filesystem::path file(const char* name) const { return path / name; }

  void set_identity(Identity value) {
    identity = std::move(value);
    lattice = std::make_unique<Lattice>(identity.geometry.cube_size);
  }
  void open_points(db::OpenMode mode) {
    points = std::make_unique<PointStore>(file(kPointsFile), mode, store_cache_bytes);
  }
  void open_cubes(db::OpenMode mode) {
    cubes = std::make_unique<CubeStore>(file(kCubesFile), mode, store_cache_bytes);
  }
};

namespace {

void write_new_databases(const std::filesystem::path& directory, const Identity& identity) {
  CubeStore cubes(directory / kCubesFile, db::OpenMode::kCreate);
  write_identity(cubes, identity);
  if (identity.origin == kOriginTrained) {
    PointStore points(directory / kPointsFile, db::OpenMode::kCreate);
    write_identity(points, identity);
  }
}

/// A directory that goes, with all that is in it, unless it was renamed.
class TemporaryDirectory {
 public:
  explicit TemporaryDirectory(std::filesystem::path path) : path_(std::move(path)) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Writes a new map beside its place and renames it there, so that no half-made map is ever seen.
void make_map(const std::filesystem::path& path, const Identity& identity) {
  check_geometry(identity.geometry);
  if (Map::exists(path)) throw Error(ErrorCode::kUsage, path.string() + " already is a map");
  // "a/b.gdfmap/" names the same directory as "a/b.gdfmap", which the temporary one stands beside.
  const std::filesystem::path place = path.has_filename() ? path : path.parent_path();
  try {
    const TemporaryDirectory temporary(place.string() + ".tmp-" + std::to_string(::getpid()));
    write_new_databases(temporary.path(), identity);
    std::filesystem::rename(temporary.path(), place);
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
  make_map(path, {new_map_id(), kOriginTrained, geometry});
  return open(path, Access::kWrite);
}

Map Map::create_imported(const std::filesystem::path& path, const Geometry& geometry) {
  make_map(path, {new_map_id(), kOriginImported, geometry});
  return open(path, Access::kWrite);
}

Map Map::open(const std::filesystem::path& path, Access access, const RunContext& context) {
  if (!exists(path))
    throw Error(ErrorCode::kIo, path.string() +
                                    " is not a map: no such directory "
                                    "with points.db or cubes.db");
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->access = access;
  impl->store_cache_bytes = cache_bytes(context);
  const bool write = access == Access::kWrite;
  if (write) impl->lock = std::make_unique<FileLock>(path / kLockFile);
  const auto mode = [&](const char* name, db::OpenMode writing) {
    return write ? writing : db::reading_mode(impl->file(name));
  };

  std::optional<Identity> of_points, of_cubes;
  if (std::filesystem::exists(impl->file(kPointsFile))) {
    impl->open_points(mode(kPointsFile, db::OpenMode::kWrite));
    of_points = read_identity(*impl->points, impl->file(kPointsFile));
    if (!of_points) {
      throw Error(ErrorCode::kCorrupt, impl->file(kPointsFile).string() + " has no map identity");
    }
  }
  // A writer makes a lost cubes.db anew: training fills it again from the points.
  if (std::filesystem::exists(impl->file(kCubesFile)) || (write && of_points)) {
    impl->open_cubes(mode(kCubesFile, of_points ? db::OpenMode::kCreate : db::OpenMode::kWrite));
    of_cubes = read_identity(*impl->cubes, impl->file(kCubesFile));
    if (!of_cubes && of_points && write) {
      write_identity(*impl->cubes, *of_points);
      of_cubes = of_points;
    }
  }
  if (!of_cubes) {
    throw Error(ErrorCode::kCorrupt, path.string() +
                                         ": cubes.db is missing; `gdfmap train` makes "
                                         "it anew from the points");
  }
  if (of_points && of_points->id != of_cubes->id) {
    throw Error(ErrorCode::kCorrupt,
                path.string() + ": points.db and cubes.db belong to different maps");
  }
  impl->set_identity(std::move(*of_cubes));
  return Map(std::move(impl));
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
