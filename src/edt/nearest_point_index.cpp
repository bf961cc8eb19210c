#include <algorithm>
#include <array>

#include <gdfmap/core/morton.hpp>
#include <gdfmap/edt/nearest_point_index.hpp>

namespace gdfmap {
namespace {

/// Morton cells of 2⁶ steps (8 mm for 1 m cubes): 10 bits an axis, 30 bits a key.
constexpr int kCellShift = 6;
constexpr int kDigitBits = 10;
constexpr int kNumDigits = 3;

std::uint32_t cell_code(const Eigen::Vector3f& p) {
  const auto cell = [](float v) { return static_cast<std::uint64_t>(v) >> kCellShift; };
  return static_cast<std::uint32_t>(morton_code(cell(p.x()), cell(p.y()), cell(p.z())));
}

struct KeyedPoint {
  std::uint32_t key;
  std::uint32_t index;
};

/// One stable counting pass over a digit of the key.
void sort_by_digit(const std::vector<KeyedPoint>& from, std::vector<KeyedPoint>& to, int digit) {
  constexpr std::uint32_t kMask = (1u << kDigitBits) - 1;
  const int shift = digit * kDigitBits;
  std::array<std::uint32_t, (1u << kDigitBits) + 1> starts{};
  for (const KeyedPoint& p : from) ++starts[(p.key >> shift & kMask) + 1];
  for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
  for (const KeyedPoint& p : from) to[starts[p.key >> shift & kMask]++] = p;
}

std::vector<Eigen::Vector3f> morton_sorted(const std::vector<Eigen::Vector3f>& points) {
  std::vector<KeyedPoint> keyed(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    keyed[i] = {cell_code(points[i]), static_cast<std::uint32_t>(i)};
  }
  const auto by_key = [](const KeyedPoint& a, const KeyedPoint& b) { return a.key < b.key; };
  if (!std::is_sorted(keyed.begin(), keyed.end(), by_key)) {
    std::vector<KeyedPoint> buffer(points.size());
    for (int digit = 0; digit < kNumDigits; ++digit) {
      sort_by_digit(keyed, buffer, digit);
      keyed.swap(buffer);
    }
  }
  std::vector<Eigen::Vector3f> sorted(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) sorted[i] = points[keyed[i].index];
  return sorted;
}

}  // namespace

NearestPointIndex::NearestPointIndex(std::vector<Eigen::Vector3f> points)
    : num_points_(points.size()) {
  for (const Eigen::Vector3f& p : points) bounds_.extend(p);
  points = morton_sorted(points);
  build_leaves(points);
  build_tree();
}

std::size_t NearestPointIndex::memory_bytes() const {
  std::size_t bytes = leaves_.size() * sizeof(Leaf);
  for (const auto& level : levels_) bytes += level.size() * sizeof(Node);
  return bytes;
}

void NearestPointIndex::build_leaves(std::span<const Eigen::Vector3f> sorted) {
  leaves_.resize((sorted.size() + kWidth - 1) / kWidth);
  for (std::size_t i = 0; i < leaves_.size() * kWidth; ++i) {
    const Eigen::Vector3f& p = sorted[std::min(i, sorted.size() - 1)];
    Leaf& leaf = leaves_[i / kWidth];
    leaf.x[i % kWidth] = p.x();
    leaf.y[i % kWidth] = p.y();
    leaf.z[i % kWidth] = p.z();
  }
}

void NearestPointIndex::build_tree() {
  std::vector<Eigen::AlignedBox3f> boxes(leaves_.size());
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    for (std::size_t j = 0; j < kWidth; ++j) {
      boxes[i].extend(Eigen::Vector3f(leaves_[i].x[j], leaves_[i].y[j], leaves_[i].z[j]));
    }
  }
  while (!boxes.empty()) {
    std::vector<Node> nodes((boxes.size() + kWidth - 1) / kWidth);
    std::vector<Eigen::AlignedBox3f> parents(nodes.size());
    for (std::size_t i = 0; i < nodes.size() * kWidth; ++i) {
      const bool used = i < boxes.size();
      if (used) parents[i / kWidth].extend(boxes[i]);
      for (std::size_t a = 0; a < 3; ++a) {
        const auto axis = static_cast<Eigen::Index>(a);
        constexpr float kFarAway = std::numeric_limits<float>::infinity();
        nodes[i / kWidth].min[a][i % kWidth] = used ? boxes[i].min()[axis] : kFarAway;
        nodes[i / kWidth].max[a][i % kWidth] = used ? boxes[i].max()[axis] : kFarAway;
      }
    }
    levels_.push_back(std::move(nodes));
    if (levels_.back().size() == 1) return;
    boxes = std::move(parents);
  }
}

void NearestPointIndex::update(std::span<const Eigen::Vector3f> samples,
                               std::span<float> best_squared) const {
  if (leaves_.empty()) return;
  std::size_t previous_leaf = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    Search search{samples[i], best_squared[i], previous_leaf};
    // A neighbouring sample's nearest leaf is a good first guess: most boxes are then pruned.
    visit_leaf(previous_leaf, search);
    visit_node(levels_.size() - 1, 0, search);
    best_squared[i] = search.best;
    previous_leaf = search.best_leaf;
  }
}

void NearestPointIndex::visit_leaf(std::size_t leaf, Search& search) const {
  const Leaf& points = leaves_[leaf];
  const float px = search.p.x(), py = search.p.y(), pz = search.p.z();
  float nearest = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < kWidth; ++i) {
    const float dx = points.x[i] - px, dy = points.y[i] - py, dz = points.z[i] - pz;
    nearest = std::min(nearest, dx * dx + dy * dy + dz * dz);
  }
  if (nearest < search.best) {
    search.best = nearest;
    search.best_leaf = leaf;
  }
}

void NearestPointIndex::visit_node(std::size_t level, std::size_t node, Search& search) const {
  const Node& boxes = levels_[level][node];
  const float p[3] = {search.p.x(), search.p.y(), search.p.z()};
  alignas(64) float bounds[kWidth] = {};
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t i = 0; i < kWidth; ++i) {
      const float outside =
          std::max(std::max(boxes.min[a][i] - p[a], p[a] - boxes.max[a][i]), 0.0f);
      bounds[i] += outside * outside;
    }
  }
  // Nearest children first; few are left after the bound, so that insertion is the cheapest order.
  std::array<std::uint8_t, kWidth> order;
  std::size_t count = 0;
  for (std::size_t i = 0; i < kWidth; ++i) {
    if (!(bounds[i] < search.best)) continue;
    std::size_t place = count++;
    for (; place > 0 && bounds[order[place - 1]] > bounds[i]; --place)
      order[place] = order[place - 1];
    order[place] = static_cast<std::uint8_t>(i);
  }
  for (std::size_t j = 0; j < count; ++j) {
    if (!(bounds[order[j]] < search.best)) return;
    const std::size_t child = node * kWidth + order[j];
    if (level == 0) {
      visit_leaf(child, search);
    } else {
      visit_node(level - 1, child, search);
    }
  }
}

}  // namespace gdfmap
