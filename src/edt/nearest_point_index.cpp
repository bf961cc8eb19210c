#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>

#include <gdfmap/core/hilbert.hpp>
#include <gdfmap/edt/nearest_point_index.hpp>

#include "search_kernels.hpp"

namespace gdfmap {
namespace {

using Point = NearestPointIndex::Point;

/// Cells of 2⁸ steps (31 mm for 1 m cubes): 8 bits an axis, two digits of 12 bits a key.
constexpr int kCellShift = 8;
constexpr int kCellBits = 8;
constexpr int kDigitBits = 12;
constexpr int kNumDigits = 2;

/// Points that follow each other in one cell.
struct CellRun {
  std::uint32_t key;  ///< the cell's place along the Hilbert curve
  std::uint32_t begin;
};

std::uint32_t cell_key(const Point& p) {
  return static_cast<std::uint32_t>(
      hilbert_code({std::uint32_t{p[0]} >> kCellShift, std::uint32_t{p[1]} >> kCellShift,
                    std::uint32_t{p[2]} >> kCellShift},
                   kCellBits));
}

bool in_one_cell(const Point& p, const Point& q) {
  return ((p[0] ^ q[0]) | (p[1] ^ q[1]) | (p[2] ^ q[2])) >> kCellShift == 0;
}

/// One stable counting pass over a digit of the key.
void sort_by_digit(const std::vector<CellRun>& from, std::vector<CellRun>& to, int digit) {
  constexpr std::uint32_t kMask = (1u << kDigitBits) - 1;
  const int shift = digit * kDigitBits;
  std::vector<std::uint32_t> starts((1u << kDigitBits) + 1);
  for (const CellRun& run : from) ++starts[(run.key >> shift & kMask) + 1];
  for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
  for (const CellRun& run : from) to[starts[run.key >> shift & kMask]++] = run;
}

/// The points as runs in the order of their cells: few runs where points are dense and come in an
/// order of their own, as those of a point store do.
std::vector<CellRun> cell_order(std::span<const Point> points) {
  const auto begins_run = [&](std::uint32_t i) {
    return i == 0 || !in_one_cell(points[i - 1], points[i]);
  };
  std::size_t num_runs = 0;
  for (std::uint32_t i = 0; i < points.size(); ++i) num_runs += begins_run(i) ? 1 : 0;
  std::vector<CellRun> runs;
  runs.reserve(num_runs);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (begins_run(i)) runs.push_back({cell_key(points[i]), i});
  }
  std::vector<CellRun> buffer(num_runs);
  for (int digit = 0; digit < kNumDigits; ++digit) {
    sort_by_digit(runs, buffer, digit);
    runs.swap(buffer);
  }
  return runs;
}

constexpr std::size_t kWidth = kTreeWidth;

std::vector<TreeLeaf> make_leaves(std::span<const Point> points) {
  std::vector<TreeLeaf> leaves((points.size() + kWidth - 1) / kWidth);
  const auto put = [&](std::size_t i, const Point& p) {
    for (std::size_t a = 0; a < 3; ++a) leaves[i / kWidth].xyz[a][i % kWidth] = p[a];
  };
  std::size_t place = 0;
  std::size_t i = 0;
  for (const CellRun& run : cell_order(points)) {
    i = run.begin;
    do {
      put(place++, points[i++]);
    } while (i < points.size() && in_one_cell(points[i - 1], points[i]));
  }
  while (place < leaves.size() * kWidth) put(place++, points[i - 1]);
  return leaves;
}

using Boxes = std::vector<Eigen::AlignedBox3f>;

Boxes boxes_of(std::span<const TreeLeaf> leaves) {
  Boxes boxes(leaves.size());
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto [low, high] =
          std::minmax_element(std::begin(leaves[i].xyz[a]), std::end(leaves[i].xyz[a]));
      boxes[i].min()[static_cast<Eigen::Index>(a)] = *low;
      boxes[i].max()[static_cast<Eigen::Index>(a)] = *high;
    }
  }
  return boxes;
}

