#include "text.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>

namespace gdfmap::io {
namespace {

const char* find_line_end(std::string_view text) {
  return static_cast<const char*>(std::memchr(text.data(), '\n', text.size()));
}

std::string_view peek_text(InputFile& file, std::size_t min_bytes) {
  const auto bytes = file.peek(min_bytes);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

}  // namespace

std::optional<std::string_view> next_line(InputFile& file) {
  std::string_view text = peek_text(file, 1);
  if (text.empty()) return std::nullopt;
  const char* end = find_line_end(text);
  if (end == nullptr) {
    text = peek_text(file, kMaxLineBytes + 1);
    end = find_line_end(text);
  }
  std::string_view line =
      text.substr(0, end == nullptr ? text.size() : static_cast<std::size_t>(end - text.data()));
  if (line.size() > kMaxLineBytes) {
    file.fail("a line is longer than " + std::to_string(kMaxLineBytes) + " bytes");
  }
  file.consume(line.size() + (end == nullptr ? 0 : 1));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

bool skip_line(InputFile& file) {
  bool blank = true;
  while (true) {
    const std::string_view text = peek_text(file, 1);
    if (text.empty()) return !blank;
    const char* const end = find_line_end(text);
    const std::size_t length =
        end == nullptr ? text.size() : static_cast<std::size_t>(end - text.data());
    blank = blank &&
            std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(length), is_space);
    file.consume(length + (end == nullptr ? 0 : 1));
    if (end != nullptr && !blank) return true;
  }
}

std::optional<double> parse_number(std::string_view text) {
  const char* begin = text.data();
  const char* const end = begin + text.size();
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
  double value = 0.0;
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

std::optional<std::uint64_t> parse_count(std::string_view text) {
  const char* const end = text.data() + text.size();
  std::uint64_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return value;
}

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](char x, char y) { return lower(x) == lower(y); });
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kShown = 32;
  std::string result = "'";
  for (const char c : text.substr(0, kShown)) result += c >= ' ' && c <= '~' ? c : '?';
  return result + (text.size() > kShown ? "...'" : "'");
}

}  // namespace gdfmap::io
