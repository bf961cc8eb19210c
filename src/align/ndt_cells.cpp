#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include <gdfmap/align/ndt_cells.hpp>
#include <gdfmap/core/error.hpp>

namespace gdfmap {
namespace {

constexpr std::uint32_t kFreeSlot = std::numeric_limits<std::uint32_t>::max();

/// The own voxel, then those that share a face, then the others.
constexpr std::array<std::array<int, 3>, kMaxNdtNeighbors> make_neighbors() {
  std::array<std::array<int, 3>, kMaxNdtNeighbors> neighbors{};
  std::size_t next = 0;
  for (int num_axes = 0; num_axes <= 3; ++num_axes) {
    for (int i = 0; i < 27; ++i) {
      const std::array<int, 3> shift = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
      const int moved = (shift[0] != 0) + (shift[1] != 0) + (shift[2] != 0);
      if (moved == num_axes) neighbors[next++] = shift;
    }
  }
  return neighbors;
}
constexpr auto kNeighbors = make_neighbors();

std::size_t num_neighbors(NdtNeighborhood neighborhood) {
  switch (neighborhood) {
    case NdtNeighborhood::kOwn:
      return 1;
    case NdtNeighborhood::kFaces:
      return 7;
    case NdtNeighborhood::kAll:
      break;
  }
  return kMaxNdtNeighbors;
}

std::int64_t checked_voxel_steps(double edge, double step) {
  const double steps = std::round(edge / step);
  if (!(steps >= 1.0 && steps <= static_cast<double>(kMaxVoxelSteps))) {
    throw Error(ErrorCode::kUsage, "a voxel's edge must be from one quantisation step (" +
                                       std::to_string(step) + " m) to 2^20 of them, not " +
                                       std::to_string(edge) + " m");
  }
  return static_cast<std::int64_t>(steps);
}

[[noreturn]] void throw_missing() {
  throw Error(ErrorCode::kInternal, "points are taken from a voxel that does not hold them");
}

/// The inverse of a covariance whose smaller eigenvalues are raised; empty when all are zero.
std::optional<Eigen::Matrix3d> floored_inverse(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  const double largest = solver.eigenvalues()(2);
  if (!(largest > 0.0)) return std::nullopt;
  const Vector3 floored = solver.eigenvalues().cwiseMax(kMinEigenvalueRatio * largest);
  const Eigen::Matrix3d& axes = solver.eigenvectors();
  return axes * floored.cwiseInverse().asDiagonal() * axes.transpose();
}

}  // namespace

std::size_t VoxelKeyHash::operator()(const VoxelKey& key) const noexcept {
  // Odd multipliers, then the finaliser of SplitMix64.
  std::uint64_t h = static_cast<std::uint64_t>(key.x) * 0x9e3779b97f4a7c15u;
  h ^= static_cast<std::uint64_t>(key.y) * 0xc2b2ae3d27d4eb4fu;
  h ^= static_cast<std::uint64_t>(key.z) * 0x165667b19e3779f9u;
  h = (h ^ h >> 30) * 0xbf58476d1ce4e5b9u;
  h = (h ^ h >> 27) * 0x94d049bb133111ebu;
  return static_cast<std::size_t>(h ^ h >> 31);
}

void VoxelMoments::add(const std::array<std::int64_t, 3>& offset) {
  ++count_;
  std::size_t pair = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    first_[a] += offset[a];
    for (std::size_t b = a; b < 3; ++b) second_[pair++] += offset[a] * offset[b];
  }
}

void VoxelMoments::remove(const std::array<std::int64_t, 3>& offset) {
  VoxelMoments point;
  point.add(offset);
  *this -= point;
}

VoxelMoments& VoxelMoments::operator+=(const VoxelMoments& other) {
  count_ += other.count_;
  for (std::size_t a = 0; a < 3; ++a) first_[a] += other.first_[a];
  for (std::size_t i = 0; i < second_.size(); ++i) second_[i] += other.second_[i];
  return *this;
}

