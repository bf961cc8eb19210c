#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gdfmap {

/// The value of a key in a YAML file. Each member is empty where the value is something else.
class YamlValue {
 public:
  /// @param node  the parser's; outlives this
  explicit YamlValue(const void* node) : node_(node) {}

  [[nodiscard]] std::optional<std::string> text() const;
  [[nodiscard]] std::optional<bool> flag() const;
  [[nodiscard]] std::optional<double> number() const;
  [[nodiscard]] std::optional<int> whole_number() const;
  [[nodiscard]] std::optional<std::vector<int>> whole_numbers() const;

 private:
  const void* node_;
};

/// A key that a file may have.
struct YamlKey {
  const char* path;  ///< "section.key"
  /// Takes the value; returns what is wrong with it, or nothing.
  std::function<std::string(const YamlValue&)> read;
};

/// Reads a YAML file of sections, at most 1 MiB, handing every value to its key.
/// @throws Error kIo when it cannot be read; kUsage for anything in it that is wrong: all
///         violations (the first twenty) at once, a line each, with key paths; an unknown key is
///         named together with the nearest known one.
void read_yaml_file(const std::filesystem::path& path, std::span<const YamlKey> keys);

}  // namespace gdfmap
