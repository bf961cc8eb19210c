#include <algorithm>
#include <string_view>
#include <utility>

#include <gdfmap/io/point_reader.hpp>

#include "formats.hpp"
#include "text.hpp"

namespace gdfmap {
namespace {

constexpr std::size_t kSniffedBytes = 64 << 10;

bool is_ply(std::string_view text) {
  return text.starts_with("ply\n") || text.starts_with("ply\r\n");
}

/// The first line that is no comment begins with VERSION or FIELDS, or the first comment says it.
bool is_pcd(std::string_view text) {
  if (text.starts_with("# .PCD")) return true;
  while (!text.empty()) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    const std::string_view word = io::next_word(line);
    if (word.empty() || word.front() == '#') continue;
    return (word == "VERSION" || word == "FIELDS" || word == "COLUMNS") && !line.empty();
  }
  return false;
}

}  // namespace

std::unique_ptr<PointReader> open_point_cloud(const std::filesystem::path& path) {
  auto file = std::make_unique<io::InputFile>(path);
  const auto bytes = file->peek(kSniffedBytes);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()),
                              std::min(bytes.size(), kSniffedBytes));
  if (text.empty()) file->fail("is empty");
  if (text.starts_with("LASF")) return io::open_las(std::move(file));
  if (is_ply(text)) return io::open_ply(std::move(file));
  if (is_pcd(text)) return io::open_pcd(std::move(file));
  return io::open_xyz(std::move(file));
}

}  // namespace gdfmap
