#include "ascii_record_reader.hpp"

#include <algorithm>
#include <utility>

#include "text.hpp"

namespace gdfmap::io {

AsciiRecordReader::AsciiRecordReader(std::unique_ptr<InputFile> file, CloudInfo info,
                                     std::string record, std::vector<AsciiColumn> columns)
    : FileReader(std::move(file), std::move(info), std::move(record)),
      columns_(std::move(columns)) {
  // A character and a separator a word; the last line may lack its end, hence one byte less.
  require_bytes(this->file(), *this->info().num_points, 2 * columns_.size() - 1, "points");
}

std::size_t AsciiRecordReader::read(std::span<Vector3> points) {
  std::size_t filled = 0;
  while (filled < points.size() && num_done_ < *info().num_points) {
    const auto line = next_line(file());
    if (!line) fail_at(num_done_, "file ends");
    if (std::all_of(line->begin(), line->end(), is_space)) continue;
    points[filled++] = parse(*line);
    ++num_done_;
  }
  return filled;
}

Vector3 AsciiRecordReader::parse(std::string_view line) const {
  Vector3 point = Vector3::Zero();
  for (const AsciiColumn& column : columns_) {
    const std::string_view text = word(line);
    if (column.is_list) {
      skip_list(text, line);
    } else if (column.axis >= 0) {
      const auto value = parse_number(text);
      if (!value) fail_at(num_done_, in_quotes(text) + " is not a number");
      point[column.axis] = *value;
    }
  }
  return point;
}

std::string_view AsciiRecordReader::word(std::string_view& rest) const {
  const std::string_view text = next_word(rest);
  if (text.empty()) fail_at(num_done_, "line ends before the last value");
  return text;
}

void AsciiRecordReader::skip_list(std::string_view count, std::string_view& rest) const {
  const auto length = parse_count(count);
  if (!length) fail_at(num_done_, in_quotes(count) + " is not the length of a list");
  for (std::uint64_t i = 0; i < *length; ++i) static_cast<void>(word(rest));
}

}  // namespace gdfmap::io
