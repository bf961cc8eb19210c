#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <tuple>
#include <type_traits>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/instruction_set.hpp>
#include <gdfmap/map/map.hpp>
#include <gdfmap/query/tile_cache.hpp>
#include <gdfmap/query/tile_source.hpp>

namespace gdfmap {

/// What an answer rests on.
enum class FieldStatus {
  kFine,    ///< cubes of level 0 alone
  kCoarse,  ///< a coarser level contributes
  kFar,  ///< the distance to the nearest occupied cube contributes: a lower bound where it is alone
  kUnknown,  ///< nothing is known: all that is measured is NaN
  kPending   ///< of try_at() alone: a tile is on its way, all that is measured is NaN
};

/// How cubes that share a point are combined.
enum class BlendMode {
  kPartition,  ///< separable partition of unity over all levels; C¹ wherever the answer is not kFar
  kGdf1  ///< as G-EDF's evaluator does it: level 0 alone, gradient without the weights' derivative
};

/// The arithmetic of kPartition's answers; kGdf1 has double precision alone.
enum class Precision {
  /// Vector instructions of the machine, chosen at run time: distances within 1e-5 of the coarsest
  /// contributing cube's edge of kDouble's, the same for one point and for many.
  kFloat,
  kDouble  ///< the reference, many times slower
};

/// An answer of the field: `auto [distance, gradient, status, expected_error] = field.at(p);` binds
/// its first four members.
struct FieldSample {
  double distance = 0.0;               ///< to the nearest point, metres
  Vector3 gradient = Vector3::Zero();  ///< of the distance, world frame, no unit
  FieldStatus status = FieldStatus::kUnknown;
  /// Mean absolute error of the contributing cubes at their held-out samples, weighted as they
  /// contribute, metres. NaN where no cube contributes or one's error is not known.
  double expected_error = 0.0;
  /// Largest error of the contributing cubes at their held-out samples, weighted as they
  /// contribute, metres; the far bound contributes no error. NaN where one is not known.
  double error_bound = 0.0;

  /// For collision checks: distance − kSafetyFactor · error_bound, never negative. It is below the
  /// true distance wherever the cubes' errors stay within kSafetyFactor times those recorded: the
  /// blended error is then at most the blended bound, and the far bound has none. That is measured,
  /// not proven (BENCHMARK.md). NaN where nothing is known; `conservative_distance() > radius` is
  /// false then, as it should be.
  [[nodiscard]] double conservative_distance() const {
    const double d = distance - kSafetyFactor * error_bound;
    return d < 0.0 ? 0.0 : d;
  }
  /// Held-out samples stand 1/6 of an edge apart inside the cube: between them, and in the cube's
  /// margin, errors may be larger than at any of them.
  static constexpr double kSafetyFactor = 2.0;
};

struct DistanceFieldOptions {
  std::size_t cache_bytes = std::size_t{256} << 20;  ///< of decoded tiles
  BlendMode blend = BlendMode::kPartition;
  int num_threads = 0;  ///< of a batch; 0: one per core
  Precision precision = Precision::kFloat;
  /// For kFloat; must be supported.
  InstructionSet instruction_set = best_instruction_set();
};

/// The distance field of a map, continuous over all of space. Answers depend on the tiles alone,
/// not on the cache, the threads or the order of the queries. Thread-safe; movable.
///
/// With kPartition an answer is kUnknown where a coordinate is not finite or beyond the lattice,
/// where nothing is trained at all, where the point's own level-0 tile holds points and has no
/// cubes yet, where a tile that is needed cannot be read (counted in the statistics), and where a
/// far bound is needed and no cube is occupied. With kGdf1 it is kUnknown wherever no cube
/// contributes, else kFine.
///
/// Beside cache_bytes, running queries hold at most 24 tiles for each level and thread.
class DistanceField {
 public:
  /// @throws Error kUsage for a geometry that cannot be used; kIo or kCorrupt when the source's
  /// list
  ///         of occupied tiles cannot be read.
  explicit DistanceField(std::shared_ptr<TileSource> source,
                         const DistanceFieldOptions& options = {});
  /// Of a map as it stands; reads its cubes.db through connections of its own.
  explicit DistanceField(const Map& map, const DistanceFieldOptions& options = {});
  ~DistanceField();
  DistanceField(DistanceField&&) noexcept;
  DistanceField& operator=(DistanceField&&) noexcept;

  [[nodiscard]] const Geometry& geometry() const;

  /// Never throws for what a map holds.
  [[nodiscard]] FieldSample at(const Vector3& p_world) const;
  /// The same for many points, in parallel and ordered by cube. samples[i] answers points_world[i].
  /// Takes 32 MiB at most, however many they are. @throws Error kUsage when the spans differ in
  /// length.
  void at(std::span<const Vector3> points_world, std::span<FieldSample> samples) const;
  /// The distances alone, which takes less time; not-a-number where nothing is known.
  void distances(std::span<const Vector3> points_world, std::span<double> distances) const;

  /// Of each the conservative_distance(), which is no less quick than distances().
  void conservative_distances(std::span<const Vector3> points_world,
                              std::span<double> distances) const;

  /// As at(), from the tiles in memory alone: an answer that wants another one is kPending, and the
  /// tile is loaded by a thread of the field, so that asking again later will do. For control loops
  /// that cannot wait for a disk.
  void try_at(std::span<const Vector3> points_world, std::span<FieldSample> samples) const;
  /// Loads, on that thread and in this order, the tiles that answer these points, while the caller
  /// goes on: for where a robot is going to be. More than the cache holds push each other out.
  void prefetch(std::span<const Vector3> points_world) const;

  /// Drops the tiles that changed in the map since they were loaded and reads the list of occupied
  /// cubes again; returns the number of tiles dropped. Queries that begin afterwards answer from
  /// the map as it was when this was called, or newer. May run beside queries.
  /// @throws Error kIo or kCorrupt when the source cannot be read; nothing has changed then but
  ///         tiles that were dropped
  std::size_t refresh();

  [[nodiscard]] TileCacheStatistics statistics() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gdfmap

/// Makes `auto [distance, gradient, status, expected_error] = sample` independent of the members
/// that come behind those.
template <>
struct std::tuple_size<gdfmap::FieldSample> : std::integral_constant<std::size_t, 4> {};
template <std::size_t I>
struct std::tuple_element<I, gdfmap::FieldSample> {
  using type =
      std::tuple_element_t<I, std::tuple<double, gdfmap::Vector3, gdfmap::FieldStatus, double>>;
};

namespace gdfmap {

/// A copy of the member at this place.
template <std::size_t I>
[[nodiscard]] constexpr std::tuple_element_t<I, FieldSample> get(const FieldSample& sample) {
  if constexpr (I == 0) return sample.distance;
  if constexpr (I == 1) return sample.gradient;
  if constexpr (I == 2) return sample.status;
  if constexpr (I == 3) return sample.expected_error;
}

}  // namespace gdfmap
