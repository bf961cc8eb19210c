#include "header_count.hpp"

#include <span>
#include <string>

namespace gdfmap::io {

std::vector<std::uint64_t> find_placeholders(std::string_view header) {
  std::vector<std::uint64_t> offsets;
  for (std::size_t at = header.find(kCountPlaceholder); at != std::string_view::npos;
       at = header.find(kCountPlaceholder, at + kCountPlaceholder.size())) {
    offsets.push_back(at);
  }
  return offsets;
}

void write_count(AtomicFile& file, std::uint64_t offset, std::uint64_t count) {
  std::string digits = std::to_string(count);
  digits.insert(0, kCountPlaceholder.size() - digits.size(), '0');
  file.write_at(offset, std::as_bytes(std::span(digits)));
}

}  // namespace gdfmap::io
