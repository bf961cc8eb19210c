#include "pcd_header.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "text.hpp"

namespace gdfmap::io {
namespace {

constexpr std::uint64_t kMaxHeaderBytes = std::uint64_t{1} << 20;
constexpr std::size_t kMaxFields = 4096;

class HeaderParser {
 public:
  explicit HeaderParser(InputFile& file) : file_(file) {}

  PcdHeader parse() {
    while (parse_line()) {
    }
    if (header_.fields.empty()) file_.fail("the PCD header has no FIELDS");
    header_.num_points = resolve_num_points();
    check_record_bytes();
    return std::move(header_);
  }

 private:
  /// False at "DATA".
  bool parse_line() {
    ++line_number_;
    const auto line = next_line(file_);
    if (!line) file_.fail("file ends inside the PCD header");
    if (file_.position() > kMaxHeaderBytes) fail("the header is longer than 1 MiB");
    std::string_view rest = *line;
    const std::string_view keyword = next_word(rest);
    const auto is = [&](std::string_view name) { return equal_ignoring_case(keyword, name); };
    if (is("DATA")) {
      parse_encoding(next_word(rest));
      return false;
    }
    if (is("FIELDS") || is("COLUMNS")) {
      parse_fields(rest);
    } else if (is("SIZE")) {
      for_each_field(rest, [&](PcdField& f, std::string_view word) { f.size = parse_size(word); });
    } else if (is("TYPE")) {
      for_each_field(rest, [&](PcdField& f, std::string_view word) { f.type = parse_type(word); });
    } else if (is("COUNT")) {
      for_each_field(
          rest, [&](PcdField& f, std::string_view word) { f.count = parse_field_count(word); });
    } else if (is("WIDTH")) {
      width_ = require_count(next_word(rest));
    } else if (is("HEIGHT")) {
      height_ = require_count(next_word(rest));
    } else if (is("POINTS")) {
      points_ = require_count(next_word(rest));
    } else if (is("VIEWPOINT")) {
      header_.viewpoint = parse_viewpoint(rest);
    } else if (!keyword.empty() && keyword.front() != '#' && !is("VERSION")) {
      fail("unknown keyword " + in_quotes(keyword));
    }
    return true;
  }

  void parse_fields(std::string_view rest) {
    header_.fields.clear();
    for (auto name = next_word(rest); !name.empty(); name = next_word(rest)) {
      if (header_.fields.size() == kMaxFields) {
        fail("more than " + std::to_string(kMaxFields) + " fields");
      }
      PcdField field;
      field.name = name;
      header_.fields.push_back(std::move(field));
    }
  }

  /// What is no viewpoint says nothing: it is beside the points. Nor does the one that every writer
  /// puts there, the origin without a rotation.
  static std::optional<std::array<double, 7>> parse_viewpoint(std::string_view rest) {
    constexpr std::array<double, 7> kDefault = {0, 0, 0, 1, 0, 0, 0};
    std::array<double, 7> viewpoint{};
    for (double& value : viewpoint) {
      const auto number = parse_number(next_word(rest));
      if (!number || !std::isfinite(*number)) return std::nullopt;
      value = *number;
    }
    if (viewpoint == kDefault) return std::nullopt;
    return viewpoint;
  }

  template <typename F>
  void for_each_field(std::string_view rest, const F& f) {
    for (PcdField& field : header_.fields) {
      const std::string_view word = next_word(rest);
      if (word.empty()) fail("fewer values than FIELDS");
      f(field, word);
    }
    if (!next_word(rest).empty()) fail("more values than FIELDS");
  }

  std::size_t parse_size(std::string_view word) const {
    const std::uint64_t size = require_count(word);
    if (size != 1 && size != 2 && size != 4 && size != 8) fail("a SIZE is not 1, 2, 4 or 8");
    return static_cast<std::size_t>(size);
  }

  char parse_type(std::string_view word) const {
    for (const char type : {'F', 'I', 'U'}) {
      if (equal_ignoring_case(word, std::string_view(&type, 1))) return type;
    }
    fail("a TYPE is not F, I or U");
  }

