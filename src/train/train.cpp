#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/failpoint.hpp>
#include <gdfmap/core/parallel.hpp>
#include <gdfmap/core/pool.hpp>
#include <gdfmap/train/train.hpp>

#include "cube_job.hpp"
#include "cube_selection.hpp"
#include "point_changes.hpp"
#include "stored_tiles.hpp"
#include "tile_plan.hpp"
#include "tile_samples.hpp"

namespace gdfmap {
namespace {

/// Tiles whose cubes are fitted side by side and committed together.
constexpr std::size_t kMaxWindowTiles = 16;
/// Cubes that one task fits: the more, the longer all lanes of a vector register are busy, also on
/// the last steps of the ladder, which few cubes need; the fewer, the less one thread waits for
/// another at the end of a window.
constexpr std::size_t kFewestCubesPerTask = 48, kMostCubesPerTask = 320;
/// What a tile of a window holds at most, beside what is bounded by itself: samples of 512 cubes,
/// lattice and results.
constexpr std::size_t kTileBytes = std::size_t{8} << 20;
/// What a cube's samples take once more while it is fitted.
constexpr std::size_t kBytesOfFittedCube =
    (kPopulatedGrid.size() + kPopulatedGrid.num_held_out()) * sizeof(float);
/// Of the samples of a chunk, while they are looked up together with those of others.
constexpr std::size_t kChunkBytes = std::size_t{40} << 10;

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

void store_occupied(CubeStore& cubes, std::span<const TilePoints> tiles) {
  std::vector<OccupiedTile> occupied;
  occupied.reserve(tiles.size());
  for (const TilePoints& tile : tiles) occupied.push_back({tile.key, tile.cubes});
  failpoint("train.before_occupied");
  cubes.set_occupied(occupied);
  failpoint("train.after_occupied");
}

/// The cubes of a level that have Gaussians.
TileMasks served_cubes(CubeStore& cubes, int level) {
  TileMasks masks;
  for (const auto& [key, state] : stored_states(cubes, level)) masks.emplace(key, state.served);
  return masks;
}

/// Nothing that is kept is taken on trust: what fails its checksum goes, and is fitted again.
std::int64_t delete_damaged(CubeStore& cubes, const RunContext& context) {
  const std::vector<std::string> faults = cubes.delete_damaged(context);
  constexpr std::size_t kMostWarnings = 10;
  for (const std::string& fault : std::span(faults).first(std::min(faults.size(), kMostWarnings))) {
    context.warn(fault + "; it is fitted again");
  }
  if (faults.size() > kMostWarnings) {
    context.warn(std::to_string(faults.size() - kMostWarnings) + " more such tiles");
  }
  return static_cast<std::int64_t>(faults.size());
}

/// Brings the tiles of one level up to date, a window of them at a time.
class LevelTrainer {
 public:
  LevelTrainer(Map& map, int level, const FitConfig& config, const TilePlan& plan,
               ExactDistance& exact_distance, const RunContext& context, TrainReport& report)
      : map_(map),
        level_(level),
        config_(config),
        configuration_(configuration_digest(config)),
        plan_(plan),
        changes_(map.points(), plan.groups()),
        exact_distance_(exact_distance),
        context_(context),
        report_(report) {}

  void run() {
    const auto [stale, obsolete] =
        find_stale(plan_.tiles(), stored_states(map_.cubes(), level_), configuration_);
    if (!obsolete.empty()) map_.cubes().erase(obsolete);
    report_.num_tiles += static_cast<std::int64_t>(plan_.tiles().size());
    report_.num_tiles_deleted += static_cast<std::int64_t>(obsolete.size());
    const std::size_t window =
        std::clamp(context_.memory() / 8 / kTileBytes, std::size_t{1}, kMaxWindowTiles);
    for (std::size_t begin = 0; begin < stale.size(); begin += window) {
      context_.throw_if_stopped();
      train_window(std::span(stale).subspan(begin, std::min(window, stale.size() - begin)));
      report_progress(begin + window, stale.size());
    }
    context_.throw_if_stopped();
  }

 private:
  /// One tile of the window on its way.
  struct Work {
    const CandidateTile* tile;
    std::vector<SurroundingTile> surroundings;  ///< of today
    std::vector<CubeRecord> stored;             ///< of the former tile, whatever it was made from
    /// Where points came or went since; empty when nothing stored counts any more.
    std::optional<std::vector<Box3>> changes;
    std::vector<int> kept;  ///< indices of stored cubes that no change can have reached
    std::optional<TileSamples> samples;
  };
  /// One cube of the window whose samples were looked up.
  struct Slot {
    std::size_t tile = 0;   ///< in the window
    std::size_t place = 0;  ///< among the tile's samples
    bool populated = false;
    std::uint64_t input = 0;
    CubeRecord record;
    bool is_stale = false;
    bool done = false;  ///< the record is of today
  };