/// The nodes whose children have these boxes, which become those of the nodes.
std::vector<TreeNode> make_nodes(Boxes& boxes) {
  std::vector<TreeNode> nodes((boxes.size() + kWidth - 1) / kWidth);
  Boxes parents(nodes.size());
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
  boxes = std::move(parents);
  return nodes;
}

}  // namespace

std::vector<SamplePacket> make_packets(std::span<const Eigen::Vector3i> samples) {
  constexpr std::size_t kSize = SamplePacket::kSize;
  std::vector<SamplePacket> packets((samples.size() + kSize - 1) / kSize);
  for (SamplePacket& packet : packets) {
    packet.count = std::min(samples.size(), kSize);
    for (std::size_t i = 0; i < kSize; ++i) {
      const Eigen::Vector3i& sample = samples[std::min(i, packet.count - 1)];
      for (std::size_t a = 0; a < 3; ++a) {
        packet.xyz[a][i] = static_cast<float>(sample[static_cast<Eigen::Index>(a)]);
      }
      packet.best_squared[i] = i < packet.count ? std::numeric_limits<float>::infinity() : 0.0f;
    }
    samples = samples.subspan(packet.count);
  }
  return packets;
}

static_assert(SearchPacket::kSize == SamplePacket::kSize);

struct NearestPointIndex::Tree {
  const SearchKernels* kernels = nullptr;
  Eigen::AlignedBox3f bounds;
  std::vector<TreeLeaf> leaves;
  std::vector<std::vector<TreeNode>> levels;  ///< levels[0] above the leaves, the last is the root
  SearchTree view;

  Tree(std::span<const Point> points, InstructionSet set)
      : kernels(&search_kernels(set)), leaves(make_leaves(points)) {
    Boxes boxes = boxes_of(leaves);
    while (!boxes.empty()) {
      levels.push_back(make_nodes(boxes));
      if (boxes.size() > 1) continue;
      bounds = boxes.front();
      break;
    }
    view.leaves = leaves.data();
    Eigen::Vector3f::Map(view.min) = bounds.min();
    Eigen::Vector3f::Map(view.max) = bounds.max();
    view.num_levels = static_cast<int>(levels.size());
    for (std::size_t i = 0; i < levels.size(); ++i) view.levels[i] = levels[i].data();
  }
};

NearestPointIndex::NearestPointIndex(std::span<const Point> points, InstructionSet set)
    : tree_(std::make_unique<const Tree>(points, set)) {}
NearestPointIndex::~NearestPointIndex() = default;
NearestPointIndex::NearestPointIndex(NearestPointIndex&&) noexcept = default;

const Eigen::AlignedBox3f& NearestPointIndex::bounds() const { return tree_->bounds; }

std::size_t NearestPointIndex::memory_bytes() const {
  std::size_t bytes = tree_->leaves.size() * sizeof(TreeLeaf);
  for (const auto& level : tree_->levels) bytes += level.size() * sizeof(TreeNode);
  return bytes;
}

void NearestPointIndex::update(std::span<SamplePacket> packets, const Eigen::Vector3f& corner,
                               SampleOrder order) const {
  if (tree_->leaves.empty()) return;
  SearchPacket search;
  for (SamplePacket& packet : packets) {
    for (std::size_t a = 0; a < 3; ++a) {
      const float from = corner[static_cast<Eigen::Index>(a)];
      for (std::size_t i = 0; i < SamplePacket::kSize; ++i) {
        search.xyz[a][i] = packet.xyz[a][i] - from;
      }
    }
    std::ranges::copy(packet.best_squared, search.best);
    if (order == SampleOrder::kPackets) {
      tree_->kernels->search_packet(tree_->view, search);
    } else {
      for (std::size_t i = 0; i < packet.count; ++i) {
        tree_->kernels->search_one(tree_->view, search, static_cast<int>(i));
      }
    }
    std::ranges::copy(search.best, packet.best_squared);
  }
}

}  // namespace gdfmap
