#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/io/ply_writer.hpp>
#include <gdfmap/pipeline/error_map.hpp>

#include "drawing/color_map.hpp"

namespace gdfmap {
namespace {

/// Errors at the ends of the colours, in cube sizes.
constexpr double kDarkest = 1e-3, kLightest = 1e-1;
constexpr drawing::Color kNotStated{0.6, 0.6, 0.6};

std::uint8_t to_byte(double channel) {
  return static_cast<std::uint8_t>(std::lround(255.0 * channel));
}

void put(const JudgedSample& sample, double cube_size, ByteWriter& writer) {
  for (int axis = 0; axis < 3; ++axis) writer.put(sample.p_world[axis]);
  drawing::Color color = kNotStated;
  float error = std::numeric_limits<float>::quiet_NaN();
  if (sample.is_stated()) {
    error = static_cast<float>(sample.answer.distance - sample.distance);
    const double share = std::max(sample.error(), 1e-30) / cube_size / kDarkest;
    color = drawing::color_at(std::log(share) / std::log(kLightest / kDarkest));
  }
  for (const double channel : {color.red, color.green, color.blue}) writer.put(to_byte(channel));
  writer.put(error);
  writer.put(static_cast<float>(sample.distance));
  writer.put(static_cast<float>(sample.weight));
  writer.put(static_cast<std::int8_t>(sample.level));
  writer.put(static_cast<std::uint8_t>(sample.answer.status));
}

}  // namespace

struct ErrorMapWriter::Impl {
  PlyWriter file;
  double cube_size;
};

ErrorMapWriter::ErrorMapWriter(const std::filesystem::path& path, double cube_size) {
  if (path.extension() != ".ply") {
    throw Error(ErrorCode::kUsage, path.string() + ": an error map is written as .ply");
  }
  impl_.reset(new Impl{
      PlyWriter(path, {.properties = {"double x", "double y", "double z", "uchar red",
                                      "uchar green", "uchar blue", "float error", "float distance",
                                      "float weight", "char level", "uchar status"},
                       .comment = "status: 0 fine, 1 coarse, 2 far, 3 unknown"}),
      cube_size});
}

ErrorMapWriter::~ErrorMapWriter() = default;

void ErrorMapWriter::add(std::span<const JudgedSample> samples) {
  ByteWriter writer;
  for (const JudgedSample& sample : samples) put(sample, impl_->cube_size, writer);
  impl_->file.write_vertices(writer.bytes(), samples.size());
}

void ErrorMapWriter::finish() { impl_->file.finish(); }

}  // namespace gdfmap