  void train_window(std::span<const CandidateTile> tiles) {
    std::vector<Work> works = read_former(tiles);
    look_up(works);
    std::vector<Slot> slots;
    for (std::size_t i = 0; i < works.size(); ++i) {
      const TileSamples& samples = *works[i].samples;
      for (std::size_t n = 0; n < samples.cubes().size(); ++n) {
        slots.push_back({i, n, samples.is_populated(n), 0, {}, false, false});
      }
    }
    keep_unchanged(works, slots);
    fit(works, slots);
    commit(std::move(works), std::move(slots));
  }

  /// What is stored of these tiles, and what changed around them since.
  std::vector<Work> read_former(std::span<const CandidateTile> tiles) {
    std::vector<Work> works;
    for (const CandidateTile& tile : tiles) {
      Work& work = works.emplace_back();
      work.tile = &tile;
      work.surroundings = plan_.surroundings(tile.key);
      auto stored = map_.cubes().read(tile.key);
      if (!stored) continue;
      if (stored->configuration == configuration_) {
        work.changes = changes_.since(stored->surroundings, work.surroundings);
      }
      work.stored = std::move(stored->cubes);
    }
    return works;
  }

  /// The samples of all cubes that a change may have reached, on all threads.
  void look_up(std::span<Work> works) {
    std::vector<TileKey> keys;
    for (const Work& work : works) keys.push_back(work.tile->key);
    const bool can_keep = exact_distance_.can_keep(keys);
    if (can_keep) prefetch(works);
    parallel_for(works.size(), context_.threads(), [&](std::size_t i) {
      Work& work = works[i];
      CubeSelection selection = select_cubes(*work.tile, work.stored, work.changes, map_.lattice(),
                                             config_, exact_distance_);
      work.kept = std::move(selection.kept);
      work.samples.emplace(work.tile->key, std::move(selection.looked_up), work.tile->populated,
                           map_.lattice());
    });
    std::vector<Chunk> chunks;
    for (Work& work : works) {
      for (std::size_t n = 0; n < work.samples->num_chunks(); ++n) {
        chunks.push_back({&*work.samples, n});
      }
    }
    if (can_keep) {
      look_up_one_by_one(chunks);
    } else {
      look_up_together(chunks);
    }
  }

  /// A part of the samples of a tile.
  struct Chunk {
    TileSamples* samples;
    std::size_t number;
  };

  void look_up_one_by_one(std::span<const Chunk> chunks) {
    parallel_for(chunks.size(), context_.threads(), [&](std::size_t i) {
      if (context_.stop_requested()) return;
      const auto& [samples, number] = chunks[i];
      samples->keep(number,
                    exact_distance_.nearest(tile_origin(samples->tile()), samples->samples(number),
                                            SampleOrder::kPackets));
    });
    context_.throw_if_stopped();
  }

  /// As many chunks at a time as there is room for.
  void look_up_together(std::span<const Chunk> chunks) {
    const std::size_t most = std::max<std::size_t>(1, context_.memory() / 8 / kChunkBytes);
    for (std::size_t begin = 0; begin < chunks.size(); begin += most) {
      context_.throw_if_stopped();
      const auto part = chunks.subspan(begin, std::min(most, chunks.size() - begin));
      std::vector<std::vector<Eigen::Vector3i>> samples;
      std::vector<SampleGroup> groups;
      for (const Chunk& chunk : part) samples.push_back(chunk.samples->samples(chunk.number));
      for (std::size_t i = 0; i < part.size(); ++i) {
        groups.push_back({tile_origin(part[i].samples->tile()), samples[i]});
      }
      const auto distances = exact_distance_.nearest(groups, context_.threads());
      for (std::size_t i = 0; i < part.size(); ++i) {
        part[i].samples->keep(part[i].number, distances[i]);
      }
    }
  }

  /// Where a whole tile is looked up, all around it will be asked for.
  void prefetch(std::span<const Work> works) {
    std::vector<TileKey> keys;
    for (const Work& work : works) {
      if (!work.changes && work.tile->key.level == 0) keys.push_back(work.tile->key);
    }
    exact_distance_.prefetch(keys, context_.threads());
  }

  [[nodiscard]] CubeJob job_of(const Slot& slot, std::span<const Work> works) const {
    const Work& work = works[slot.tile];
    CubeJob job;
    job.key = cube_at(work.tile->key, work.samples->cubes()[slot.place]);
    job.populated = slot.populated;
    job.edge = map_.lattice().cube_edge(work.tile->key.level);
    job.targets = work.samples->targets(slot.place);
    job.held_out = work.samples->held_out(slot.place);
    return job;
  }

