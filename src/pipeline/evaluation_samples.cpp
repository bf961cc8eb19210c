#include "evaluation_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>

#include <gdfmap/core/morton.hpp>

namespace gdfmap {
namespace {

/// Places drawn for every sample that is kept: enough that parts of little volume get theirs.
constexpr std::uint64_t kDrawsPerSample = 4;
constexpr std::size_t kPiece = 8192;
/// Parts by distance: one for each band, and one for what lies beyond them.
constexpr std::size_t kNumParts = kBandLimits.size();

/// A place that may become a sample.
struct Candidate {
  LatticePoint p;
  std::uint64_t i;  ///< in its region's sequence
  float distance;
  std::uint32_t region;
};

std::size_t part_of(double distance) {
  const auto limit = std::upper_bound(kBandLimits.begin(), kBandLimits.end(), distance);
  return static_cast<std::size_t>(limit - kBandLimits.begin()) - 1;
}

bool lies_before(const Candidate& a, const Candidate& b) {
  const auto coordinates = [](const Candidate& c) {
    return std::array<std::int64_t, 3>{c.p.x, c.p.y, c.p.z};
  };
  const auto p = coordinates(a), q = coordinates(b);
  if (p != q) return morton_less({p[0], p[1], p[2]}, {q[0], q[1], q[2]});
  return std::tie(a.region, a.i) < std::tie(b.region, b.i);
}

/// Draws the same number of places for every region, in an order that keeps neighbours together.
std::vector<Candidate> draw_candidates(const EvaluationDomain& domain, std::uint64_t per_region,
                                       std::uint64_t seed) {
  std::vector<Candidate> candidates;
  candidates.reserve(per_region * domain.num_regions());
  for (std::size_t region = 0; region < domain.num_regions(); ++region) {
    for (std::uint64_t i = 0; i < per_region; ++i) {
      const auto p = domain.draw(region, seed, i);
      if (p) candidates.push_back({*p, i, 0.0f, static_cast<std::uint32_t>(region)});
    }
  }
  std::sort(candidates.begin(), candidates.end(), lies_before);
  return candidates;
}

void measure(std::vector<Candidate>& candidates, EvaluationTruth& truth,
             const RunContext& context) {
  std::vector<LatticePoint> places;
  for (std::size_t begin = 0; begin < candidates.size(); begin += kPiece) {
    context.throw_if_stopped();
    const auto piece =
        std::span(candidates).subspan(begin, std::min(kPiece, candidates.size() - begin));
    places.clear();
    for (const Candidate& candidate : piece) places.push_back(candidate.p);
    const std::vector<double> distances = truth.distances(places);
    for (std::size_t i = 0; i < piece.size(); ++i) {
      piece[i].distance = static_cast<float>(distances[i]);
    }
    context.progress({"places", begin + piece.size(), candidates.size(), {}});
  }
}

/// Which candidates are samples, and what one of each part weighs.
class Selection {
 public:
  Selection(const EvaluationDomain& domain, std::span<const Candidate> candidates,
            std::uint64_t per_region, std::uint64_t num_samples)
      : weights_(domain.num_regions() * kNumParts), last_(weights_.size()) {
    std::vector<std::vector<std::uint64_t>> members(weights_.size());
    for (const Candidate& candidate : candidates) {
      if (is_judged(domain, candidate)) members[part(candidate)].push_back(candidate.i);
    }
    std::vector<std::uint64_t> counts;
    for (const auto& part : members) counts.push_back(part.size());
    const std::vector<std::uint64_t> shares = equal_shares(counts, num_samples);
    for (std::size_t j = 0; j < members.size(); ++j) {
      if (shares[j] == 0) continue;
      // The first of a sequence of independent places are as random as all.
      const auto end = members[j].begin() + static_cast<std::ptrdiff_t>(shares[j]);
      std::nth_element(members[j].begin(), end - 1, members[j].end());
      last_[j] = *(end - 1) + 1;
      weights_[j] = domain.drawn_volume(j / kNumParts) / static_cast<double>(per_region) *
                    static_cast<double>(counts[j]) / static_cast<double>(shares[j]);
    }
    for (std::size_t region = 0; region < domain.num_regions(); ++region) {
      levels_.push_back(domain.level(region));
    }
  }

