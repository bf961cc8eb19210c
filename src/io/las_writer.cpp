#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>

#include "formats.hpp"
#include "las_layout.hpp"

namespace gdfmap::io {
namespace {

constexpr std::uint8_t kFormat = 6;
constexpr std::size_t kRecordBytes = 30;
constexpr std::uint16_t kWktFlag = 1 << 4;        ///< must be set for formats 6 to 10
constexpr std::uint8_t kFirstOfOneReturn = 0x11;  ///< return number 1 of 1
constexpr double kMaxSteps = 2147483647.0;

using Steps = std::array<std::int32_t, 3>;
using Header = std::array<std::byte, las::kHeaderBytesV14>;

/// Sets a field of the header; returns the offset behind it.
template <typename T>
std::size_t put(Header& header, std::size_t at, T value) {
  store(header.data() + at, value);
  return at + sizeof(T);
}

void put_text(Header& header, std::size_t at, std::string_view text) {
  std::transform(text.begin(), text.end(), header.data() + at,
                 [](char c) { return static_cast<std::byte>(c); });
}

/// LAS 1.4, point data record format 6: position, one return, everything else zero.
class LasWriter final : public PointWriter {
 public:
  LasWriter(const std::filesystem::path& path, const WriterOptions& options)
      : name_(path.string()),
        scale_(options.las_scale),
        offset_(options.las_offset),
        file_(path),
        buffer_(kWriterBlockPoints * kRecordBytes) {
    file_.write(header());
  }

  /// @throws Error kUsage for a point that scale and offset cannot express.
  void write(std::span<const Vector3> points) override {
    while (!points.empty()) {
      const auto block = points.first(std::min(points.size(), kWriterBlockPoints));
      for (std::size_t i = 0; i < block.size(); ++i) {
        encode(block[i], buffer_.data() + i * kRecordBytes);
      }
      file_.write(std::span(buffer_).first(block.size() * kRecordBytes));
      points = points.subspan(block.size());
    }
  }

  void finish() override {
    file_.write_at(0, header());
    file_.commit();
  }

 private:
  /// `record` is zero where nothing is written.
  void encode(const Vector3& p, std::byte* record) {
    const Steps steps = quantize(p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      min_[axis] = count_ == 0 ? steps[axis] : std::min(min_[axis], steps[axis]);
      max_[axis] = count_ == 0 ? steps[axis] : std::max(max_[axis], steps[axis]);
      store(record + axis * sizeof(std::int32_t), steps[axis]);
    }
    store(record + las::kReturnsAt, kFirstOfOneReturn);
    ++count_;
  }

  Steps quantize(const Vector3& p) const {
    const Vector3 steps = ((p - offset_) / scale_).array().round();
    // The negated comparison also refuses NaN.
    if (!(steps.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxSteps)) {
      throw Error(ErrorCode::kUsage, name_ + ": point " + std::to_string(count_ + 1) + " (" +
                                         std::to_string(p.x()) + ", " + std::to_string(p.y()) +
                                         ", " + std::to_string(p.z()) +
                                         ") cannot be written as LAS with scale " +
                                         std::to_string(scale_) + " and the given offset");
    }
    return {static_cast<std::int32_t>(steps.x()), static_cast<std::int32_t>(steps.y()),
            static_cast<std::int32_t>(steps.z())};
  }

  /// The public header block, with the counts and bounds so far. No date: the same points give the
  /// same bytes.
  Header header() const {
    Header h{};
    put_text(h, 0, "LASF");
    put(h, las::kGlobalEncodingAt, kWktFlag);
    put(h, las::kVersionMajorAt, std::uint8_t{1});
    put(h, las::kVersionMinorAt, std::uint8_t{4});
    put_text(h, las::kSystemAt, "gdfmap");
    put_text(h, las::kSoftwareAt, "gdfmap");
    put(h, las::kHeaderBytesAt, std::uint16_t{las::kHeaderBytesV14});
    put(h, las::kPointsOffsetAt, std::uint32_t{las::kHeaderBytesV14});
    put(h, las::kFormatAt, kFormat);
    put(h, las::kRecordBytesAt, std::uint16_t{kRecordBytes});
    std::size_t scale_at = las::kScaleAt, offset_at = las::kOffsetAt, bounds_at = las::kBoundsAt;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      scale_at = put(h, scale_at, scale_);
      offset_at = put(h, offset_at, offset_[static_cast<Eigen::Index>(axis)]);
      bounds_at = put(h, bounds_at, coordinate(max_, axis));
      bounds_at = put(h, bounds_at, coordinate(min_, axis));
    }
    put(h, las::kCountAt, count_);
    put(h, las::kCountByReturnAt, count_);  // all are first returns
    return h;
  }

  double coordinate(const Steps& steps, std::size_t axis) const {
    return count_ == 0 ? 0.0 : steps[axis] * scale_ + offset_[static_cast<Eigen::Index>(axis)];
  }

  std::string name_;
  double scale_;
  Vector3 offset_;
  AtomicFile file_;
  Bytes buffer_;
  Steps min_{}, max_{};
  std::uint64_t count_ = 0;
};

}  // namespace

std::unique_ptr<PointWriter> create_las(const std::filesystem::path& path,
                                        const WriterOptions& options) {
  if (!std::isfinite(options.las_scale) || options.las_scale <= 0.0 ||
      !options.las_offset.allFinite()) {
    throw Error(
        ErrorCode::kUsage,
        "the LAS scale must be a positive number and the offset finite, to write " + path.string());
  }
  return std::make_unique<LasWriter>(path, options);
}

}  // namespace gdfmap::io
