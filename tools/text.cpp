#include "text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace gdfmap::cli {
namespace {

std::string padding(std::size_t width, std::string_view cell) {
  return std::string(width - std::min(width, cell.size()), ' ');
}

}  // namespace

std::string exact(double value) {
  std::array<char, 32> text;
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string rounded(double value, int digits) {
  std::array<char, 64> text;
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

std::string fixed(double value, int decimals) {
  std::array<char, 400> text;  // the largest double has 309 digits before the point
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

std::string grouped(std::uint64_t count) {
  std::string text = std::to_string(count);
  for (std::size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, ",");
  return text;
}

std::string grouped(std::int64_t count) {
  return count < 0 ? "-" + grouped(std::uint64_t{0} - static_cast<std::uint64_t>(count))
                   : grouped(static_cast<std::uint64_t>(count));
}

std::string byte_text(std::uint64_t num_bytes) {
  constexpr std::array kUnits = {"KiB", "MiB", "GiB", "TiB", "PiB"};
  if (num_bytes < 1024) return std::to_string(num_bytes) + " bytes";
  double value = static_cast<double>(num_bytes) / 1024.0;
  std::size_t unit = 0;
  for (; value >= 1024.0 && unit + 1 < kUnits.size(); ++unit) value /= 1024.0;
  return fixed(value, value < 100.0 ? 1 : 0) + " " + kUnits[unit];
}

std::string duration_text(double seconds) {
  if (seconds < 60.0) return fixed(seconds, 1) + " s";
  const auto whole = static_cast<std::int64_t>(std::min(seconds, 1e15));
  if (whole < 3600) return std::to_string(whole / 60) + " min " + std::to_string(whole % 60) + " s";
  return grouped(whole / 3600) + " h " + std::to_string(whole / 60 % 60) + " min";
}

std::string point_text(const Vector3& p) {
  return rounded(p.x(), 9) + ", " + rounded(p.y(), 9) + ", " + rounded(p.z(), 9);
}

std::string wrapped(std::string_view text, std::size_t width) {
  std::string result;
  std::size_t column = 0;
  while (!text.empty()) {
    if (text.front() == '\n') {
      result += '\n';
      column = 0;
      text.remove_prefix(1);
      continue;
    }
    // A word with the blanks before it, so that indentation survives.
    const std::size_t start = std::min(text.find_first_not_of(' '), text.size());
    const std::size_t end = std::min(text.find_first_of(" \n", start), text.size());
    std::string_view word = text.substr(0, end);
    if (column > 0 && column + word.size() > width) {
      result += '\n';
      column = 0;
      word.remove_prefix(start);
    }
    result += word;
    column += word.size();
    text.remove_prefix(end);
  }
  return result;
}

std::string Table::text() const {
  std::vector<std::size_t> widths;
  for (const auto& row : rows_) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string result;
  for (const auto& row : rows_) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool left = i == 0 || alignment_ == Alignment::kLeft;
      if (i > 0) line += "  ";
      line += left ? row[i] + padding(widths[i], row[i]) : padding(widths[i], row[i]) + row[i];
    }
    result += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return result;
}

}  // namespace gdfmap::cli
