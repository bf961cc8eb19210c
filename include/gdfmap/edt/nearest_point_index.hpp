#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <gdfmap/core/instruction_set.hpp>

namespace gdfmap {

/// How samples follow each other.
enum class SampleOrder {
  kScattered,  ///< anyhow
  kPackets,    ///< runs of 64 stand next to each other and help each other's search
};

/// Up to 64 samples and the nearest that is known of each.
struct alignas(64) SamplePacket {
  static constexpr std::size_t kSize = 64;
  float xyz[3][kSize];  ///< whole steps from an origin; places beyond the count repeat the last
  float best_squared[kSize];  ///< steps²; infinity at first, 0 beyond the count
  std::size_t count;
};

/// Samples, in whole steps within ±2²⁴, in packets of 64 as they come; nothing is known of them
/// yet.
[[nodiscard]] std::vector<SamplePacket> make_packets(std::span<const Eigen::Vector3i> samples);

/// Exact squared distances to the nearest of up to a few million points.
///
/// Coordinates are whole quantisation steps from the minimum corner of the points' level-0 tile:
/// points in [0, 65536), samples within ±2²⁴ of the corner. Differences are exact in float32, so
/// that a squared distance depends on the pair alone, whatever the order of traversal and the
/// instruction set, and the box bounds, rounded by the same monotone operations, never exceed it:
/// pruning needs no slack.
///
/// Points are sorted along a Hilbert curve into leaves of 16, under a tree of 16-wide boxes.
/// Immutable after construction; thread-safe.
class NearestPointIndex {
 public:
  using Point = std::array<std::uint16_t, 3>;

  /// @param set  a supported one
  explicit NearestPointIndex(std::span<const Point> points,
                             InstructionSet set = best_instruction_set());
  ~NearestPointIndex();
  NearestPointIndex(NearestPointIndex&&) noexcept;

  [[nodiscard]] const Eigen::AlignedBox3f& bounds() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  /// Lowers best_squared to the squared distance to the nearest point where that is less.
  /// @param corner  of the points' tile, from the samples' origin, in steps
  void update(std::span<SamplePacket> packets, const Eigen::Vector3f& corner,
              SampleOrder order) const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

}  // namespace gdfmap
