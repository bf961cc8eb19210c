#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/core/pool.hpp>
#include <gdfmap/io/ply_writer.hpp>
#include <gdfmap/pipeline/surface.hpp>

#include "projector.hpp"
#include "surface_field.hpp"

namespace gdfmap {
namespace {

using surface::Block;
using surface::BlockSampler;
using surface::FieldOnGrid;
using surface::ProjectedPoint;
using surface::Projector;
using surface::SampleBox;

/// √(π/2): the standard deviation of normal errors, from their mean magnitude.
constexpr double kSigmaPerMeanError = 1.2533141373155001;
constexpr std::size_t kMaxBytesOfPoint = 3 * sizeof(double) + 5 * sizeof(float);

PlyFormat format_of(bool project) {
  PlyFormat format{.properties = {"double x", "double y", "double z"}};
  if (project) {
    for (const char* name : {"float nx", "float ny", "float nz"})
      format.properties.emplace_back(name);
  }
  format.properties.emplace_back("float distance");
  if (project) format.properties.emplace_back("float expected_error");
  return format;
}

/// What one block gives.
struct BlockPoints {
  Bytes records;
  std::uint64_t num_points = 0, num_left_out = 0, num_samples = 0;
  bool is_cube = false, is_poor_cube = false;  ///< of the first block of a cube alone
};

/// Finds the points of blocks. Not thread-safe.
class PointFinder {
 public:
  PointFinder(const FieldOnGrid& field, const SurfacePointsOptions& options)
      : grid_(field.domain.grid()),
        options_(options),
        sampler_(field, BlockSampler::Wanted::kValuesAndErrors),
        projector_(field) {}

  [[nodiscard]] BlockPoints find(const Block& block) {
    BlockPoints result;
    result.num_samples = sampler_.sample(block.box);
    result.is_cube = block.is_first_of_cube && result.num_samples > 0;
    result.is_poor_cube = block.is_first_of_cube && !sampler_.poor_cubes().empty();
    if (result.num_samples == 0) return result;
    ByteWriter writer;
    points_.clear();
    for (std::size_t z = 0; z < block.box.size(2); ++z) {
      for (std::size_t y = 0; y < block.box.size(1); ++y) add_row(y, z, writer, result);
    }
    flush(writer, result);
    result.records = writer.take();
    return result;
  }

 private:
  void add_row(std::size_t y, std::size_t z, ByteWriter& writer, BlockPoints& result) {
    const SampleBox& box = sampler_.box();
    const float* const values = sampler_.row(y, z);
    const float* const errors = sampler_.errors(y, z);
    const auto threshold = static_cast<float>(options_.threshold);
    const auto sigmas = static_cast<float>(options_.sigmas * kSigmaPerMeanError);
    const auto most = static_cast<float>(SurfacePointsOptions::kMaxErrorShare * options_.threshold);
    const auto position = [&](std::size_t axis, std::size_t i) {
      return grid_.position(box.begin[axis] + static_cast<std::int64_t>(i));
    };
    for (std::size_t x = 0; x < box.size(0); ++x) {
      if (!(std::abs(values[x]) + std::min(sigmas * errors[x], most) < threshold)) continue;
      const Vector3 p(position(0, x), position(1, y), position(2, z));
      if (options_.project) {
        points_.push_back(p);
        if (points_.size() == Projector::kBatch) flush(writer, result);
      } else {
        for (int axis = 0; axis < 3; ++axis) writer.put(p[axis]);
        writer.put(values[x]);
        ++result.num_points;
      }
    }
  }

  /// Projects and writes the points that wait for it.
  void flush(ByteWriter& writer, BlockPoints& result) {
    if (points_.empty()) return;
    for (const ProjectedPoint& point : projector_.project(points_)) {
      if (!point.is_on_surface) {
        ++result.num_left_out;
        continue;
      }
      for (int axis = 0; axis < 3; ++axis) writer.put(point.position[axis]);
      for (int axis = 0; axis < 3; ++axis) writer.put(static_cast<float>(point.normal[axis]));
      writer.put(static_cast<float>(point.distance));
      writer.put(static_cast<float>(point.expected_error));
      ++result.num_points;
    }
    points_.clear();
  }

  const surface::SampleGrid& grid_;
  const SurfacePointsOptions& options_;
  BlockSampler sampler_;
  Projector projector_;
  std::vector<Vector3> points_;
};

}  // namespace

SurfaceReport write_surface_points(const std::shared_ptr<TileSource>& source,
                                   const SurfacePointsOptions& options,
                                   const std::filesystem::path& path, const RunContext& context) {
  if (path.extension() != ".ply") {
    throw Error(ErrorCode::kUsage, path.string() + ": points of a surface are written as .ply");
  }
  if (!(options.sigmas >= 0.0 && std::isfinite(options.sigmas))) {
    throw Error(ErrorCode::kUsage, "sigmas must be a number from 0");
  }
  surface::check_length("threshold", options.threshold, 0.0, source->geometry().cube_size);
  const surface::SurfaceField field(source, options.range, options.threshold, context);
  const surface::SurfaceDomain& domain = field.domain();
  PlyWriter file(path, format_of(options.project));
  SurfaceReport report;
  Pool<PointFinder> finders;
  surface::BlockQueue queue(domain.tiles(),
                            [&](const CubeKey& cube) { return domain.samples_in(cube); });
  const std::size_t side = field.block_side();
  surface::for_each_block(
      queue, domain.tiles().size(),
      surface::blocks_at_a_time(side * side * side * kMaxBytesOfPoint, context),
      [&](const Block& block) {
        const auto finder =
            finders.borrow([&] { return std::make_unique<PointFinder>(field.field(), options); });
        return finder->find(block);
      },
      [&](const BlockPoints& points) {
        file.write_vertices(points.records, points.num_points);
        report.num_vertices += points.num_points;
        report.num_left_out += points.num_left_out;
        report.num_samples += points.num_samples;
        report.num_cubes += points.is_cube ? 1 : 0;
        report.num_cubes_poor += points.is_poor_cube ? 1 : 0;
      },
      context);
  field.report_tiles(report);
  file.finish();
  return report;
}

}  // namespace gdfmap
