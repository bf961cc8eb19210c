#include "cube_store_verify.hpp"

#include <optional>
#include <utility>

#include <gdfmap/core/error.hpp>
#include <gdfmap/db/verification.hpp>
#include <gdfmap/store/tile_codec.hpp>

#include "tile_row.hpp"

namespace gdfmap {
namespace {

constexpr std::uint64_t kTilesPerReport = 64;

/// What no single tile tells.
void check_tables(db::Verification& verification) {
  verification.check_none(
      "SELECT 'tile 0,' || x || ',' || y || ',' || z || ': occupancy mask is not 64 bytes' "
      "FROM occupied WHERE length(mask) <> 64 ORDER BY x, y, z");
  verification.check_none(
      "SELECT 'cubes of ' || count(*) || ' tiles that do not exist' FROM tile_blobs "
      "WHERE tile NOT IN (SELECT id FROM tiles) HAVING count(*) > 0");
}

/// What can be said of the tiles without reading their cubes.
void check_tile_rows(db::Verification& verification) {
  const std::string name = "SELECT 'tile ' || level || ',' || x || ',' || y || ',' || z || ': ";
  verification.check_none(name +
                          "has no cubes' FROM tiles LEFT JOIN tile_blobs ON tile = id "
                          "WHERE tile IS NULL ORDER BY level, x, y, z");
  verification.check_none(name +
                          "size of the cubes differs from its row' FROM tiles "
                          "JOIN tile_blobs ON tile = id WHERE length(data) <> num_bytes "
                          "ORDER BY level, x, y, z");
}

bool same_counts(const TileState& a, const TileState& b) {
  return a.num_cubes == b.num_cubes && a.num_populated == b.num_populated &&
         a.num_poor == b.num_poor && a.num_failed == b.num_failed &&
         a.num_gaussians == b.num_gaussians && a.num_measured == b.num_measured &&
         a.mean_mae == b.mean_mae && a.max_mae == b.max_mae && a.num_bytes == b.num_bytes &&
         a.served == b.served;
}

/// Why the cubes of a tile cannot be trusted; null when they can.
const char* fault_of(const EncodedTile& tile) {
  const TileState& state = tile.state;
  const TileState actual = summarize(decode(tile), tile.cubes.size());
  if (!same_counts(actual, state)) return "cubes differ from its row's counts";
  if (actual.content != state.content) return "content digest does not match";
  return nullptr;
}

/// Every tile's row and bytes, one after the other in the order in which they lie in the file.
class TileChecker {
 public:
  TileChecker(db::Database& database, const RunContext& context)
      : database_(database),
        context_(context),
        select_(database, std::string("SELECT ") + kStateColumns + ", " + kTileColumns +
                              " FROM tiles LEFT JOIN tile_blobs ON tile = id "
                              "WHERE id = ?") {}

  /// Calls report(id, fault) for each tile that is damaged; "tile 0,1,2,3: …".
  template <typename Report>
  void run(const Report& report) {
    const std::vector<std::int64_t> ids = tile_ids();
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (i % kTilesPerReport == 0) {
        context_.throw_if_stopped();
        context_.progress({"tiles checked", i, ids.size(), ""});
      }
      if (const std::optional<std::string> fault = check(ids[i])) report(ids[i], *fault);
    }
    context_.progress({"tiles checked", ids.size(), ids.size(), ""});
  }

 private:
  [[nodiscard]] std::vector<std::int64_t> tile_ids() {
    std::vector<std::int64_t> ids;
    db::Statement select(database_, "SELECT id FROM tiles ORDER BY id");
    while (select.step()) ids.push_back(select.integer(0));
    return ids;
  }

  [[nodiscard]] std::optional<std::string> check(std::int64_t id) {
    const db::RewindGuard guard(select_);
    std::string place = "row " + std::to_string(id) + " of tiles: ";
    try {
      if (!select_.bind(id).step()) return std::nullopt;
      const TileState state = read_state(select_, database_.path().string());
      place = tile_name(state.key) + ": ";
      const char* const fault = fault_of(read_tile(select_, state));
      return fault == nullptr ? std::nullopt : std::optional(place + fault);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kCorrupt && error.code() != ErrorCode::kIo) throw;
      return place + error.what();
    }
  }

  db::Database& database_;
  const RunContext& context_;
  db::Statement select_;
};

}  // namespace

std::vector<std::string> verify_store(db::Database& database, bool checksums,
                                      const RunContext& context) {
  db::Verification verification(database);
  verification.check_file(!checksums);
  context.throw_if_stopped();
  if (checksums) {
    verification.run([&] {
      TileChecker(database, context).run([&](std::int64_t, const std::string& fault) {
        verification.add(fault);
      });
    });
  } else {
    check_tile_rows(verification);
  }
  check_tables(verification);
  return verification.take_faults();
}

std::vector<std::string> delete_damaged_tiles(db::Database& database, const RunContext& context) {
  std::vector<std::string> faults;
  std::vector<std::int64_t> ids;
  TileChecker(database, context).run([&](std::int64_t id, const std::string& fault) {
    ids.push_back(id);
    faults.push_back(database.path().string() + ": " + fault);
  });
  db::Transaction transaction(database);
  for (const char* const table : {"tiles WHERE id = ?", "tile_blobs WHERE tile = ?"}) {
    db::Statement erase(database, std::string("DELETE FROM ") + table);
    for (const std::int64_t id : ids) erase.bind(id).run();
  }
  database.execute("DELETE FROM tile_blobs WHERE tile NOT IN (SELECT id FROM tiles)");
  if (const std::int64_t num_orphans = database.changes(); num_orphans > 0) {
    faults.push_back(database.path().string() + ": cubes of " + std::to_string(num_orphans) +
                     " tiles that do not exist");
  }
  transaction.commit();
  return faults;
}

}  // namespace gdfmap
