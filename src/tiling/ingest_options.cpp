#include "ingest_options.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <string>

#include <gdfmap/core/error.hpp>

namespace gdfmap {
namespace {

/// The shortest text that reads back as the same number; both zeros are "0".
std::string number_text(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value + 0.0).ptr;
  return {text.data(), end};
}

/// The upper three rows, row by row, separated by commas.
std::string matrix_text(const Eigen::Isometry3d& transform) {
  std::string text;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      text += (text.empty() ? "" : ",") + number_text(transform(row, column));
    }
  }
  return text;
}

}  // namespace

void check_options(const IngestOptions& options, const Lattice& lattice) {
  const double scale = options.transform.scale;
  if (!std::isfinite(scale) || scale <= 0.0) {
    throw Error(ErrorCode::kUsage, "scale must be a positive number, not " + number_text(scale));
  }
  if (!options.aligned_transform().T_map_source.matrix().allFinite()) {
    throw Error(ErrorCode::kUsage, "the transform has an entry that is not finite");
  }
  if (options.sensor_origin_source && !options.sensor_origin_source->allFinite()) {
    throw Error(ErrorCode::kUsage, "the sensor's origin has a coordinate that is not finite");
  }
  if (options.region && !(options.region->min().allFinite() && options.region->max().allFinite() &&
                          (options.region->sizes().array() > 0.0).all())) {
    throw Error(ErrorCode::kUsage, "the region must be finite and have its lower corner first");
  }
  if (options.voxel_size != 0.0 &&
      !(options.voxel_size >= lattice.step() && options.voxel_size <= lattice.cube_size())) {
    throw Error(ErrorCode::kUsage, "a voxel must be from " + number_text(lattice.step()) +
                                       " m to " + number_text(lattice.cube_size()) +
                                       " m long (a quantisation step to a cube of this map), not " +
                                       number_text(options.voxel_size) + " m");
  }
}

int voxel_steps(const IngestOptions& options, const Lattice& lattice) {
  return static_cast<int>(std::lround(options.voxel_size / lattice.step()));
}

std::string Alignment::text() const {
  return "method=" + method + " T_map_nominal=" + matrix_text(T_map_nominal) +
         " inlier_ratio=" + number_text(inlier_ratio) + " rmse=" + number_text(rmse);
}

PointTransform IngestOptions::aligned_transform() const {
  if (!alignment) return transform;
  return {transform.scale, alignment->T_map_nominal * transform.T_map_source};
}

std::string IngestOptions::canonical() const {
  std::string text = "scale=" + number_text(transform.scale) +
                     " transform=" + matrix_text(transform.T_map_source) +
                     " drop_zero=" + (drop_zero ? "1" : "0");
  if (region) {
    text += " region=";
    for (const Vector3& corner : {region->min(), region->max()}) {
      for (int axis = 0; axis < 3; ++axis) {
        text += (text.back() == '=' ? "" : ",") + number_text(corner[axis]);
      }
    }
  }
  if (voxel_size != 0.0) text += " voxel=" + number_text(voxel_size);
  if (alignment) text += " align=" + alignment->method;
  return text;
}

}  // namespace gdfmap
