#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <gdfmap/core/bytes.hpp>

#include "file_reader.hpp"
#include "formats.hpp"
#include "las_layout.hpp"

namespace gdfmap::io {
namespace {

constexpr std::uint8_t kCompressionBits = 0xc0;  ///< of the format byte, set by LAZ
/// Least record length of each point format.
constexpr std::array<std::size_t, 11> kFormatBytes = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

struct LasHeader {
  int version_minor = 0;
  int format = 0;
  std::uint64_t num_points = 0;
  std::uint64_t points_offset = 0;
  std::size_t record_bytes = 0;
  Vector3 scale, offset;
};

[[noreturn]] void refuse_laz(const InputFile& file) {
  file.fail(
      "compressed LAS (LAZ) is not read; decompress it first, for instance with `laszip -i IN.laz "
      "-o OUT.las` or `pdal translate IN.laz OUT.las`, or pipe it: `laszip -i IN.laz -olas -stdout "
      "| gdfmap ... -`");
}

Vector3 load_vector(const std::byte* from) {
  return {load<double>(from), load<double>(from + 8), load<double>(from + 16)};
}

std::uint64_t load_count(const std::byte* header, bool is_v14) {
  const std::uint64_t legacy = load<std::uint32_t>(header + las::kLegacyCountAt);
  if (!is_v14) return legacy;
  // Some writers of 1.4 fill in the old field alone.
  const auto count = load<std::uint64_t>(header + las::kCountAt);
  return count != 0 ? count : legacy;
}

void check_header(const InputFile& file, const LasHeader& header, std::size_t header_bytes) {
  const auto format = static_cast<std::size_t>(header.format);
  if (format >= kFormatBytes.size()) {
    file.fail("LAS point format " + std::to_string(header.format) + " is not one of 0 to 10");
  }
  if (header.record_bytes < kFormatBytes[format]) {
    file.fail("LAS records of " + std::to_string(header.record_bytes) +
              " bytes are too short for point format " + std::to_string(header.format));
  }
  if (header.points_offset < header_bytes) {
    file.fail("LAS points begin at byte " + std::to_string(header.points_offset) +
              ", inside the header of " + std::to_string(header_bytes) + " bytes");
  }
  if (!header.scale.allFinite() || !header.offset.allFinite() ||
      (header.scale.array() == 0.0).any()) {
    file.fail("the LAS header's scale or offset is not a usable number");
  }
}

LasHeader read_header(InputFile& file) {
  const auto bytes = file.peek(las::kHeaderBytesV14);
  if (bytes.size() < las::kHeaderBytes) file.fail("file ends inside the LAS header");
  const std::byte* const raw = bytes.data();
  const auto format = load<std::uint8_t>(raw + las::kFormatAt);
  if ((format & kCompressionBits) != 0) refuse_laz(file);

  LasHeader header;
  header.version_minor = load<std::uint8_t>(raw + las::kVersionMinorAt);
  const int version_major = load<std::uint8_t>(raw + las::kVersionMajorAt);
  if (version_major != 1 || header.version_minor > 4) {
    file.fail("LAS version " + std::to_string(version_major) + "." +
              std::to_string(header.version_minor) + " is not one of 1.0 to 1.4");
  }
  const bool is_v14 = header.version_minor == 4;
  const std::size_t header_bytes = load<std::uint16_t>(raw + las::kHeaderBytesAt);
  const std::size_t needed = is_v14 ? las::kHeaderBytesV14 : las::kHeaderBytes;
  if (header_bytes < needed || bytes.size() < needed) {
    file.fail("a LAS header of " + std::to_string(std::min(header_bytes, bytes.size())) +
              " bytes is too short for version 1." + std::to_string(header.version_minor));
  }
  header.format = format;
  header.num_points = load_count(raw, is_v14);
  header.points_offset = load<std::uint32_t>(raw + las::kPointsOffsetAt);
  header.record_bytes = load<std::uint16_t>(raw + las::kRecordBytesAt);
  header.scale = load_vector(raw + las::kScaleAt);
  header.offset = load_vector(raw + las::kOffsetAt);
  check_header(file, header, header_bytes);
  return header;
}

class LasReader final : public FileReader {
 public:
  LasReader(std::unique_ptr<InputFile> file, CloudInfo info, const LasHeader& header)
      : FileReader(std::move(file), std::move(info), "point"),
        header_(header),
        withheld_bit_(header.format < las::kFirstExtendedFormat ? las::kWithheld
                                                                : las::kWithheldExtended) {
    require_bytes(this->file(), header_.num_points, header_.record_bytes, "points");
  }

  [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
    std::size_t filled = 0;
    while (filled < points.size() && num_done_ < header_.num_points) {
      const auto bytes = file().peek(header_.record_bytes);
      const std::size_t whole = bytes.size() / header_.record_bytes;
      if (whole == 0) fail_at(num_done_, "file ends");
      const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(
          std::min(whole, points.size() - filled), header_.num_points - num_done_));
      const std::size_t kept = decode(bytes.data(), points.subspan(filled, count));
      file().consume(count * header_.record_bytes);
      num_withheld_ += count - kept;
      num_done_ += count;
      filled += kept;
    }
    return filled;
  }

  [[nodiscard]] std::uint64_t num_withheld() const override { return num_withheld_; }

 private:
  /// Decodes points.size() records; returns how many are not withheld, at the front of `points`.
  std::size_t decode(const std::byte* record, std::span<Vector3> points) const {
    const Vector3 scale = header_.scale, offset = header_.offset;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points.size(); ++i, record += header_.record_bytes) {
      const Vector3 steps(load<std::int32_t>(record), load<std::int32_t>(record + 4),
                          load<std::int32_t>(record + 8));
      points[kept] = steps.cwiseProduct(scale) + offset;
      const bool withheld = (load<std::uint8_t>(record + las::kFlagsAt) & withheld_bit_) != 0;
      kept += withheld ? 0 : 1;
    }
    return kept;
  }

  LasHeader header_;
  std::uint8_t withheld_bit_;
  std::uint64_t num_done_ = 0;
  std::uint64_t num_withheld_ = 0;
};

}  // namespace

std::unique_ptr<PointReader> open_las(std::unique_ptr<InputFile> file) {
  const LasHeader header = read_header(*file);
  if (!file->skip(header.points_offset)) {
    file->fail("LAS points begin at byte " + std::to_string(header.points_offset) +
               ", behind the end of the file");
  }
  CloudInfo info{
      "LAS 1." + std::to_string(header.version_minor) + " format " + std::to_string(header.format),
      header.num_points};
  return std::make_unique<LasReader>(std::move(file), std::move(info), header);
}

}  // namespace gdfmap::io