  /// Zero for a candidate that is no sample.
  [[nodiscard]] double weight(const Candidate& candidate) const {
    const std::size_t j = part(candidate);
    return candidate.i < last_[j] ? weights_[j] : 0.0;
  }
  [[nodiscard]] int level(const Candidate& candidate) const { return levels_[candidate.region]; }

 private:
  static std::size_t part(const Candidate& candidate) {
    return candidate.region * kNumParts + part_of(static_cast<double>(candidate.distance));
  }
  /// What lies beyond the bands is judged in cubes of level 0 alone.
  static bool is_judged(const EvaluationDomain& domain, const Candidate& candidate) {
    return domain.level(candidate.region) == 0 ||
           static_cast<double>(candidate.distance) < kMaxJudgedDistance;
  }

  std::vector<double> weights_;      ///< by region and part
  std::vector<std::uint64_t> last_;  ///< end of the places that are kept, in the region's sequence
  std::vector<int> levels_;          ///< by region
};

std::vector<Vector3> regular_offsets(double step, double edge) {
  std::vector<double> along;
  for (double offset = step / 2; offset < edge; offset += step) along.push_back(offset);
  std::vector<Vector3> offsets;
  for (const double x : along) {
    for (const double y : along) {
      for (const double z : along) offsets.emplace_back(x, y, z);
    }
  }
  return offsets;
}

}  // namespace

std::vector<std::uint64_t> equal_shares(std::span<const std::uint64_t> counts,
                                        std::uint64_t total) {
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return counts[a] < counts[b]; });
  std::vector<std::uint64_t> shares(counts.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::uint64_t left = order.size() - i;
    shares[order[i]] = std::min(counts[order[i]], total / left);
    total -= shares[order[i]];
  }
  return shares;
}

void visit_stratified_samples(const EvaluationDomain& domain, EvaluationTruth& truth,
                              const Lattice& lattice, std::uint64_t num_samples, std::uint64_t seed,
                              const RunContext& context, const SampleVisitor& visit) {
  const std::uint64_t per_region = kDrawsPerSample * num_samples / domain.num_regions() + 1;
  std::vector<Candidate> candidates = draw_candidates(domain, per_region, seed);
  measure(candidates, truth, context);
  const Selection selection(domain, candidates, per_region, num_samples);
  std::vector<EvaluationSample> piece;
  std::uint64_t num_visited = 0;
  const auto hand_over = [&] {
    context.throw_if_stopped();
    visit(piece);
    num_visited += piece.size();
    piece.clear();
    context.progress({"samples", num_visited, num_samples, {}});
  };
  for (const Candidate& candidate : candidates) {
    const double weight = selection.weight(candidate);
    if (weight == 0.0) continue;
    piece.push_back({lattice.to_world(candidate.p), candidate.p, selection.level(candidate), weight,
                     static_cast<double>(candidate.distance)});
    if (piece.size() == kPiece) hand_over();
  }
  hand_over();
}

std::uint64_t regular_samples_per_cube(double step, double edge) {
  const double per_axis = std::ceil(edge / step - 0.5);
  return static_cast<std::uint64_t>(per_axis * per_axis * per_axis);
}

void visit_regular_samples(const JudgedLevel& level, EvaluationTruth& truth, const Lattice& lattice,
                           double step, const RunContext& context, const SampleVisitor& visit) {
  const std::vector<Vector3> offsets = regular_offsets(step, lattice.cube_edge(level.level()));
  std::uint64_t num_done = 0;
  for (const JudgedTile& tile : level.tiles()) {
    context.throw_if_stopped();
    std::vector<EvaluationSample> samples;
    std::vector<LatticePoint> places;
    for (int cube = 0; cube < kCubesPerTile; ++cube) {
      if (!tile.cubes.test(cube)) continue;
      const Vector3 origin = lattice.cube_origin(cube_at(tile.key, cube));
      for (const Vector3& offset : offsets) {
        const auto place = lattice.quantize(origin + offset);
        if (!place) continue;  // on the far face of the last cube of the lattice
        samples.push_back({origin + offset, *place, level.level(), step * step * step, 0.0});
        places.push_back(*place);
      }
    }
    const std::vector<double> distances = truth.distances(places);
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i].distance = distances[i];
    visit(samples);
    context.progress({"tiles", ++num_done, level.tiles().size(), {}});
  }
}

}  // namespace gdfmap
