#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <gdfmap/core/geometry.hpp>

namespace gdfmap::cli {

/// The shortest text that reads back as the same number.
[[nodiscard]] std::string exact(double value);
/// Rounded for people, to this many significant digits.
[[nodiscard]] std::string rounded(double value, int digits = 4);
[[nodiscard]] std::string fixed(double value, int decimals);

/// 1234567 as "1,234,567".
[[nodiscard]] std::string grouped(std::uint64_t count);
[[nodiscard]] std::string grouped(std::int64_t count);
/// 1536 as "1.5 KiB".
[[nodiscard]] std::string byte_text(std::uint64_t num_bytes);
/// "12.3 s", "4 min 5 s", "3 h 20 min".
[[nodiscard]] std::string duration_text(double seconds);
[[nodiscard]] std::string point_text(const Vector3& p);

/// Breaks lines at blanks so that none is longer than `width`; line ends in the text are kept.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t width);

/// Columns of text, aligned: the first to the left, the others to `alignment`.
class Table {
 public:
  enum class Alignment { kLeft, kRight };
  explicit Table(Alignment alignment) : alignment_(alignment) {}

  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  [[nodiscard]] std::string text() const;

 private:
  Alignment alignment_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace gdfmap::cli
