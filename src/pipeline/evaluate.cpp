#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/evaluate.hpp>
#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/query/tile_cache.hpp>

#include "evaluation_domain.hpp"
#include "evaluation_gradients.hpp"
#include "evaluation_samples.hpp"
#include "evaluation_statistics.hpp"
#include "evaluation_truth.hpp"

namespace gdfmap {
namespace {

/// Of more samples than this only every n-th gradient is judged.
constexpr std::uint64_t kMaxGradients = 200'000;
/// What a sample takes at most, in bytes: regular ones, and random ones while they are chosen.
constexpr std::uint64_t kBytesPerRegular = 100, kBytesPerRandom = 300;

/// The judged cubes of a map or a model, by ascending level; of level 0 alone where the field knows
/// no other.
std::vector<JudgedLevel> list_levels(Map* map, const std::filesystem::path& model,
                                     BlendMode blend) {
  const bool is_gdf1 = blend == BlendMode::kGdf1;
  std::map<int, std::vector<JudgedTile>> tiles;
  const auto add = [&](const TileRecord& record) {
    const JudgedTile tile = judged_tile(record, is_gdf1);
    if (tile.cubes.any()) tiles[record.key.level].push_back(tile);
  };
  if (map == nullptr) {
    for (const TileRecord& record : tiles_of_model(read_model(model).cubes)) add(record);
  } else {
    std::vector<TileKey> keys;
    map->cubes().for_each_state([&](const TileState& state) {
      if (state.num_cubes > 0 && !(is_gdf1 && state.key.level > 0)) keys.push_back(state.key);
    });
    for (const TileKey& key : keys) {
      if (const auto record = map->cubes().read(key)) add(*record);
    }
  }
  std::vector<JudgedLevel> levels;
  for (auto& [level, list] : tiles) levels.emplace_back(level, std::move(list));
  if (levels.empty() || levels.front().level() != 0) {
    throw Error(ErrorCode::kUsage, model.string() + " has no cubes: train it first");
  }
  return levels;
}

/// Evaluates single cubes, without their neighbours.
class OwnCube {
 public:
  OwnCube(std::shared_ptr<TileSource> source, const Lattice& lattice, std::size_t cache_bytes)
      : tiles_(std::move(source), cache_bytes), lattice_(lattice) {}

  /// |d̂ − d| of the cube that holds the sample; NaN where it cannot be read.
  [[nodiscard]] double error(const EvaluationSample& sample) {
    const CubeKey key = cube_at_level(sample.p, sample.level);
    const CachedTile tile = tiles_.get(tile_of(key));
    const DecodedTile::Cube* const cube =
        tile.tile ? tile.tile->find_served(cube_index_in_tile(key)) : nullptr;
    if (cube == nullptr) return std::numeric_limits<double>::quiet_NaN();
    const Vector3 p_local = sample.p_world - lattice_.cube_origin(key);
    return std::abs(gdfmap::evaluate(tile.tile->kernel(*cube), p_local) - sample.distance);
  }

 private:
  TileCache tiles_;
  const Lattice& lattice_;
};

/// What samples are judged with.
struct Judge {
  const DistanceField& field;
  const JudgedLevel& level0;
  EvaluationTruth& truth;
  OwnCube own_cube;
  GradientJudge gradients;
  const EvaluateOptions& options;
  std::vector<JudgedRecord> records = {};
  std::uint64_t num_set_aside = 0;

  void judge(std::span<const EvaluationSample> samples);

 private:
  [[nodiscard]] std::vector<FieldSample> ask(std::span<const EvaluationSample> samples) const;
  [[nodiscard]] std::vector<bool> are_told(std::span<const EvaluationSample> samples) const;
  [[nodiscard]] JudgedRecord record_of(const EvaluationSample& sample, const JudgedSample& judged,
                                       const GradientJudgement& gradient);
  void set_classes(const LatticePoint& p, JudgedRecord& record) const;
};

std::vector<FieldSample> Judge::ask(std::span<const EvaluationSample> samples) const {
  std::vector<Vector3> points;
  for (const EvaluationSample& sample : samples) points.push_back(sample.p_world);
  std::vector<FieldSample> answers(samples.size());
  field.at(points, answers);
  return answers;
}

std::vector<bool> Judge::are_told(std::span<const EvaluationSample> samples) const {
  std::vector<LatticePoint> places;
  std::vector<double> distances;
  for (const EvaluationSample& sample : samples) {
    places.push_back(sample.p);
    distances.push_back(sample.distance);
  }
  return truth.is_told_by_points(places, distances);
}

void Judge::set_classes(const LatticePoint& p, JudgedRecord& record) const {
  const CubeKey cube = cube_at_level(p, 0);
  const JudgedTile* const tile = level0.find(tile_of(cube));
  if (tile == nullptr) return;
  const int index = cube_index_in_tile(cube);
  record.is_populated = truth.populated(tile->key).value_or(tile->populated).test(index);
  record.is_outer_shell = tile->outer_shell.test(index);
}

JudgedRecord Judge::record_of(const EvaluationSample& sample, const JudgedSample& judged,
                              const GradientJudgement& gradient) {
  JudgedRecord record;
  record.distance = static_cast<float>(sample.distance);
  record.weight = static_cast<float>(sample.weight);
  record.level = static_cast<std::int8_t>(sample.level);
  record.status = judged.answer.status;
  record.gradient = gradient;
  if (sample.level == 0) set_classes(sample.p, record);
  if (!judged.is_stated()) return record;
  record.error = static_cast<float>(judged.error());
  record.expected_error = static_cast<float>(judged.answer.expected_error);
  record.own_cube_error =
      static_cast<float>(sample.level == kNoLevel ? judged.error() : own_cube.error(sample));
  return record;
}

void Judge::judge(std::span<const EvaluationSample> samples) {
  const std::vector<FieldSample> answers = ask(samples);
  const std::vector<bool> told = are_told(samples);
  const std::vector<GradientJudgement> judgements = gradients.judge(samples, answers);
  std::vector<JudgedSample> judged;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!told[i]) {
      ++num_set_aside;
      continue;
    }
    const EvaluationSample& sample = samples[i];
    judged.push_back({sample.p_world, sample.distance, sample.weight, sample.level, answers[i]});
    records.push_back(record_of(sample, judged.back(), judgements[i]));
  }
  if (options.visit) options.visit(judged);
}

