#include "pcd_compressed_reader.hpp"

#include <algorithm>
#include <utility>

namespace gdfmap::io {
namespace {

constexpr std::size_t kInputBytes = std::size_t{64} << 10;        ///< read at a time by a cursor
constexpr std::size_t kBlockColumnBytes = std::size_t{64} << 10;  ///< of one column, at a time

std::uint64_t point_bytes(const PcdHeader& header, bool with_padding) {
  std::uint64_t bytes = 0;
  for (const PcdField& field : header.fields) {
    if (with_padding || !field.is_padding()) bytes += field.bytes();
  }
  return bytes;
}

}  // namespace

PcdCompressedReader::PcdCompressedReader(std::unique_ptr<InputFile> file, CloudInfo info,
                                         const PcdHeader& header,
                                         const std::array<std::size_t, 3>& axes)
    : FileReader(std::move(file), std::move(info), "point") {
  if (!this->file().is_regular()) {
    this->file().fail(
        "a PCD with DATA binary_compressed cannot be read from a stream, because it has to be read "
        "twice; give its path instead, or convert it to DATA binary");
  }
  if (header.num_points == 0) return;
  read_sizes();
  locate_columns(header, axes);
}

void PcdCompressedReader::read_sizes() {
  const std::byte* const sizes = file().take(8);
  if (sizes == nullptr) file().fail("file ends before the sizes of the compressed data");
  const auto compressed_bytes = load<std::uint32_t>(sizes);
  decompressed_bytes_ = load<std::uint32_t>(sizes + 4);
  require_bytes(file(), compressed_bytes, 1, "units of compressed data");
  compressed_begin_ = file().position();
  compressed_end_ = compressed_begin_ + compressed_bytes;
}

void PcdCompressedReader::locate_columns(const PcdHeader& header,
                                         const std::array<std::size_t, 3>& axes) {
  const std::uint64_t count = header.num_points;
  const auto fits = [&](std::uint64_t bytes) {
    return decompressed_bytes_ % bytes == 0 && decompressed_bytes_ / bytes == count;
  };
  // PCL leaves padding fields out of the compressed data, other writers keep them: the size tells.
  const bool with_padding = !fits(point_bytes(header, false));
  if (with_padding && !fits(point_bytes(header, true))) {
    file().fail("the header declares " + std::to_string(count) + " points of " +
                std::to_string(point_bytes(header, false)) + " bytes, but " +
                std::to_string(decompressed_bytes_) + " bytes of decompressed data");
  }
  std::uint64_t begin = 0;
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    const PcdField& field = header.fields[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (axes[axis] == i) columns_[axis] = {begin, field.bytes(), *field.scalar_type()};
    }
    if (with_padding || !field.is_padding()) begin += count * field.bytes();
  }
}

std::size_t PcdCompressedReader::read(std::span<Vector3> points) {
  const std::uint64_t total = *info().num_points;
  if (total > 0 && !first_pass_done_) first_pass();
  std::size_t filled = 0;
  while (filled < points.size() && num_done_ < total) {
    std::size_t count = points.size() - filled;
    count = static_cast<std::size_t>(std::min<std::uint64_t>(count, total - num_done_));
    for (const CompressedColumn& column : columns_) {
      count = std::min(count, std::max<std::size_t>(1, kBlockColumnBytes / column.stride));
    }
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      decode_column(advance(cursors_[a], count * columns_[a].stride), columns_[a].stride,
                    columns_[a].type, std::endian::little, axis, points.subspan(filled, count));
    }
    filled += count;
    num_done_ += count;
  }
  return filled;
}

void PcdCompressedReader::first_pass() {
  LzfDecoder decoder;
  while (file().position() < compressed_end_) {
    remember_columns(decoder);
    const std::uint64_t left = compressed_end_ - file().position();
    auto bytes = file().peek(LzfDecoder::kMaxCommandBytes);
    bytes = bytes.first(static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), left)));
    const auto used = decoder.decode(bytes);
    if (!used || *used == 0 || decoder.num_produced() > decompressed_bytes_) fail_damaged();
    file().consume(*used);
  }
  if (decoder.num_produced() != decompressed_bytes_) fail_damaged();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    Cursor& cursor = cursors_[axis];
    const std::uint64_t ahead = columns_[axis].begin - cursor.decoder.num_produced();
    static_cast<void>(advance(cursor, static_cast<std::size_t>(ahead)));
  }
  first_pass_done_ = true;
}

/// The decoder stops only between commands, so a column is entered from the last stop before it.
void PcdCompressedReader::remember_columns(const LzfDecoder& decoder) {
  const std::uint64_t produced = decoder.num_produced();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t begin = columns_[axis].begin;
    if (produced > begin || begin - produced >= LzfDecoder::kMaxOutputBytes) continue;
    cursors_[axis].decoder = decoder;
    cursors_[axis].input_offset = file().position();
  }
}

/// The next bytes of a column, in one piece; valid until the next call for the same cursor.
const std::byte* PcdCompressedReader::advance(Cursor& cursor, std::size_t bytes) {
  while (cursor.ready.size() - cursor.ready_used < bytes) decode_more(cursor);
  cursor.ready_used += bytes;
  return cursor.ready.data() + cursor.ready_used - bytes;
}

void PcdCompressedReader::decode_more(Cursor& cursor) {
  cursor.ready.erase(cursor.ready.begin(),
                     cursor.ready.begin() + static_cast<std::ptrdiff_t>(cursor.ready_used));
  cursor.ready_used = 0;
  if (cursor.input.size() - cursor.input_used < LzfDecoder::kMaxCommandBytes) refill_input(cursor);
  const auto used = cursor.decoder.decode(std::span(cursor.input).subspan(cursor.input_used));
  if (!used || *used == 0) fail_damaged();
  cursor.input_used += *used;
  const auto output = cursor.decoder.output();
  cursor.ready.insert(cursor.ready.end(), output.begin(), output.end());
}

void PcdCompressedReader::refill_input(Cursor& cursor) {
  cursor.input.erase(cursor.input.begin(),
                     cursor.input.begin() + static_cast<std::ptrdiff_t>(cursor.input_used));
  cursor.input_used = 0;
  const std::size_t kept = cursor.input.size();
  const auto wanted = static_cast<std::size_t>(
      std::min<std::uint64_t>(kInputBytes, compressed_end_ - cursor.input_offset));
  cursor.input.resize(kept + wanted);
  const std::size_t received =
      file().read_at(cursor.input_offset, std::span(cursor.input).subspan(kept));
  cursor.input.resize(kept + received);
  cursor.input_offset += received;
}

void PcdCompressedReader::fail_damaged() const {
  file().fail("the compressed data are damaged: they do not decompress to the " +
              std::to_string(decompressed_bytes_) + " bytes that precede them as their size");
}

}  // namespace gdfmap::io
