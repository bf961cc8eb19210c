#include <algorithm>
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

void check(const SliceOptions& options, const Box3& region, const std::filesystem::path& path) {
  if (path.extension() != ".png" && path.extension() != ".npy") {
    throw Error(ErrorCode::kUsage, path.string() + ": a slice is written as .png or .npy");
  }
  if (options.arrows && path.extension() != ".png") {
    throw Error(ErrorCode::kUsage, path.string() + ": arrows are drawn in pictures (.png) alone");
  }
  if (!(options.resolution > 0.0)) {
    throw Error(ErrorCode::kUsage, "resolution must be a positive number of metres");
  }
  const auto axis = static_cast<Eigen::Index>(options.axis);
  for (const double at : options.at) {
    if (at >= region.min()[axis] && at <= region.max()[axis]) continue;
    throw Error(ErrorCode::kUsage, std::string("the plane ") +
                                       kAxisNames[static_cast<std::size_t>(axis)] + " = " +
                                       std::to_string(at) + " m misses the map, which spans " +
                                       std::to_string(region.min()[axis]) + " to " +
                                       std::to_string(region.max()[axis]) + " m");
  }
}

void append(const FieldSample& answer, const Grid& grid, bool with_gradient, SliceImage& image) {
  image.distance.push_back(static_cast<float>(answer.distance));
  image.is_bound.push_back(answer.status == FieldStatus::kFar ? 1 : 0);
  if (!with_gradient) return;
  image.gradient_u.push_back(static_cast<float>(answer.gradient[grid.u]));
  image.gradient_v.push_back(static_cast<float>(answer.gradient[grid.v]));
}

/// Asks the field row by row, so that only one row of answers is held.
SliceImage sample_plane(const DistanceField& field, const Grid& grid, const SliceOptions& options,
                        double at, const RunContext& context) {
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
      points[static_cast<std::size_t>(i)] = grid.position(i, j, at);
    }
    field.at(points, answers);
    for (const FieldSample& answer : answers) append(answer, grid, options.arrows, image);
    context.progress(
        {"rows", static_cast<std::uint64_t>(j) + 1, static_cast<std::uint64_t>(grid.height), {}});
  }
  return image;
}

std::string plane_name(const SliceOptions& options, double at, const char* between) {
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), "%s%s%g",
                kAxisNames[static_cast<std::size_t>(options.axis)], between, at);
  return text.data();
}

/// Where each plane goes. @throws Error kUsage when two would go to the same file.
std::vector<std::filesystem::path> paths_of(const SliceOptions& options,
                                            const std::filesystem::path& path) {
  if (options.at.size() == 1) return {path};
  std::vector<std::filesystem::path> paths;
  for (const double at : options.at) {
    const std::string stem = path.stem().string() + "_" + plane_name(options, at, "");
    paths.push_back(path.parent_path() / (stem + path.extension().string()));
    if (std::count(paths.begin(), paths.end(), paths.back()) > 1) {
      throw Error(ErrorCode::kUsage, paths.back().string() + " would be written twice");
    }
  }
  return paths;
}

void write(const SliceImage& image, const std::filesystem::path& path) {
  if (path.extension() == ".png") {
    draw_slice(image, path);
  } else {
    write_npy(path, image.distance,
              {static_cast<std::size_t>(image.height), static_cast<std::size_t>(image.width)});
  }
}

}  // namespace

std::vector<std::filesystem::path> write_slices(const std::shared_ptr<TileSource>& source,
                                                const SliceOptions& options,
                                                const std::filesystem::path& path,
                                                const RunContext& context) {
  const Box3 region = options.region.value_or(default_region(*source));
  check(options, region, path);
  const std::vector<std::filesystem::path> paths = paths_of(options, path);
  const Grid grid(options, region);
  const DistanceField field(source,
                            {context.memory() / 4, BlendMode::kPartition, context.threads()});
  std::vector<SliceImage> images;
  double largest = 0.0;
  for (const double at : options.at) {
    images.push_back(sample_plane(field, grid, options, at, context));
    images.back().title = "distance field at " + plane_name(options, at, " = ") + " m";
    largest = std::max(largest, largest_estimate(images.back()));
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i].largest_distance = largest;
    write(images[i], paths[i]);
  }
  return paths;
}

}  // namespace gdfmap
