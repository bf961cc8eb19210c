#include "cube_store_verify.hpp"

#include <functional>

#include <gdfmap/core/error.hpp>
#include <gdfmap/store/tile_codec.hpp>

#include "tile_row.hpp"

namespace gdfmap {
namespace {

using Faults = std::vector<std::string>;

/// A damaged file can fail any statement: that is a fault found, not a reason to stop looking.
void collect(Faults& faults, const std::function<void()>& check) {
  try {
    check();
  } catch (const Error& error) {
    faults.emplace_back(error.what());
  }
}

void check_file(db::Database& database, Faults& faults) {
  db::Statement check(database, "PRAGMA integrity_check");
  while (check.step()) {
    const std::string line = check.text(0);
    if (line != "ok") faults.push_back(database.path().string() + ": " + line);
  }
}

/// Reports the tiles that a query finds; its columns are level, x, y, z.
void check_none(db::Database& database, const std::string& sql, const char* fault, Faults& faults) {
  db::Statement select(database, sql);
  while (select.step()) {
    const auto value = [&](int column) {
      return static_cast<std::int32_t>(select.integer(column));
    };
    faults.push_back(database.path().string() + ": " +
                     tile_name({value(0), value(1), value(2), value(3)}) + ": " + fault);
  }
}

void check_tables(db::Database& database, Faults& faults) {
  check_none(database,
             "SELECT level, x, y, z FROM tiles LEFT JOIN tile_blobs ON tile = id "
             "WHERE tile IS NULL ORDER BY level, x, y, z",
             "has no cubes", faults);
  check_none(database,
             "SELECT level, x, y, z FROM tiles JOIN tile_blobs ON tile = id "
             "WHERE length(data) <> num_bytes ORDER BY level, x, y, z",
             "size of the cubes differs from its row", faults);
  check_none(database, "SELECT 0, x, y, z FROM occupied WHERE length(mask) <> 64 ORDER BY x, y, z",
             "occupancy mask is not 64 bytes", faults);
  const std::int64_t orphans = database.query_int(
      "SELECT count(*) FROM tile_blobs WHERE tile NOT IN (SELECT id FROM tiles)");
  if (orphans > 0) {
    faults.push_back(database.path().string() + ": cubes of " + std::to_string(orphans) +
                     " tiles that do not exist");
  }
}

bool same_counts(const TileState& a, const TileState& b) {
  return a.num_cubes == b.num_cubes && a.num_populated == b.num_populated &&
         a.num_poor == b.num_poor && a.num_failed == b.num_failed &&
         a.num_gaussians == b.num_gaussians && a.num_measured == b.num_measured;
}

void check_tile(CubeStore& store, const TileState& state, const std::string& place,
                Faults& faults) {
  const std::optional<TileRecord> tile = store.read(state.key);
  if (!tile) return;  // erased since it was listed
  const TileState actual = summarize(*tile, static_cast<std::size_t>(state.num_bytes));
  if (!same_counts(actual, state)) faults.push_back(place + "cubes differ from its row's counts");
  if (actual.content != state.content) faults.push_back(place + "content digest does not match");
}

void check_tiles(CubeStore& store, const std::string& name, Faults& faults) {
  std::vector<TileState> states;
  collect(faults,
          [&] { store.for_each_state([&](const TileState& state) { states.push_back(state); }); });
  for (const TileState& state : states) {
    const std::string place = name + ": " + tile_name(state.key) + ": ";
    collect(faults, [&] { check_tile(store, state, place, faults); });
  }
}

}  // namespace

std::vector<std::string> verify_store(CubeStore& store, db::Database& database, bool checksums) {
  Faults faults;
  collect(faults, [&] { check_file(database, faults); });
  collect(faults, [&] { check_tables(database, faults); });
  if (checksums) check_tiles(store, database.path().string(), faults);
  return faults;
}

}  // namespace gdfmap
