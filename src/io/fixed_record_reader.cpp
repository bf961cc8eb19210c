#include "fixed_record_reader.hpp"

#include <algorithm>
#include <utility>

namespace gdfmap::io {
namespace {

/// Records decoded at a time: three passes over a block, one per axis, that stays in the cache.
constexpr std::size_t kBlockRecords = 2048;

}  // namespace

FixedRecordReader::FixedRecordReader(std::unique_ptr<InputFile> file, CloudInfo info,
                                     std::string record, const RecordLayout& layout)
    : FileReader(std::move(file), std::move(info), std::move(record)), layout_(layout) {
  require_bytes(this->file(), *this->info().num_points, layout_.stride, "points");
}

std::size_t FixedRecordReader::read(std::span<Vector3> points) {
  std::size_t filled = 0;
  while (filled < points.size() && num_done_ < *info().num_points) {
    const auto bytes = file().peek(layout_.stride);
    const std::size_t whole = bytes.size() / layout_.stride;
    if (whole == 0) fail_at(num_done_, "file ends");
    const auto left = static_cast<std::size_t>(
        std::min<std::uint64_t>(*info().num_points - num_done_, kBlockRecords));
    const std::size_t count = std::min({whole, left, points.size() - filled});
    for (int axis = 0; axis < 3; ++axis) {
      const ScalarField& field = layout_.xyz[static_cast<std::size_t>(axis)];
      decode_column(bytes.data() + field.offset, layout_.stride, field.type, layout_.order, axis,
                    points.subspan(filled, count));
    }
    file().consume(count * layout_.stride);
    filled += count;
    num_done_ += count;
  }
  return filled;
}

}  // namespace gdfmap::io