  std::size_t parse_field_count(std::string_view word) const {
    const std::uint64_t count = require_count(word);
    if (count == 0 || count > InputFile::kMaxPeekBytes) fail("a COUNT is out of range");
    return static_cast<std::size_t>(count);
  }

  std::uint64_t require_count(std::string_view word) const {
    const auto count = parse_count(word);
    if (!count) fail(in_quotes(word) + " is not a whole number");
    return *count;
  }

  void parse_encoding(std::string_view word) {
    if (equal_ignoring_case(word, "ascii")) {
      header_.encoding = PcdEncoding::kAscii;
    } else if (equal_ignoring_case(word, "binary")) {
      header_.encoding = PcdEncoding::kBinary;
    } else if (equal_ignoring_case(word, "binary_compressed")) {
      header_.encoding = PcdEncoding::kBinaryCompressed;
    } else {
      fail("unknown DATA " + in_quotes(word));
    }
  }

  /// POINTS, or WIDTH · HEIGHT; where both are there they must agree, for one of them is a lie.
  std::uint64_t resolve_num_points() const {
    const std::uint64_t width = width_.value_or(0);
    const std::uint64_t height = height_.value_or(1);
    if (height != 0 && width > std::numeric_limits<std::uint64_t>::max() / height) {
      file_.fail("the PCD header's WIDTH times HEIGHT is no number of points");
    }
    if (!points_ && !width_) file_.fail("the PCD header has neither POINTS nor WIDTH");
    if (points_ && width != 0 && height != 0 && *points_ != width * height) {
      file_.fail("the PCD header declares " + std::to_string(*points_) + " points, but WIDTH " +
                 std::to_string(width) + " and HEIGHT " + std::to_string(height));
    }
    return points_ ? *points_ : width * height;
  }

  void check_record_bytes() const {
    std::size_t bytes = 0;
    for (const PcdField& field : header_.fields) bytes += field.bytes();
    if (bytes > InputFile::kMaxPeekBytes) {
      file_.fail("the PCD header declares points of " + std::to_string(bytes) + " bytes");
    }
  }

  [[noreturn]] void fail(const std::string& what) const {
    file_.fail("PCD header, line " + std::to_string(line_number_) + ": " + what);
  }

  InputFile& file_;
  PcdHeader header_;
  std::optional<std::uint64_t> width_, height_, points_;
  int line_number_ = 0;
};

}  // namespace

std::optional<ScalarType> PcdField::scalar_type() const {
  if (type == 'F' && size == 4) return ScalarType::kFloat32;
  if (type == 'F' && size == 8) return ScalarType::kFloat64;
  if (type == 'F') return std::nullopt;
  const bool is_signed = type == 'I';
  switch (size) {
    case 1:
      return is_signed ? ScalarType::kInt8 : ScalarType::kUint8;
    case 2:
      return is_signed ? ScalarType::kInt16 : ScalarType::kUint16;
    case 4:
      return is_signed ? ScalarType::kInt32 : ScalarType::kUint32;
    default:
      return is_signed ? ScalarType::kInt64 : ScalarType::kUint64;
  }
}

PcdHeader read_pcd_header(InputFile& file) { return HeaderParser(file).parse(); }

std::array<std::size_t, 3> find_pcd_coordinates(const InputFile& file,
                                                const std::vector<PcdField>& fields) {
  std::array<std::size_t, 3> indices{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string_view name = std::string_view("xyz").substr(axis, 1);
    const auto found = std::find_if(fields.begin(), fields.end(), [&](const PcdField& f) {
      return equal_ignoring_case(f.name, name);
    });
    if (found == fields.end()) file.fail("the PCD header has no field " + std::string(name));
    if (!found->scalar_type()) {
      file.fail("the PCD field " + std::string(name) + " has TYPE F and SIZE " +
                std::to_string(found->size));
    }
    indices[axis] = static_cast<std::size_t>(found - fields.begin());
  }
  return indices;
}

}  // namespace gdfmap::io
