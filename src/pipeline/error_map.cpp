#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/error_map.hpp>

#include "drawing/color_map.hpp"

namespace gdfmap {
namespace {

/// Errors at the ends of the colours, in cube sizes.
constexpr double kDarkest = 1e-3, kLightest = 1e-1;
constexpr drawing::Color kNotStated{0.6, 0.6, 0.6};
/// Room for any count; leading zeros are understood by every reader.
constexpr std::size_t kCountDigits = 20;

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
  AtomicFile file;
  double cube_size;
  std::uint64_t count_offset = 0;
  std::uint64_t count = 0;
};

ErrorMapWriter::ErrorMapWriter(const std::filesystem::path& path, double cube_size) {
  if (path.extension() != ".ply") {
    throw Error(ErrorCode::kUsage, path.string() + ": an error map is written as .ply");
  }
  impl_.reset(new Impl{AtomicFile(path), cube_size});
  const std::string start =
      "ply\nformat binary_little_endian 1.0\n"
      "comment status: 0 fine, 1 coarse, 2 far, 3 unknown\nelement vertex ";
  impl_->count_offset = start.size();
  impl_->file.write(
      std::string_view(start + std::string(kCountDigits, '0') +
                       "\nproperty double x\nproperty double y\nproperty double z\n"
                       "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                       "property float error\nproperty float distance\nproperty float weight\n"
                       "property char level\nproperty uchar status\nend_header\n"));
}

ErrorMapWriter::~ErrorMapWriter() = default;

void ErrorMapWriter::add(std::span<const JudgedSample> samples) {
  ByteWriter writer;
  for (const JudgedSample& sample : samples) put(sample, impl_->cube_size, writer);
  impl_->file.write(writer.bytes());
  impl_->count += samples.size();
}

void ErrorMapWriter::finish() {
  std::string digits = std::to_string(impl_->count);
  digits.insert(0, kCountDigits - digits.size(), '0');
  impl_->file.write_at(impl_->count_offset, std::as_bytes(std::span(digits)));
  impl_->file.commit();
}

}  // namespace gdfmap
