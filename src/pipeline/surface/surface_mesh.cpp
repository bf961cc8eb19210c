#include <algorithm>
#include <cmath>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/morton.hpp>
#include <gdfmap/core/pool.hpp>
#include <gdfmap/pipeline/surface.hpp>

#include "block_mesher.hpp"
#include "mesh_writer.hpp"
#include "surface_field.hpp"

namespace gdfmap {
namespace {

using surface::Block;
using surface::BlockMesh;
using surface::BlockMesher;
using surface::LatticeEdge;
using surface::MeshVertex;
using surface::SampleBox;
using surface::SurfaceDomain;

/// Calls visit with a place and those before it by one along each axis, or after it.
template <typename Key, typename Visit>
void for_each_corner(const Key& key, int direction, const Visit& visit) {
  for (int corner = 0; corner < 8; ++corner) {
    const auto offset = [&](int axis) { return direction * (corner >> axis & 1); };
    visit(Key{key.level, key.x + offset(0), key.y + offset(1), key.z + offset(2)});
  }
}

/// The tiles of the domain and those below: a cell is its lower corner's.
std::vector<TileKey> tiles_with_cells(const SurfaceDomain& domain) {
  std::unordered_set<TileKey, TileKeyHash> found;
  for (const TileKey& tile : domain.tiles()) {
    for_each_corner(tile, -1, [&](const TileKey& below) { found.insert(below); });
  }
  std::vector<TileKey> tiles(found.begin(), found.end());
  std::ranges::sort(tiles, in_morton_order<TileKey>);
  return tiles;
}

/// All samples of a cube if a cell of it has a corner in the domain, else none.
SampleBox lower_corners_in(const CubeKey& cube, const SurfaceDomain& domain) {
  bool has_cells = false;
  for_each_corner(cube, 1, [&](const CubeKey& above) {
    has_cells = has_cells || domain.samples_in(above).count() > 0;
  });
  return has_cells ? domain.all_samples_in(cube) : SampleBox{};
}

/// Joins the meshes of blocks, which come in any order, at the vertices that they share. Of those
/// it remembers the ones that a block is still to come for.
class Welder {
 public:
  explicit Welder(surface::MeshWriter& file) : file_(file) {}

  void add(const BlockMesh& mesh, SurfaceReport& report) {
    vertices_.clear();
    indices_.clear();
    triangles_.clear();
    for (const MeshVertex& vertex : mesh.vertices) indices_.push_back(index_of(vertex));
    for (const auto& triangle : mesh.triangles) {
      triangles_.push_back({indices_[triangle[0]], indices_[triangle[1]], indices_[triangle[2]]});
    }
    file_.write(vertices_, triangles_);
    report.num_vertices = num_vertices_;
    report.num_triangles += triangles_.size();
  }

 private:
  struct Seam {
    std::uint64_t index;
    int num_to_come;
  };

  std::uint64_t index_of(const MeshVertex& vertex) {
    if (const auto seam = seams_.find(vertex.edge); seam != seams_.end()) {
      const std::uint64_t index = seam->second.index;
      if (--seam->second.num_to_come == 0) seams_.erase(seam);
      return index;
    }
    if (vertex.num_blocks > 1) {
      seams_.emplace(vertex.edge, Seam{num_vertices_, vertex.num_blocks - 1});
    }
    vertices_.push_back(vertex.point);
    return num_vertices_++;
  }

  surface::MeshWriter& file_;
  std::unordered_map<LatticeEdge, Seam, surface::LatticeEdgeHash> seams_;
  std::uint64_t num_vertices_ = 0;
  std::vector<std::uint64_t> indices_;
  std::vector<surface::ProjectedPoint> vertices_;
  std::vector<std::array<std::uint64_t, 3>> triangles_;
};

void check(const SurfaceMeshOptions& options, const Geometry& geometry) {
  surface::check_length("threshold", options.threshold, 0.0, geometry.cube_size);
  // Every point is within half a cell's diagonal of a sample.
  if (options.threshold < 0.5 * std::sqrt(3.0) * options.range.resolution) {
    throw Error(ErrorCode::kUsage,
                "a surface would fall between the samples: the resolution must be at most 1.15 "
                "times the threshold");
  }
}

}  // namespace

SurfaceReport write_surface_mesh(const std::shared_ptr<TileSource>& source,
                                 const SurfaceMeshOptions& options,
                                 const std::filesystem::path& path, const RunContext& context) {
  check(options, source->geometry());
  // Beyond the threshold there must be samples that are farther away.
  const double reach =
      std::min(options.threshold + 2.0 * options.range.resolution, source->geometry().cube_size);
  const surface::SurfaceField field(source, options.range, reach, context);
  const SurfaceDomain& domain = field.domain();
  const std::vector<TileKey> tiles = tiles_with_cells(domain);
  const auto file = surface::create_mesh(path);
  SurfaceReport report;
  Welder welder(*file);
  Pool<BlockMesher> meshers;
  surface::BlockQueue queue(tiles,
                            [&](const CubeKey& cube) { return lower_corners_in(cube, domain); });
  // A mesh has some two vertices for each cell that it passes, and passes the fewest of them.
  const std::size_t many_vertices = 8 * field.block_side() * field.block_side();
  surface::for_each_block(
      queue, tiles.size(), surface::blocks_at_a_time(many_vertices * sizeof(MeshVertex), context),
      [&](const Block& block) {
        const auto mesher = meshers.borrow([&] {
          return std::make_unique<BlockMesher>(field.field(), options.threshold, options.shell);
        });
        return mesher->mesh(block);
      },
      [&](const BlockMesh& mesh) {
        welder.add(mesh, report);
        report.num_samples += mesh.num_samples;
        report.num_cubes += mesh.is_cube ? 1 : 0;
        report.num_cubes_poor += mesh.is_poor_cube ? 1 : 0;
      },
      context);
  field.report_tiles(report);
  file->finish();
  return report;
}

}  // namespace gdfmap