void check(const EvaluateOptions& options, double cube_size) {
  if (options.step && !(*options.step >= cube_size / 1000 && *options.step <= cube_size)) {
    throw Error(ErrorCode::kUsage, "step must be between cube_size / 1000 and cube_size");
  }
  if (options.num_samples == 0) throw Error(ErrorCode::kUsage, "no samples are asked for");
}

/// How many samples there will be. @throws Error kUsage when memory does not hold them.
std::uint64_t count_samples(const EvaluateOptions& options, const JudgedLevel& level0,
                            const Lattice& lattice, const RunContext& context) {
  const std::uint64_t count =
      options.step
          ? level0.num_cubes() * regular_samples_per_cube(*options.step, lattice.cube_size())
          : options.num_samples;
  const std::uint64_t bytes = options.step ? kBytesPerRegular : kBytesPerRandom;
  if (count > context.memory() / 2 / bytes) {
    throw Error(ErrorCode::kUsage, std::to_string(count) + " samples need more than half of " +
                                       std::to_string(context.memory() >> 20) +
                                       " MiB: take fewer, or allow more memory");
  }
  return count;
}

void judge_regular(Judge& judge, const Lattice& lattice, const RunContext& context) {
  visit_regular_samples(judge.level0, judge.truth, lattice, *judge.options.step, context,
                        [&](std::span<const EvaluationSample> piece) { judge.judge(piece); });
}

void judge_stratified(Judge& judge, const EvaluationDomain& domain, const Lattice& lattice,
                      const RunContext& context) {
  visit_stratified_samples(domain, judge.truth, lattice, judge.options.num_samples,
                           judge.options.seed, context,
                           [&](std::span<const EvaluationSample> piece) { judge.judge(piece); });
}

std::vector<int> numbers_of(std::span<const JudgedLevel> levels) {
  std::vector<int> numbers;
  for (const JudgedLevel& level : levels) numbers.push_back(level.level());
  return numbers;
}

}  // namespace

Evaluation evaluate(const std::filesystem::path& map_or_model, const EvaluateOptions& options,
                    const RunContext& context) {
  std::unique_ptr<Map> map;
  if (std::filesystem::is_directory(map_or_model)) {
    map = std::make_unique<Map>(Map::open(map_or_model, Access::kRead, context));
  }
  const std::shared_ptr<TileSource> source = open_tile_source(map_or_model);
  const Lattice lattice(source->geometry().cube_size);
  check(options, lattice.cube_size());
  const std::vector<JudgedLevel> levels = list_levels(map.get(), map_or_model, options.blend);
  const std::uint64_t num_samples = count_samples(options, levels.front(), lattice, context);
  EvaluationTruth truth(map.get(), lattice, options, context);
  const DistanceField field(source, {context.memory() / 8, options.blend, context.threads()});

  Judge judge{field,
              levels.front(),
              truth,
              OwnCube(source, lattice, context.memory() / 16),
              GradientJudge(truth, num_samples / kMaxGradients + 1),
              options};
  judge.records.reserve(num_samples);
  if (options.step) {
    judge_regular(judge, lattice, context);
  } else {
    // The ancestor's blending knows neither other levels nor places outside its cubes.
    const bool only_level0 = options.blend == BlendMode::kGdf1;
    const EvaluationDomain domain(
        levels, only_level0 ? std::vector<OccupiedTile>{} : source->occupied(), lattice);
    judge_stratified(judge, domain, lattice, context);
  }
  Evaluation evaluation = summarize(judge.records, numbers_of(levels));
  evaluation.num_set_aside = judge.num_set_aside;
  return evaluation;
}

}  // namespace gdfmap