VoxelMoments& VoxelMoments::operator-=(const VoxelMoments& other) {
  if (count_ < other.count_) throw_missing();
  count_ -= other.count_;
  for (std::size_t a = 0; a < 3; ++a) first_[a] -= other.first_[a];
  for (std::size_t i = 0; i < second_.size(); ++i) second_[i] -= other.second_[i];
  return *this;
}

Vector3 VoxelMoments::mean() const {
  const auto n = static_cast<double>(count_);
  return {static_cast<double>(first_[0]) / n, static_cast<double>(first_[1]) / n,
          static_cast<double>(first_[2]) / n};
}

Eigen::Matrix3d VoxelMoments::covariance() const {
  // n Σ pᵢpⱼ − Σpᵢ Σpⱼ is at most 2⁴⁰ · 2⁴⁰ · 2⁴⁰ and is rounded once, after the subtraction.
  const double scale = 1.0 / (static_cast<double>(count_) * static_cast<double>(count_ - 1));
  Eigen::Matrix3d result;
  std::size_t pair = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a; b < 3; ++b) {
      const Integer centred = count_ * second_[pair++] - Integer{first_[a]} * first_[b];
      const auto row = static_cast<Eigen::Index>(a), column = static_cast<Eigen::Index>(b);
      result(row, column) = result(column, row) = static_cast<double>(centred) * scale;
    }
  }
  return result;
}

VoxelGrid::VoxelGrid(const Lattice& lattice, double edge)
    : step_(lattice.step()), voxel_steps_(checked_voxel_steps(edge, lattice.step())) {}

VoxelKey VoxelGrid::voxel_of(const LatticePoint& p) const {
  return {floor_div(p.x, voxel_steps_), floor_div(p.y, voxel_steps_), floor_div(p.z, voxel_steps_)};
}

std::array<std::int64_t, 3> VoxelGrid::offset_of(const LatticePoint& p,
                                                 const VoxelKey& voxel) const {
  return {p.x - voxel.x * voxel_steps_, p.y - voxel.y * voxel_steps_, p.z - voxel.z * voxel_steps_};
}

void VoxelGrid::add(const LatticePoint& p) {
  const VoxelKey voxel = voxel_of(p);
  voxels_[voxel].add(offset_of(p, voxel));
}

void VoxelGrid::remove(const LatticePoint& p) {
  const VoxelKey voxel = voxel_of(p);
  const auto found = voxels_.find(voxel);
  if (found == voxels_.end()) throw_missing();
  found->second.remove(offset_of(p, voxel));
  if (found->second.count() == 0) voxels_.erase(found);
}

void VoxelGrid::add(const TileKey& tile, std::span<const TileOffset> points) {
  const LatticePoint origin = tile_origin(tile);
  VoxelKey last;
  VoxelMoments* moments = nullptr;
  for (const TileOffset& point : points) {
    const LatticePoint p{origin.x + point.x, origin.y + point.y, origin.z + point.z};
    const VoxelKey voxel = voxel_of(p);
    if (moments == nullptr || voxel != last) moments = &voxels_[voxel];
    last = voxel;
    moments->add(offset_of(p, voxel));
  }
}

void VoxelGrid::check_same_voxels(const VoxelGrid& other) const {
  if (step_ == other.step_ && voxel_steps_ == other.voxel_steps_) return;
  throw Error(ErrorCode::kInternal, "grids of different voxels cannot be put together");
}

VoxelGrid& VoxelGrid::operator+=(const VoxelGrid& other) {
  check_same_voxels(other);
  for (const auto& [voxel, moments] : other.voxels_) voxels_[voxel] += moments;
  return *this;
}

