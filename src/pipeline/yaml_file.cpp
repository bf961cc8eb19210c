#include "yaml_file.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <string_view>

#include <yaml-cpp/yaml.h>

#include <gdfmap/core/error.hpp>

namespace gdfmap {
namespace {

const YAML::Node& node_of(const void* node) { return *static_cast<const YAML::Node*>(node); }

template <typename T>
std::optional<T> converted(const YAML::Node& node) {
  T value{};
  return YAML::convert<T>::decode(node, value) ? std::optional(value) : std::nullopt;
}

/// Longer than any key that a slip of the pen makes of a known one.
constexpr std::size_t kMaxShownKey = 64;
/// Many times what a configuration needs; the parser takes a hundred times as much memory.
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;

/// A file with more mistakes is not a configuration; the rest of it is passed over.
constexpr std::size_t kMaxViolations = 20;

/// Levenshtein distance of two keys, or `limit` where it is no less. @param a  at most kMaxShownKey
std::size_t edit_distance(std::string_view a, std::string_view b, std::size_t limit) {
  const std::size_t width = a.size() + 1;
  std::array<std::size_t, kMaxShownKey + 1> storage;
  std::size_t* const row = storage.data();
  for (std::size_t j = 0; j < width; ++j) row[j] = j;
  for (const char c : b) {
    std::size_t diagonal = row[0], least = ++row[0];
    for (std::size_t j = 1; j < width; ++j) {
      const std::size_t substituted = diagonal + (a[j - 1] == c ? 0 : 1);
      const std::size_t moved = (row[j] < row[j - 1] ? row[j] : row[j - 1]) + 1;
      diagonal = row[j];
      row[j] = substituted < moved ? substituted : moved;
      least = row[j] < least ? row[j] : least;
    }
    if (least >= limit) return limit;
  }
  return row[width - 1] < limit ? row[width - 1] : limit;
}

/// As much of a key as is told, on one line.
std::string shown(const std::string& path) {
  std::string text = path.substr(0, kMaxShownKey);
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c == 0x7f; }, '?');
  return path.size() > kMaxShownKey ? text + "..." : text;
}

std::string unknown_key(const std::string& path, std::span<const YamlKey> keys) {
  if (path.size() > kMaxShownKey) return shown(path) + ": unknown key";
  std::string nearest;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const YamlKey& key : keys) {
    const std::string_view known = key.path;
    const auto [shorter, longer] = std::minmax({path.size(), known.size()});
    if (longer - shorter >= least) continue;  // a bound of the distance
    const std::size_t distance = edit_distance(path, known, least);
    if (distance < least) {
      least = distance;
      nearest = key.path;
    }
  }
  return shown(path) + ": unknown key; did you mean " + nearest + "?";
}

void read_section(const std::string& section, const YAML::Node& node, std::span<const YamlKey> keys,
                  std::vector<std::string>& violations) {
  for (const auto& entry : node) {
    if (violations.size() >= kMaxViolations) return;
    const std::string path = section + "." + entry.first.Scalar();
    const auto key = std::ranges::find_if(keys, [&](const YamlKey& k) { return path == k.path; });
    if (key == keys.end()) {
      violations.push_back(unknown_key(path, keys));
      continue;
    }
    const std::string violation = key->read(YamlValue(&entry.second));
    if (!violation.empty()) violations.push_back(path + ": " + violation);
  }
}

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text;
  for (std::array<char, 16384> part; file && text.size() <= kMaxFileBytes;) {
    file.read(part.data(), part.size());
    text.append(part.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (!file.is_open() || file.bad()) {
    throw Error(ErrorCode::kIo, "cannot read " + path.string());
  }
  if (text.size() > kMaxFileBytes) {
    throw Error(ErrorCode::kUsage, path.string() + ": too large for a configuration");
  }
  return text;
}

YAML::Node load(const std::filesystem::path& path) {
  const std::string text = read_text(path);
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw Error(ErrorCode::kUsage, path.string() + ": " + error.what());
  }
}

}  // namespace

std::optional<std::string> YamlValue::text() const {
  const YAML::Node& node = node_of(node_);
  return node.IsScalar() ? std::optional(node.Scalar()) : std::nullopt;
}

std::optional<bool> YamlValue::flag() const { return converted<bool>(node_of(node_)); }

std::optional<double> YamlValue::number() const { return converted<double>(node_of(node_)); }

std::optional<int> YamlValue::whole_number() const { return converted<int>(node_of(node_)); }

std::optional<std::vector<int>> YamlValue::whole_numbers() const {
  const YAML::Node& node = node_of(node_);
  if (!node.IsSequence()) return std::nullopt;
  std::vector<int> numbers;
  for (const YAML::Node& entry : node) {
    const auto number = converted<int>(entry);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

void read_yaml_file(const std::filesystem::path& path, std::span<const YamlKey> keys) {
  const YAML::Node root = load(path);
  std::vector<std::string> violations;
  if (!root.IsMap() && !root.IsNull()) violations.emplace_back("the file must hold sections");
  if (root.IsMap()) {
    for (const auto& section : root) {
      if (violations.size() >= kMaxViolations) break;
      const std::string name = section.first.Scalar();
      if (section.second.IsMap()) {
        read_section(name, section.second, keys, violations);
      } else if (!section.second.IsNull()) {
        violations.push_back(unknown_key(name, keys));
      }
    }
  }
  if (violations.empty()) return;
  std::string message = path.string() + ":";
  for (const std::string& violation : violations) {
    message += (violations.size() > 1 ? "\n  " : " ") + violation;
  }
  throw Error(ErrorCode::kUsage, message);
}

}  // namespace gdfmap
