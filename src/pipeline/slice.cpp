#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/field_access.hpp>
#include <gdfmap/pipeline/npy.hpp>
#include <gdfmap/pipeline/slice.hpp>
#include <gdfmap/pipeline/slice_image.hpp>

namespace gdfmap {
namespace {

constexpr std::array<const char*, 3> kAxisNames = {"x", "y", "z"};

/// What holds points, with a cube's width around it.
Box3 default_region(TileSource& source) {
  const Lattice lattice(source.geometry().cube_size);
  const Box3 box = occupied_bounds(source.occupied(), lattice);
  if (box.isEmpty()) throw Error(ErrorCode::kUsage, "nothing to draw: the map holds no cubes");
  const Vector3 around = Vector3::Constant(lattice.cube_size());
  return {box.min() - around, box.max() + around};
}

/// The regular samples of a plane.
struct Grid {
  Eigen::Index normal, u, v;  ///< axes
  Box3 region;
  double resolution;
  int width, height;

  Grid(const SliceOptions& options, const Box3& box)
      : normal(static_cast<Eigen::Index>(options.axis)),
        u(normal == 0 ? 1 : 0),
        v(normal == 2 ? 1 : 2),
        region(box),
        resolution(options.resolution),
        width(count(box.sizes()[u])),
        height(count(box.sizes()[v])) {}

  [[nodiscard]] int count(double length) const {
    const double samples = std::floor(length / resolution + 1e-9) + 1.0;
    if (!(samples <= kMaxPictureSide)) {
      throw Error(ErrorCode::kUsage, "the slice would have more than " +
                                         std::to_string(kMaxPictureSide) +
                                         " samples a side: choose a coarser --resolution or a "
                                         "--region");
    }
    return static_cast<int>(samples);
  }
  [[nodiscard]] Vector3 position(int i, int j, double at) const {
    Vector3 p;
    p[normal] = at;
    p[u] = region.min()[u] + i * resolution;
    p[v] = region.min()[v] + j * resolution;
    return p;
  }
};

void check(const SliceOptions& options, const Box3& region) {
  if (!(options.resolution > 0.0)) {
    throw Error(ErrorCode::kUsage, "resolution must be a positive number of metres");
  }
  const auto axis = static_cast<Eigen::Index>(options.axis);
  if (!(options.at >= region.min()[axis] && options.at <= region.max()[axis])) {
    throw Error(ErrorCode::kUsage,
                std::string("the plane ") + kAxisNames[static_cast<std::size_t>(axis)] + " = " +
                    std::to_string(options.at) + " m misses the map, which spans " +
                    std::to_string(region.min()[axis]) + " to " +
                    std::to_string(region.max()[axis]) + " m");
  }
}

/// Asks the field row by row, so that only one row of answers is held.
SliceImage sample_plane(const DistanceField& field, const Grid& grid, const SliceOptions& options,
                        const RunContext& context) {
  SliceImage image;
  image.width = grid.width;
  image.height = grid.height;
  image.resolution = grid.resolution;
  image.u0 = grid.region.min()[grid.u];
  image.v0 = grid.region.min()[grid.v];
  image.u_axis = kAxisNames[static_cast<std::size_t>(grid.u)];
  image.v_axis = kAxisNames[static_cast<std::size_t>(grid.v)];
  const auto width = static_cast<std::size_t>(grid.width);
  std::vector<Vector3> points(width);
  std::vector<FieldSample> answers(width);
  for (int j = 0; j < grid.height; ++j) {
    context.throw_if_stopped();
    for (int i = 0; i < grid.width; ++i) {
      points[static_cast<std::size_t>(i)] = grid.position(i, j, options.at);
    }
    field.at(points, answers);
    for (const FieldSample& answer : answers) {
      image.distance.push_back(static_cast<float>(answer.distance));
      image.is_bound.push_back(answer.status == FieldStatus::kFar ? 1 : 0);
    }
    context.progress(
        {"rows", static_cast<std::uint64_t>(j) + 1, static_cast<std::uint64_t>(grid.height), {}});
  }
  return image;
}

std::string title(const SliceOptions& options) {
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), "distance field at %s = %g m",
                kAxisNames[static_cast<std::size_t>(options.axis)], options.at);
  return text.data();
}

}  // namespace

void write_slice(const std::shared_ptr<TileSource>& source, const SliceOptions& options,
                 const std::filesystem::path& path, const RunContext& context) {
  const bool is_picture = path.extension() == ".png";
  if (!is_picture && path.extension() != ".npy") {
    throw Error(ErrorCode::kUsage, path.string() + ": a slice is written as .png or .npy");
  }
  const Box3 region = options.region.value_or(default_region(*source));
  check(options, region);
  const Grid grid(options, region);
  const DistanceField field(source,
                            {context.memory() / 4, BlendMode::kPartition, context.threads()});
  SliceImage image = sample_plane(field, grid, options, context);
  if (is_picture) {
    image.title = title(options);
    draw_slice(image, path);
  } else {
    write_npy(path, image.distance,
              {static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width)});
  }
}

}  // namespace gdfmap