VoxelGrid& VoxelGrid::operator-=(const VoxelGrid& other) {
  check_same_voxels(other);
  for (const auto& [voxel, moments] : other.voxels_) {
    const auto found = voxels_.find(voxel);
    if (found == voxels_.end()) throw_missing();
    found->second -= moments;
    if (found->second.count() == 0) voxels_.erase(found);
  }
  return *this;
}

std::optional<NdtCell> make_ndt_cell(const VoxelKey& voxel, const VoxelMoments& moments,
                                     const Vector3& corner, double step) {
  if (moments.count() < kMinNdtPoints) return std::nullopt;
  NdtCell cell{.voxel = voxel,
               .num_points = moments.count(),
               .mean = corner + step * moments.mean(),
               .covariance = step * step * moments.covariance()};
  const auto inverse = floored_inverse(cell.covariance);
  if (!inverse) return std::nullopt;
  cell.inverse_covariance = *inverse;
  return cell;
}

NdtCells::NdtCells(const VoxelGrid& grid, const LatticePoint& origin)
    : origin_(origin), origin_voxel_(grid.voxel_of(origin)), voxel_edge_(grid.voxel_edge()) {
  const std::int64_t steps = grid.voxel_steps();
  const auto metres = [&](std::int64_t count) { return static_cast<double>(count) * grid.step(); };
  origin_offset_ = {metres(origin.x - origin_voxel_.x * steps),
                    metres(origin.y - origin_voxel_.y * steps),
                    metres(origin.z - origin_voxel_.z * steps)};
  cells_.reserve(grid.voxels().size());
  for (const auto& [voxel, moments] : grid.voxels()) {
    const Vector3 corner(metres(voxel.x * steps - origin.x), metres(voxel.y * steps - origin.y),
                         metres(voxel.z * steps - origin.z));
    if (auto cell = make_ndt_cell(voxel, moments, corner, grid.step())) cells_.push_back(*cell);
  }
  std::ranges::sort(cells_, {}, &NdtCell::voxel);
  index_cells();
}

void NdtCells::index_cells() {
  slots_.assign(std::bit_ceil(2 * cells_.size() + 1), kFreeSlot);
  const std::size_t mask = slots_.size() - 1;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    std::size_t slot = VoxelKeyHash{}(cells_[i].voxel) & mask;
    while (slots_[slot] != kFreeSlot) slot = (slot + 1) & mask;
    slots_[slot] = static_cast<std::uint32_t>(i);
  }
}

VoxelKey NdtCells::voxel_at(const Vector3& p_local) const {
  const Vector3 voxels = (p_local + origin_offset_) / voxel_edge_;
  return {origin_voxel_.x + floor_to_integer(voxels.x()),
          origin_voxel_.y + floor_to_integer(voxels.y()),
          origin_voxel_.z + floor_to_integer(voxels.z())};
}

const NdtCell* NdtCells::find(const VoxelKey& voxel) const {
  const std::size_t mask = slots_.size() - 1;
  std::size_t slot = VoxelKeyHash{}(voxel)&mask;
  for (; slots_[slot] != kFreeSlot; slot = (slot + 1) & mask) {
    const NdtCell& cell = cells_[slots_[slot]];
    if (cell.voxel == voxel) return &cell;
  }
  return nullptr;
}

const NdtCell* NdtCells::at(const Vector3& p_local) const { return find(voxel_at(p_local)); }

std::size_t NdtCells::around(const Vector3& p_local, NdtNeighborhood neighborhood,
                             std::span<const NdtCell*, kMaxNdtNeighbors> found) const {
  const VoxelKey own = voxel_at(p_local);
  std::size_t count = 0;
  for (std::size_t i = 0; i < num_neighbors(neighborhood); ++i) {
    const auto& shift = kNeighbors[i];
    const NdtCell* const cell = find({own.x + shift[0], own.y + shift[1], own.z + shift[2]});
    if (cell != nullptr) found[count++] = cell;
  }
  return count;
}

}  // namespace gdfmap
