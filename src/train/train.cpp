#include <algorithm>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/failpoint.hpp>
#include <gdfmap/core/parallel.hpp>
#include <gdfmap/train/train.hpp>

#include "cube_job.hpp"
#include "tile_plan.hpp"
#include "tile_samples.hpp"

namespace gdfmap {
namespace {

/// Tiles whose cubes are fitted side by side and committed together.
constexpr std::size_t kMaxWindowTiles = 16;
/// Cubes that one task fits: enough to keep the lanes of a vector register busy.
constexpr std::size_t kCubesPerTask = 96;
/// What a tile of a window holds at most: samples of 512 cubes, lattice and results.
constexpr std::size_t kTileBytes = std::size_t{8} << 20;

/// The configuration of this run; stores it when it is new.
FitConfig settle_configuration(Map& map, const TrainOptions& options) {
  const auto stored_text = map.cubes().meta(kFitConfigKey);
  if (!stored_text || options.retrain) {
    const FitConfig config = options.config.value_or(FitConfig::defaults(map.geometry().cube_size));
    map.cubes().set_meta(kFitConfigKey, config.canonical());
    return config;
  }
  const FitConfig stored = FitConfig::from_canonical(*stored_text);
  if (options.config && !(*options.config == stored)) {
    std::string keys;
    for (const std::string& key : options.config->differing_keys(stored)) {
      keys += (keys.empty() ? "" : ", ") + key;
    }
    throw Error(ErrorCode::kUsage, map.path().string() + " was trained with other values of " +
                                       keys +
                                       "; --retrain fits the whole map again with the new ones");
  }
  return stored;
}

std::vector<TilePoints> occupied_tiles(PointStore& points) {
  std::vector<TilePoints> tiles;
  points.for_each_tile([&](const TilePoints& tile) { tiles.push_back(tile); });
  return tiles;
}

void store_occupied(CubeStore& cubes, std::span<const TilePoints> tiles) {
  std::vector<OccupiedTile> occupied;
  occupied.reserve(tiles.size());
  for (const TilePoints& tile : tiles) occupied.push_back({tile.key, tile.cubes});
  failpoint("train.before_occupied");
  cubes.set_occupied(occupied);
  failpoint("train.after_occupied");
}

/// What the stored tiles were made from.
struct TileOrigin {
  Digest surroundings, configuration;
};
using TileOrigins = std::unordered_map<TileKey, TileOrigin, TileKeyHash>;

TileOrigins stored_origins(CubeStore& cubes) {
  TileOrigins origins;
  cubes.for_each_state([&](const TileState& state) {
    origins[state.key] = {state.surroundings, state.configuration};
  });
  return origins;
}

/// Nothing that is kept is taken on trust: what fails its checksum goes, and is fitted again.
std::int64_t delete_damaged(CubeStore& cubes, const RunContext& context) {
  const std::vector<std::string> faults = cubes.delete_damaged(context);
  for (const std::string& fault : faults) context.warn(fault + "; it is fitted again");
  return static_cast<std::int64_t>(faults.size());
}

/// Deletes tiles that are no candidates any more.
std::int64_t delete_obsolete(CubeStore& cubes, TileOrigins origins,
                             const std::vector<CandidateTile>& plan) {
  for (const CandidateTile& tile : plan) origins.erase(tile.key);
  std::vector<TileKey> obsolete;
  for (const auto& [key, origin] : origins) obsolete.push_back(key);
  if (!obsolete.empty()) cubes.erase(obsolete);
  return static_cast<std::int64_t>(obsolete.size());
}

/// Brings stale tiles up to date, a window of them at a time.
class Trainer {
 public:
  Trainer(Map& map, const FitConfig& config, std::span<const TilePoints> occupied,
          const RunContext& context, TrainReport& report)
      : map_(map),
        config_(config),
        configuration_(configuration_digest(config)),
        exact_distance_(map.points(), occupied, context.memory() / 4),
        context_(context),
        report_(report) {}

  [[nodiscard]] const Digest& configuration() const { return configuration_; }

