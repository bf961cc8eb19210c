#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "input_file.hpp"

namespace gdfmap::io {

/// No line that means something is as long as that; longer ones are refused, so that a file without
/// line ends cannot fill the memory.
inline constexpr std::size_t kMaxLineBytes = std::size_t{1} << 18;
static_assert(kMaxLineBytes < InputFile::kMaxPeekBytes);

/// The next line without its end (LF or CRLF); empty at the end of the file. Valid until the next
/// use of the file. @throws Error kCorrupt when it is longer than kMaxLineBytes.
[[nodiscard]] std::optional<std::string_view> next_line(InputFile& file);

/// Moves past one line of any length that is not blank; false at the end of the file.
[[nodiscard]] bool skip_line(InputFile& file);

[[nodiscard]] constexpr bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
}

/// Takes the first word, between white space, off `rest`; empty when there is none.
[[nodiscard]] inline std::string_view next_word(std::string_view& rest) {
  std::size_t begin = 0;
  while (begin < rest.size() && is_space(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_space(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

/// The whole of `text` as a decimal number, "nan" and "inf" included, whatever the locale.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);
[[nodiscard]] std::optional<std::uint64_t> parse_count(std::string_view text);

/// ASCII letters only.
[[nodiscard]] bool equal_ignoring_case(std::string_view a, std::string_view b);

/// Text of a file for a message: in quotes, shortened, without control characters.
[[nodiscard]] std::string in_quotes(std::string_view text);

}  // namespace gdfmap::io
