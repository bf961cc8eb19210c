#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/tiling/block_codec.hpp>

namespace gdfmap {

/// Voxel (x, y, z) of a grid anchored at the world's origin spans [x, x + 1) · edge, and so on for
/// y and z.
struct VoxelKey {
  std::int64_t x = 0, y = 0, z = 0;
  auto operator<=>(const VoxelKey&) const = default;
};

struct VoxelKeyHash {
  [[nodiscard]] std::size_t operator()(const VoxelKey& key) const noexcept;
};

/// Longest edge of a voxel, in quantisation steps: 128 cubes.
inline constexpr std::int64_t kMaxVoxelSteps = std::int64_t{1} << 20;

/// Count, first and second moments of the points of one voxel, in quantisation steps from the
/// voxel's lower corner. Integers, so that points may come and go in any order and the sums are
/// those of the points that are there; exact for up to 2⁴⁰ points.
class VoxelMoments {
 public:
  __extension__ typedef __int128 Integer;

  /// @param offset  three numbers of steps in [0, kMaxVoxelSteps)
  void add(const std::array<std::int64_t, 3>& offset);
  /// The inverse of add(), for a point that was added. @throws Error kInternal when there is none.
  void remove(const std::array<std::int64_t, 3>& offset);
  VoxelMoments& operator+=(const VoxelMoments& other);
  /// @throws Error kInternal when `other` has more points.
  VoxelMoments& operator-=(const VoxelMoments& other);
  bool operator==(const VoxelMoments&) const = default;

  [[nodiscard]] std::int64_t count() const { return count_; }
  /// In steps from the voxel's lower corner; count() > 0.
  [[nodiscard]] Vector3 mean() const;
  /// Σ (p − mean)(p − mean)ᵀ / (n − 1), in square steps; the numerator is exact, so that nothing
  /// cancels wherever the points lie. count() > 1.
  [[nodiscard]] Eigen::Matrix3d covariance() const;

 private:
  std::int64_t count_ = 0;
  std::array<std::int64_t, 3> first_{};
  std::array<Integer, 6> second_{};  ///< xx, xy, xz, yy, yz, zz
};

/// The moments of every voxel that holds points. Two of them that hold the same points are equal,
/// whatever was added and removed on the way. Not thread-safe while it changes.
class VoxelGrid {
 public:
  /// @param edge  of a voxel in metres, rounded to whole quantisation steps
  /// @throws Error kUsage unless that gives from 1 to kMaxVoxelSteps steps.
  VoxelGrid(const Lattice& lattice, double edge);

  void add(const LatticePoint& p);
  /// @throws Error kInternal when no such point can be there.
  void remove(const LatticePoint& p);
  /// The points of a level-0 tile; fastest in Morton order.
  void add(const TileKey& tile, std::span<const TileOffset> points);
  /// Adds or removes all points of another grid: of a tile, say, whose voxels at the faces have
  /// points in two tiles. @throws Error kInternal for another lattice or edge, or points that are
  /// not there.
  VoxelGrid& operator+=(const VoxelGrid& other);
  VoxelGrid& operator-=(const VoxelGrid& other);
  bool operator==(const VoxelGrid&) const = default;

  [[nodiscard]] double step() const { return step_; }  ///< a quantisation step in metres
  [[nodiscard]] std::int64_t voxel_steps() const { return voxel_steps_; }
  [[nodiscard]] double voxel_edge() const { return step_ * static_cast<double>(voxel_steps_); }
  [[nodiscard]] VoxelKey voxel_of(const LatticePoint& p) const;
  /// Voxels that hold a point, in no order.
  [[nodiscard]] const std::unordered_map<VoxelKey, VoxelMoments, VoxelKeyHash>& voxels() const {
    return voxels_;
  }

 private:
  [[nodiscard]] std::array<std::int64_t, 3> offset_of(const LatticePoint& p,
                                                      const VoxelKey& voxel) const;
  void check_same_voxels(const VoxelGrid& other) const;

  double step_;
  std::int64_t voxel_steps_;
  std::unordered_map<VoxelKey, VoxelMoments, VoxelKeyHash> voxels_;
};

/// Fewest points from which a normal distribution is made.
inline constexpr std::int64_t kMinNdtPoints = 6;
/// Least eigenvalue of a cell's covariance over its largest, before it is inverted.
inline constexpr double kMinEigenvalueRatio = 0.01;

/// The normal distribution of a voxel's points, in metres relative to a local origin.
struct NdtCell {
  VoxelKey voxel;
  std::int64_t num_points = 0;
  Vector3 mean = Vector3::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< as measured
  /// Of the covariance with its smaller eigenvalues raised to kMinEigenvalueRatio of the largest.
  Eigen::Matrix3d inverse_covariance = Eigen::Matrix3d::Zero();
};

/// The cell of one voxel; empty below kMinNdtPoints, and where all points coincide.
/// @param corner  the voxel's lower corner relative to the local origin, metres
[[nodiscard]] std::optional<NdtCell> make_ndt_cell(const VoxelKey& voxel,
                                                   const VoxelMoments& moments,
                                                   const Vector3& corner, double step);

/// Which cells around a point are looked up.
enum class NdtNeighborhood {
  kOwn,    ///< the voxel that holds the point (DIRECT1)
  kFaces,  ///< and the six that share a face with it (DIRECT7)
  kAll,    ///< and those that share an edge or a corner (DIRECT27)
};
inline constexpr std::size_t kMaxNdtNeighbors = 27;

/// The cells of a grid, found by place. In the order of their keys, so that nothing depends on how
/// the grid came about. Immutable and thread-safe.
class NdtCells {
 public:
  /// @param origin  of the local frame in which the cells are given and looked up; near them, so
  ///                that doubles are exact enough
  NdtCells(const VoxelGrid& grid, const LatticePoint& origin);

  [[nodiscard]] std::span<const NdtCell> cells() const { return cells_; }
  [[nodiscard]] const LatticePoint& origin() const { return origin_; }
  [[nodiscard]] double voxel_edge() const { return voxel_edge_; }

  /// The cell whose voxel holds a point; null where there is none.
  /// @param p_local  metres from origin(), finite
  [[nodiscard]] const NdtCell* at(const Vector3& p_local) const;
  /// Puts the cells around a point into `found` and returns how many there are, the point's own
  /// first if there is one. Valid as long as this object.
  [[nodiscard]] std::size_t around(const Vector3& p_local, NdtNeighborhood neighborhood,
                                   std::span<const NdtCell*, kMaxNdtNeighbors> found) const;

 private:
  [[nodiscard]] VoxelKey voxel_at(const Vector3& p_local) const;
  [[nodiscard]] const NdtCell* find(const VoxelKey& voxel) const;
  void index_cells();

  std::vector<NdtCell> cells_;
  /// Open addressing with linear probing; a slot holds the number of a cell, or kFreeSlot. Its size
  /// is a power of two, at least twice the cells.
  std::vector<std::uint32_t> slots_;
  LatticePoint origin_;
  VoxelKey origin_voxel_;
  Vector3 origin_offset_;  ///< of the origin from its voxel's lower corner, metres
  double voxel_edge_;
};

}  // namespace gdfmap
