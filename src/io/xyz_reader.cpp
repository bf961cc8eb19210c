#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "file_reader.hpp"
#include "formats.hpp"
#include "text.hpp"

namespace gdfmap::io {
namespace {

/// The columns of x, y and z, counted from 0.
using Columns = std::array<std::size_t, 3>;

constexpr bool is_blank(char c) { return c == ' ' || c == '\t'; }

void skip_blanks(std::string_view& rest) {
  while (!rest.empty() && is_blank(rest.front())) rest.remove_prefix(1);
}

/// Takes the first cell off `rest`. Blanks separate, and so does one `separator` with or without
/// blanks around it; two of them enclose an empty cell.
std::string_view next_cell(std::string_view& rest, char separator) {
  skip_blanks(rest);
  std::size_t end = 0;
  while (end < rest.size() && !is_blank(rest[end]) && rest[end] != separator) ++end;
  const std::string_view cell = rest.substr(0, end);
  rest.remove_prefix(end);
  skip_blanks(rest);
  if (!rest.empty() && rest.front() == separator) rest.remove_prefix(1);
  return cell;
}

/// Semicolons win: beside them a comma would be a decimal mark, which must not pass for a
/// separator.
char find_separator(std::string_view line) {
  return line.find(';') != std::string_view::npos ? ';' : ',';
}

std::vector<std::string_view> split(std::string_view line) {
  std::vector<std::string_view> cells;
  const char separator = find_separator(line);
  for (skip_blanks(line); !line.empty();) cells.push_back(next_cell(line, separator));
  return cells;
}

std::string_view without_quotes(std::string_view cell) {
  const bool quoted_cell = cell.size() >= 2 && cell.front() == '"' && cell.back() == '"';
  return quoted_cell ? cell.substr(1, cell.size() - 2) : cell;
}

/// Where a header line names x, y and z; empty unless it names all three.
std::optional<Columns> find_columns(const std::vector<std::string_view>& names) {
  Columns columns{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto found = std::find_if(names.begin(), names.end(), [&](std::string_view name) {
      return equal_ignoring_case(without_quotes(name), std::string_view("xyz").substr(axis, 1));
    });
    if (found == names.end()) return std::nullopt;
    columns[axis] = static_cast<std::size_t>(found - names.begin());
  }
  return columns;
}

/// The text behind the mark of a comment; empty for a line that is none.
std::optional<std::string_view> comment_text(std::string_view line) {
  if (!line.starts_with('#') && !line.starts_with("//")) return std::nullopt;
  line.remove_prefix(std::min(line.find_first_not_of("#/"), line.size()));
  return line;
}

class XyzReader final : public FileReader {
 public:
  explicit XyzReader(std::unique_ptr<InputFile> input)
      : FileReader(std::move(input), {"XYZ", std::nullopt}, "point") {
    require_text();
    read_header();
  }

  [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
    std::size_t filled = 0;
    if (first_point_ && !points.empty()) {
      points[filled++] = *first_point_;
      first_point_.reset();
    }
    while (filled < points.size()) {
      const auto line = next_row();
      if (!line) break;
      points[filled++] = parse_row(*line);
    }
    return filled;
  }

 private:
  void require_text() {
    constexpr std::size_t kChecked = 4096;
    const auto bytes = file().peek(kChecked);
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()),
                                std::min(bytes.size(), kChecked));
    const bool binary = std::any_of(text.begin(), text.end(), [](char c) {
      return (c >= 0 && c < ' ' && !is_space(c)) || c == '\x7f';
    });
    if (binary) refuse();
    constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
    if (text.starts_with(kByteOrderMark)) file().consume(kByteOrderMark.size());
  }

  /// Settles which columns hold the coordinates; keeps the first point where it had to be read.
  void read_header() {
    auto line = next_row();
    if (!line) refuse();
    auto cells = split(*line);
    if (!is_number(cells)) {
      if (const auto columns = find_columns(cells)) {
        use_columns(*columns);
        return;
      }
      line = next_row();
      if (!line) refuse();
      cells = split(*line);
      if (!is_number(cells)) refuse();
    } else if (comment_columns_ && comment_cells_ == cells.size()) {
      use_columns(*comment_columns_);
    }
    first_point_ = parse_row(*line);
  }

  static bool is_number(const std::vector<std::string_view>& cells) {
    return !cells.empty() && parse_number(cells.front()).has_value();
  }

  void use_columns(const Columns& columns) {
    axis_of_column_.assign(*std::max_element(columns.begin(), columns.end()) + 1, -1);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      axis_of_column_[columns[axis]] = static_cast<int>(axis);
    }
  }

  /// The next line that is neither blank nor a comment.
  std::optional<std::string_view> next_row() {
    while (auto line = next_line(file())) {
      ++line_number_;
      while (!line->empty() && is_space(line->front())) line->remove_prefix(1);
      while (!line->empty() && is_space(line->back())) line->remove_suffix(1);
      if (line->empty()) continue;
      const auto comment = comment_text(*line);
      if (!comment) return line;
      if (!separator_) remember_comment(*comment);
    }
    return std::nullopt;
  }

  /// "# time x y z" above the rows names the columns as some programs write them.
  void remember_comment(std::string_view text) {
    const auto names = split(text);
    if (const auto columns = find_columns(names)) {
      comment_columns_ = columns;
      comment_cells_ = names.size();
    }
  }

  Vector3 parse_row(std::string_view line) {
    if (!separator_) separator_ = find_separator(line);
    Vector3 point;
    for (std::size_t column = 0; column < axis_of_column_.size(); ++column) {
      const std::string_view cell = next_cell(line, *separator_);
      const int axis = axis_of_column_[column];
      if (axis < 0) continue;
      const auto value = parse_number(cell);
      if (!value) fail_at_line(column, cell);
      point[axis] = *value;
    }
    return point;
  }

  [[noreturn]] void fail_at_line(std::size_t column, std::string_view cell) const {
    const std::string what =
        cell.empty() ? "there is no number" : in_quotes(cell) + " is not a number";
    file().fail("line " + std::to_string(line_number_) + ", column " + std::to_string(column + 1) +
                ": " + what);
  }

  [[noreturn]] void refuse() const {
    file().fail("not a point cloud in a format that gdfmap reads (PLY, PCD, LAS, XYZ)");
  }

  std::vector<int> axis_of_column_ = {0, 1, 2};  ///< -1: not a coordinate
  std::optional<Columns> comment_columns_;       ///< named by a comment above the first row
  std::size_t comment_cells_ = 0;
  std::optional<char> separator_;  ///< ',' or ';', settled by the first row of numbers
  std::optional<Vector3> first_point_;
  std::uint64_t line_number_ = 0;
};

}  // namespace

std::unique_ptr<PointReader> open_xyz(std::unique_ptr<InputFile> file) {
  return std::make_unique<XyzReader>(std::move(file));
}

}  // namespace gdfmap::io
