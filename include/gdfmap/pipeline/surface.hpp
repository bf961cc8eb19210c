#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include <gdfmap/core/geometry.hpp>
#include <gdfmap/core/run_context.hpp>
#include <gdfmap/query/tile_source.hpp>

namespace gdfmap {

/// Where a surface is taken from. Samples lie at whole multiples of the resolution from the world's
/// origin; all that is looked at are level-0 cubes in which, or next to which, points are.
struct SurfaceRange {
  double resolution = 0.02;  ///< metres between samples
  double max_mae = 0.2;      ///< metres; a cube with a greater error gives no samples
  /// World frame, metres; the upper faces are no part of it. Empty: everywhere.
  std::optional<Box3> region;
};

struct SurfacePointsOptions {
  SurfaceRange range;
  double threshold = 0.05;  ///< metres, at most a cube's edge
  /// A sample is taken where |distance| and this many standard deviations of the error that its
  /// cubes state are together less than the threshold, so that most samples lie as near to the
  /// surface as is asked for. At most kMaxErrorShare of the threshold is given up for that. 0: the
  /// distance alone decides.
  double sigmas = 1.0;
  static constexpr double kMaxErrorShare = 1.0 / 3.0;
  /// Move them onto the surface; those around which the field shows none are left out.
  bool project = false;
};

struct SurfaceMeshOptions {
  SurfaceRange range;
  /// Metres, at most a cube's edge, at least 0.87 resolutions: the mesh is drawn around what is
  /// nearer. Where the field, rounded off, states more than that at the surface, the mesh has a
  /// hole; with cubes of 1 m that is seen at 0.05.
  double threshold = 0.08;
  bool shell = false;  ///< leave it there, instead of moving it onto the surface
};

/// What a surface was made of.
struct SurfaceReport {
  std::uint64_t num_cubes = 0;       ///< that were sampled
  std::uint64_t num_cubes_poor = 0;  ///< passed over because of max_mae
  std::uint64_t num_samples = 0;     ///< of the field
  std::uint64_t num_vertices = 0;    ///< written
  std::uint64_t num_left_out = 0;    ///< not written, as no surface was found when projecting
  std::uint64_t num_triangles = 0;   ///< written
  /// Tiles that could not be read: the surface has gaps there.
  std::uint64_t num_unreadable_tiles = 0;
  std::string first_error;  ///< of those, a message
};

/// Streams the samples within `threshold` of the surface to a binary little-endian PLY file, which
/// appears complete or not at all, in Morton order of their cubes. Properties: x, y, z (double,
/// metres), distance (float, metres, of the field there); projected ones also nx, ny, nz (float,
/// unit vector away from the surface on the sample's side) and expected_error (float, metres, NaN
/// where unknown). The field is that of level 0, blended as everywhere and normalised where cubes
/// are missing. The same bytes for any number of threads, any memory and instruction set. Holds the
/// list of occupied tiles and `memory_bytes` of tiles and results.
/// @throws Error kUsage for an option out of range, a name that does not end in .ply, or a region
///         that holds nothing of the map; kIo; kInterrupted. An unreadable tile is counted.
SurfaceReport write_surface_points(const std::shared_ptr<TileSource>& source,
                                   const SurfacePointsOptions& options,
                                   const std::filesystem::path& path,
                                   const RunContext& context = {});

/// Streams a triangle mesh of the surface to a .ply (binary little-endian; x, y, z double, nx, ny,
/// nz and expected_error float) or .obj file (with normals), which appears complete or not at all.
///
/// The field is unsigned and has no zero crossing, so that the mesh is what bounds the places whose
/// distance is below the threshold: a shell around every wall, with triangles on both of its sides,
/// facing away from it. Its vertices are then moved onto the surface as projected points are, so
/// that both sides lie on each other; with `shell` they stay. Each edge is that of exactly two
/// triangles, whatever tiles and blocks it passes, and no vertex is there twice; where the region
/// or the map ends, the mesh is closed. Field, order, bytes, memory and errors are those of
/// write_surface_points(); beside that, the indices of vertices on the faces of blocks are held
/// until all blocks around them are done.
SurfaceReport write_surface_mesh(const std::shared_ptr<TileSource>& source,
                                 const SurfaceMeshOptions& options,
                                 const std::filesystem::path& path, const RunContext& context = {});

}  // namespace gdfmap
