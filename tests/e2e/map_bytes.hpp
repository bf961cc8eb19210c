#pragma once

#include <filesystem>
#include <string>

namespace gdfmap::test {

/// All that must be equal when two maps hold the same field.
struct MapBytes {
  std::string bin, csv, content_digest;
  bool operator==(const MapBytes&) const = default;
};

/// Exports a map and asks for its digest. Fails the test when the program refuses.
[[nodiscard]] MapBytes bytes_of(const std::filesystem::path& map);

/// The digest that `gdfmap info --json` prints.
[[nodiscard]] std::string content_digest_of(const std::filesystem::path& map);

}  // namespace gdfmap::test