  /// Takes over the stored records of the cubes whose inputs did not change.
  void keep_unchanged(std::span<const Work> works, std::vector<Slot>& slots) {
    parallel_for(slots.size(), context_.threads(), [&](std::size_t i) {
      Slot& slot = slots[i];
      slot.input = input_digest(job_of(slot, works), configuration_);
      const int index = works[slot.tile].samples->cubes()[slot.place];
      const auto& records = works[slot.tile].stored;
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
  void fit(std::span<const Work> works, std::vector<Slot>& slots) {
    std::vector<Slot*> stale;
    for (Slot& slot : slots) {
      if (slot.is_stale) stale.push_back(&slot);
    }
    const auto empty =
        std::ranges::stable_partition(stale, [](const Slot* s) { return s->populated; });
    std::vector<std::span<Slot* const>> tasks;
    add_tasks({stale.begin(), empty.begin()}, tasks);
    add_tasks(empty, tasks);
    parallel_for(tasks.size(), context_.threads(), [&](std::size_t i) {
      if (context_.stop_requested()) return;
      std::vector<CubeJob> jobs;
      std::vector<std::uint64_t> inputs;
      for (const Slot* slot : tasks[i]) {
        jobs.push_back(job_of(*slot, works));
        inputs.push_back(slot->input);
      }
      const auto fitter = fitters_.borrow([&] { return std::make_unique<CubeFitter>(config_); });
      std::vector<CubeRecord> records = gdfmap::run(jobs, inputs, config_, *fitter);
      for (std::size_t k = 0; k < records.size(); ++k) {
        tasks[i][k]->record = std::move(records[k]);
        tasks[i][k]->done = true;
      }
    });
  }

  /// Cuts cubes of one class into tasks of equal size, as many for each thread.
  void add_tasks(std::span<Slot* const> cubes, std::vector<std::span<Slot* const>>& tasks) const {
    const auto divided = [](std::size_t a, std::size_t b) { return (a + b - 1) / b; };
    const auto threads = static_cast<std::size_t>(context_.threads());
    const std::size_t most = std::clamp(context_.memory() / 8 / kBytesOfFittedCube / threads,
                                        kFewestCubesPerTask, kMostCubesPerTask);
    const std::size_t wanted = divided(divided(cubes.size(), most), threads) * threads;
    const std::size_t count =
        std::min(wanted, std::max<std::size_t>(1, cubes.size() / kFewestCubesPerTask));
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t begin = i * cubes.size() / count, end = (i + 1) * cubes.size() / count;
      tasks.push_back(cubes.subspan(begin, end - begin));
    }
  }

  /// Stores the tiles of which every cube is done: all of them unless a stop was requested.
  void commit(std::vector<Work> works, std::vector<Slot> slots) {
    std::vector<TileRecord> records;
    auto slot = slots.begin();
    for (std::size_t i = 0; i < works.size(); ++i) {
      const auto end = std::find_if(slot, slots.end(), [&](const Slot& s) { return s.tile != i; });
      if (std::all_of(slot, end, [](const Slot& s) { return s.done; })) {
        records.push_back(record_of(std::move(works[i]), std::span(slot, end)));
      }
      slot = end;
    }
    std::vector<EncodedTile> encoded(records.size());
    parallel_for(records.size(), context_.threads(),
                 [&](std::size_t i) { encoded[i] = encode(records[i]); });
    map_.cubes().put(encoded);
    report_.num_tiles_trained += static_cast<std::int64_t>(records.size());
  }

  [[nodiscard]] TileRecord record_of(Work work, std::span<Slot> slots) {
    const TileKey& key = work.tile->key;
    TileRecord record{key,           std::move(work.surroundings),        configuration_,
                      config_.codec, map_.lattice().cube_edge(key.level), {}};
    for (CubeRecord& cube : work.stored) {
      if (std::ranges::binary_search(work.kept, cube.index))
        record.cubes.push_back(std::move(cube));
    }
    report_.num_cubes_unchanged += static_cast<std::int64_t>(record.cubes.size());
    report_.num_cubes_out_of_reach += static_cast<std::int64_t>(record.cubes.size());
    for (Slot& slot : slots) {
      count(slot);
      record.cubes.push_back(std::move(slot.record));
    }
    std::ranges::sort(record.cubes, {}, &CubeRecord::index);
    return record;
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
    constexpr const char* kStages[kMaxLevels] = {"tiles", "tiles of level 1", "tiles of level 2"};
    context_.progress({kStages[level_], std::min(done, total), total,
                       std::to_string(report_.num_cubes_fitted) + " cubes fitted"});
  }

  Map& map_;
  int level_;
  const FitConfig& config_;
  Digest configuration_;
  const TilePlan& plan_;
  PointChanges changes_;
  ExactDistance& exact_distance_;
  Pool<CubeFitter> fitters_;
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
  ExactDistance exact_distance(points, occupied, context.memory() / 4);
  TileMasks finer_served;
  for (int level = 0; level < map.geometry().num_levels; ++level) {
    const TilePlan plan(level, occupied, map.lattice(), config, finer_served);
    LevelTrainer(map, level, config, plan, exact_distance, context, report).run();
    if (level + 1 < map.geometry().num_levels) finer_served = served_cubes(map.cubes(), level);
  }
  return report;
}

}  // namespace gdfmap