  void run(std::span<const CandidateTile> stale) {
    const std::size_t window =
        std::clamp(context_.memory() / 8 / kTileBytes, std::size_t{1}, kMaxWindowTiles);
    for (std::size_t begin = 0; begin < stale.size(); begin += window) {
      context_.throw_if_stopped();
      train_window(stale.subspan(begin, std::min(window, stale.size() - begin)));
      report_progress(begin + window, stale.size());
    }
  }

 private:
  /// One cube of the window.
  struct Slot {
    std::size_t tile = 0;   ///< in the window
    std::size_t place = 0;  ///< among the tile's cubes
    bool populated = false;
    Digest input;
    CubeRecord record;
    bool is_stale = false;
    bool done = false;  ///< the record is of today
  };

  void train_window(std::span<const CandidateTile> tiles) {
    const std::vector<TileSamples> samples = look_up(tiles);
    std::vector<Slot> slots;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      for (std::size_t n = 0; n < samples[i].cubes().size(); ++n) {
        slots.push_back({i, n, tiles[i].cubes.test(samples[i].cubes()[n]), {}, {}, false, false});
      }
    }
    keep_unchanged(tiles, samples, slots);
    fit(tiles, samples, slots);
    commit(tiles, std::move(slots));
  }

  /// The samples of all tiles, on all threads.
  std::vector<TileSamples> look_up(std::span<const CandidateTile> tiles) {
    std::vector<TileKey> keys;
    for (const CandidateTile& tile : tiles) keys.push_back(tile.key);
    exact_distance_.prefetch(keys, context_.threads());
    std::vector<std::optional<TileSamples>> selected(tiles.size());
    parallel_for(tiles.size(), context_.threads(), [&](std::size_t i) {
      selected[i].emplace(tiles[i].key, tiles[i].cubes, map_.lattice(), config_, exact_distance_);
    });
    std::vector<TileSamples> samples;
    std::vector<std::pair<std::size_t, std::size_t>> chunks;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      samples.push_back(std::move(*selected[i]));
      for (std::size_t n = 0; n < samples[i].num_chunks(); ++n) chunks.emplace_back(i, n);
    }
    parallel_for(chunks.size(), context_.threads(), [&](std::size_t i) {
      if (!context_.stop_requested()) samples[chunks[i].first].look_up(chunks[i].second);
    });
    context_.throw_if_stopped();
    return samples;
  }

  [[nodiscard]] CubeJob job_of(const Slot& slot, std::span<const CandidateTile> tiles,
                               std::span<const TileSamples> samples) const {
    const TileKey& tile = tiles[slot.tile].key;
    const TileSamples& of_tile = samples[slot.tile];
    CubeJob job;
    job.key = cube_at(tile, of_tile.cubes()[slot.place]);
    job.populated = slot.populated;
    job.edge = map_.lattice().cube_edge(tile.level);
    of_tile.copy_targets(slot.place, job.targets);
    of_tile.copy_held_out(slot.place, job.held_out);
    return job;
  }

  /// Takes over the stored records of the cubes whose inputs did not change.
  void keep_unchanged(std::span<const CandidateTile> tiles, std::span<const TileSamples> samples,
                      std::vector<Slot>& slots) {
    const std::vector<std::vector<CubeRecord>> former = former_records(tiles);
    parallel_for(slots.size(), context_.threads(), [&](std::size_t i) {
      Slot& slot = slots[i];
      slot.input = input_digest(job_of(slot, tiles, samples), configuration_);
      const int index = samples[slot.tile].cubes()[slot.place];
      const auto& records = former[slot.tile];
      const auto same = std::find_if(records.begin(), records.end(), [&](const CubeRecord& r) {
        return r.index == index && r.input == slot.input;
      });
      slot.is_stale = same == records.end();
      slot.done = !slot.is_stale;
      if (slot.done) slot.record = *same;
    });
  }

