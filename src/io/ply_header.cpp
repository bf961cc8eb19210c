#include "ply_header.hpp"

#include <string_view>
#include <utility>

#include "text.hpp"

namespace gdfmap::io {
namespace {

constexpr std::uint64_t kMaxHeaderBytes = std::uint64_t{1} << 20;
constexpr std::size_t kMaxElements = 256;
constexpr std::size_t kMaxProperties = 4096;

std::optional<ScalarType> parse_type(std::string_view name) {
  static constexpr std::pair<std::string_view, ScalarType> kNames[] = {
      {"char", ScalarType::kInt8},      {"int8", ScalarType::kInt8},
      {"uchar", ScalarType::kUint8},    {"uint8", ScalarType::kUint8},
      {"short", ScalarType::kInt16},    {"int16", ScalarType::kInt16},
      {"ushort", ScalarType::kUint16},  {"uint16", ScalarType::kUint16},
      {"int", ScalarType::kInt32},      {"int32", ScalarType::kInt32},
      {"uint", ScalarType::kUint32},    {"uint32", ScalarType::kUint32},
      {"int64", ScalarType::kInt64},    {"uint64", ScalarType::kUint64},
      {"float", ScalarType::kFloat32},  {"float32", ScalarType::kFloat32},
      {"double", ScalarType::kFloat64}, {"float64", ScalarType::kFloat64}};
  for (const auto& [known, type] : kNames) {
    if (name == known) return type;
  }
  return std::nullopt;
}

class HeaderParser {
 public:
  explicit HeaderParser(InputFile& file) : file_(file) {}

  PlyHeader parse() {
    static_cast<void>(next_line(file_));  // "ply", which told the format
    while (parse_line()) {
    }
    if (!has_format_) file_.fail("the PLY header has no format line");
    return std::move(header_);
  }

 private:
  /// False at "end_header".
  bool parse_line() {
    ++line_number_;
    const auto line = next_line(file_);
    if (!line) file_.fail("file ends inside the PLY header");
    if (file_.position() > kMaxHeaderBytes) fail("the header is longer than 1 MiB");
    std::string_view rest = *line;
    const std::string_view keyword = next_word(rest);
    if (keyword == "end_header") return false;
    if (keyword == "format") {
      parse_format(rest);
    } else if (keyword == "element") {
      parse_element(rest);
    } else if (keyword == "property") {
      parse_property(rest);
    } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
      fail("unknown keyword " + in_quotes(keyword));
    }
    return true;
  }

  void parse_format(std::string_view rest) {
    const std::string_view encoding = next_word(rest);
    if (encoding == "ascii") {
      header_.encoding = PlyEncoding::kAscii;
    } else if (encoding == "binary_little_endian") {
      header_.encoding = PlyEncoding::kLittleEndian;
    } else if (encoding == "binary_big_endian") {
      header_.encoding = PlyEncoding::kBigEndian;
    } else {
      fail("unknown format " + in_quotes(encoding));
    }
    has_format_ = true;
  }

  void parse_element(std::string_view rest) {
    const std::string_view name = next_word(rest);
    const std::string_view count_text = next_word(rest);
    const auto count = parse_count(count_text);
    if (!count) fail(in_quotes(count_text) + " is not a number of elements");
    if (header_.elements.size() == kMaxElements) {
      fail("more than " + std::to_string(kMaxElements) + " elements");
    }
    header_.elements.push_back({std::string(name), *count, {}});
  }

  void parse_property(std::string_view rest) {
    if (header_.elements.empty()) fail("a property before the first element");
    auto& properties = header_.elements.back().properties;
    if (properties.size() == kMaxProperties) {
      fail("more than " + std::to_string(kMaxProperties) + " properties");
    }
    PlyProperty property;
    std::string_view type_name = next_word(rest);
    if (type_name == "list") {
      property.list_length = require_type(next_word(rest));
      if (!is_integer(*property.list_length)) fail("the length of a list is not an integer");
      type_name = next_word(rest);
    }
    property.type = require_type(type_name);
    property.name = next_word(rest);
    properties.push_back(std::move(property));
  }

  ScalarType require_type(std::string_view name) const {
    const auto type = parse_type(name);
    if (!type) fail("unknown type " + in_quotes(name));
    return *type;
  }

  [[noreturn]] void fail(const std::string& what) const {
    file_.fail("PLY header, line " + std::to_string(line_number_) + ": " + what);
  }

  InputFile& file_;
  PlyHeader header_;
  bool has_format_ = false;
  int line_number_ = 1;
};

}  // namespace

PlyHeader read_ply_header(InputFile& file) { return HeaderParser(file).parse(); }

}  // namespace gdfmap::io