  /// Fits the stale cubes, many at a time: those of one class together, since they climb the same
  /// ladder.
  void fit(std::span<const CandidateTile> tiles, std::span<const TileSamples> samples,
           std::vector<Slot>& slots) {
    std::vector<Slot*> stale;
    for (Slot& slot : slots) {
      if (slot.is_stale) stale.push_back(&slot);
    }
    std::stable_partition(stale.begin(), stale.end(), [](const Slot* s) { return s->populated; });
    const std::size_t num_tasks = (stale.size() + kCubesPerTask - 1) / kCubesPerTask;
    parallel_for(num_tasks, context_.threads(), [&](std::size_t task) {
      if (context_.stop_requested()) return;
      const std::size_t begin = task * kCubesPerTask;
      const auto group =
          std::span(stale).subspan(begin, std::min(kCubesPerTask, stale.size() - begin));
      std::vector<CubeJob> jobs;
      std::vector<Digest> inputs;
      for (const Slot* slot : group) {
        jobs.push_back(job_of(*slot, tiles, samples));
        inputs.push_back(slot->input);
      }
      std::vector<CubeRecord> records = gdfmap::run(jobs, inputs, config_);
      for (std::size_t i = 0; i < group.size(); ++i) {
        group[i]->record = std::move(records[i]);
        group[i]->done = true;
      }
    });
  }

  /// What is stored of these tiles.
  [[nodiscard]] std::vector<std::vector<CubeRecord>> former_records(
      std::span<const CandidateTile> tiles) {
    std::vector<std::vector<CubeRecord>> former(tiles.size());
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      if (auto record = map_.cubes().read(tiles[i].key)) former[i] = std::move(record->cubes);
    }
    return former;
  }

  /// Stores the tiles of which every cube is done: all of them unless a stop was requested.
  void commit(std::span<const CandidateTile> tiles, std::vector<Slot> slots) {
    std::vector<TileRecord> records;
    for (std::size_t i = 0; i < tiles.size(); ++i) {
      const auto of_tile = [&](const Slot& slot) { return slot.tile == i; };
      const auto begin = std::find_if(slots.begin(), slots.end(), of_tile);
      const auto end = std::find_if_not(begin, slots.end(), of_tile);
      if (!std::all_of(begin, end, [](const Slot& slot) { return slot.done; })) continue;
      TileRecord& record =
          records.emplace_back(TileRecord{tiles[i].key,
                                          tiles[i].surroundings,
                                          configuration_,
                                          config_.codec,
                                          map_.lattice().cube_edge(tiles[i].key.level),
                                          {}});
      for (auto slot = begin; slot != end; ++slot) {
        count(*slot);
        record.cubes.push_back(std::move(slot->record));
      }
    }
    map_.cubes().put(records);
    report_.num_tiles_trained += static_cast<std::int64_t>(records.size());
  }

  void count(const Slot& slot) {
    if (!slot.is_stale) {
      ++report_.num_cubes_unchanged;
      return;
    }
    ++report_.num_cubes_fitted;
    if (slot.record.status == CubeStatus::kPoor) ++report_.num_cubes_poor;
    if (slot.record.status == CubeStatus::kFailed) ++report_.num_cubes_failed;
  }

  void report_progress(std::size_t done, std::size_t total) const {
    context_.progress({"tiles", std::min(done, total), total,
                       std::to_string(report_.num_cubes_fitted) + " cubes fitted"});
  }

  Map& map_;
  const FitConfig& config_;
  Digest configuration_;
  ExactDistance exact_distance_;
  const RunContext& context_;
  TrainReport& report_;
};

}  // namespace

TrainReport train(Map& map, const TrainOptions& options, const RunContext& context) {
  PointStore& points = map.points();
  const FitConfig config = settle_configuration(map, options);
  const std::vector<TilePoints> occupied = occupied_tiles(points);
  store_occupied(map.cubes(), occupied);

  TrainReport report;
  report.num_tiles_damaged = delete_damaged(map.cubes(), context);
  std::vector<CandidateTile> plan = plan_tiles(occupied, map.lattice(), config);
  report.num_tiles = static_cast<std::int64_t>(plan.size());
  const TileOrigins origins = stored_origins(map.cubes());
  report.num_tiles_deleted = delete_obsolete(map.cubes(), origins, plan);

  Trainer trainer(map, config, occupied, context, report);
  std::erase_if(plan, [&](const CandidateTile& tile) {
    const auto stored = origins.find(tile.key);
    return stored != origins.end() && stored->second.surroundings == tile.surroundings &&
           stored->second.configuration == trainer.configuration();
  });
  trainer.run(plan);
  context.throw_if_stopped();
  return report;
}

}  // namespace gdfmap
