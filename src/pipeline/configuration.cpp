#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <string_view>

#include <yaml-cpp/yaml.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/lattice.hpp>
#include <gdfmap/pipeline/configuration.hpp>

namespace gdfmap {
namespace {

/// Reads a key's value into the configuration; returns what is wrong with it, or nothing.
using ReadValue = std::function<std::string(const YAML::Node&, Configuration&)>;

struct Key {
  const char* path;  ///< "section.key"
  ReadValue read;
};

std::string number_text(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

ReadValue text(std::string Configuration::*member) {
  return [=](const YAML::Node& node, Configuration& c) -> std::string {
    if (!node.IsScalar()) return "must be text";
    c.*member = node.Scalar();
    return {};
  };
}

ReadValue flag(bool Configuration::*member) {
  return [=](const YAML::Node& node, Configuration& c) -> std::string {
    if (!YAML::convert<bool>::decode(node, c.*member)) return "must be true or false";
    return {};
  };
}

/// A finite number in [low, high].
template <typename Member>
ReadValue number(Member Configuration::*member, double low, double high) {
  return [=](const YAML::Node& node, Configuration& c) -> std::string {
    double value = 0.0;
    if (!YAML::convert<double>::decode(node, value) || !(value >= low && value <= high)) {
      return "must be a number from " + number_text(low) + " to " + number_text(high);
    }
    c.*member = value;
    return {};
  };
}

template <typename Member>
ReadValue whole_number(Member Configuration::*member, int low, int high) {
  return [=](const YAML::Node& node, Configuration& c) -> std::string {
    int value = 0;
    if (!YAML::convert<int>::decode(node, value) || value < low || value > high) {
      return "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high);
    }
    c.*member = value;
    return {};
  };
}

/// Ascending numbers of Gaussians.
ReadValue ladder(std::optional<std::vector<int>> Configuration::*member) {
  return [=](const YAML::Node& node, Configuration& c) -> std::string {
    const std::string expected =
        "must be an ascending list of whole numbers from 1 to " + std::to_string(kMaxGaussians);
    std::vector<int> steps;
    if (!node.IsSequence() || node.size() == 0) return expected;
    for (const YAML::Node& entry : node) {
      int step = 0;
      if (!YAML::convert<int>::decode(entry, step) || step < 1 || step > kMaxGaussians ||
          (!steps.empty() && step <= steps.back())) {
        return expected;
      }
      steps.push_back(step);
    }
    c.*member = steps;
    return {};
  };
}

/// One of a few names. @param find  what a name means; nothing for others
template <typename Choice>
ReadValue choice(std::optional<Choice> Configuration::*member,
                 std::optional<Choice> (*find)(std::string_view), const char* names) {
  return [=](const YAML::Node& node, Configuration& c) -> std::string {
    c.*member = find(node.IsScalar() ? node.Scalar() : "");
    return c.*member ? "" : std::string("must be ") + names;
  };
}

/// Accepted for the ancestor's sake.
ReadValue without_effect(const char* path, const char* reason) {
  return [=](const YAML::Node&, Configuration& c) -> std::string {
    c.notices.push_back(std::string(path) + " has no effect: " + reason);
    return {};
  };
}

ReadValue edt_mode() {
  return [](const YAML::Node& node, Configuration&) -> std::string {
    const std::string mode = node.IsScalar() ? node.Scalar() : "";
    if (mode == "pure") return {};
    return mode == "signed" ? "signed fields are not supported: set it to pure" : "must be pure";
  };
}

constexpr double kMostMetres = 1e6;
constexpr const char* kExactTargets =
    "distances are exact, taken from every point at the samples themselves, without a voxel grid";

const std::vector<Key>& keys() {
  using C = Configuration;
  const auto none = [](const char* path, const char* reason) {
    return Key{path, without_effect(path, reason)};
  };
  static const std::vector<Key> table = {
      {"io.input_file", text(&C::input_file)},
      {"io.output_base", text(&C::output_base)},
      {"io.export_csv", flag(&C::export_csv)},
      {"io.export_bin", flag(&C::export_bin)},
      {"processing.num_threads", whole_number(&C::num_threads, 0, 4096)},
      {"processing.cube_size", number(&C::cube_size, 1e-3, 1e4)},
      {"processing.levels", whole_number(&C::num_levels, 1, kMaxLevels)},
      none("downsampling.step", "no coarse copy of the cloud is needed to skip far cubes"),
      none("trainer.sample_points", "samples lie on a regular lattice, 12 along each axis"),
      none("trainer.mae_threshold_good", "adaptive.mae_threshold alone ends the growth of a cube"),
      {"trainer.mae_threshold_max", number(&C::mae_threshold_max, 0.0, kMostMetres)},
      {"trainer.edt_mode", edt_mode()},
      {"solver.max_iterations", whole_number(&C::max_iterations, 1, 10'000)},
      none("solver.max_time_seconds", "a result must not depend on the speed of the machine"),
      {"adaptive.populated_steps", ladder(&C::populated_steps)},
      {"adaptive.empty_steps", ladder(&C::empty_steps)},
      {"adaptive.mae_threshold", number(&C::mae_threshold, 0.0, kMostMetres)},
      {"adaptive.empty_mae_threshold", number(&C::empty_mae_threshold, 0.0, kMostMetres)},
      {"adaptive.empty_distance_threshold", number(&C::empty_distance_threshold, 0.0, kMostMetres)},
      none("edt.voxel_size", kExactTargets),
      none("edt.margin_signed", "signed fields are not supported"),
      none("edt.margin_pure", "the margin is a quarter of cube_size"),
      none("edt.edt_extension", kExactTargets),
      none("edt.empty_search_margin", "empty cubes see every point, however far"),
      none("edt.empty_nearby_count", "empty cubes see every point, however many"),
      {"fit.preset", choice(&C::preset, find_preset, "fast, balanced or best")},
      {"fit.solver", choice(&C::solver, find_solver, "tensor or ceres")},
      {"fit.codec", choice(&C::codec, find_codec, "quantized or float32")},
  };
  return table;
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

std::string unknown_key(const std::string& path) {
  if (path.size() > kMaxShownKey) return shown(path) + ": unknown key";
  std::string nearest;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  for (const Key& key : keys()) {
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

void read_section(const std::string& section, const YAML::Node& node, Configuration& configuration,
                  std::vector<std::string>& violations) {
  for (const auto& entry : node) {
    if (violations.size() >= kMaxViolations) return;
    const std::string path = section + "." + entry.first.Scalar();
    const auto key =
        std::find_if(keys().begin(), keys().end(), [&](const Key& k) { return path == k.path; });
    if (key == keys().end()) {
      violations.push_back(unknown_key(path));
      continue;
    }
    const std::string violation = key->read(entry.second, configuration);
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

FitConfig Configuration::fit_config(double map_cube_size) const {
  FitConfig config = FitConfig::preset(preset.value_or(FitPreset::kBalanced), map_cube_size);
  if (populated_steps) config.populated_steps = *populated_steps;
  if (empty_steps) config.empty_steps = *empty_steps;
  if (mae_threshold) config.mae_threshold = config.empty_mae_threshold = *mae_threshold;
  if (empty_mae_threshold) config.empty_mae_threshold = *empty_mae_threshold;
  if (mae_threshold_max) config.mae_threshold_max = *mae_threshold_max;
  if (empty_distance_threshold) config.empty_distance_threshold = *empty_distance_threshold;
  if (max_iterations) config.max_iterations = *max_iterations;
  if (solver) config.solver = *solver;
  if (codec) config.codec = *codec;
  return config;
}

Configuration load_configuration(const std::filesystem::path& path) {
  const YAML::Node root = load(path);
  Configuration configuration;
  std::vector<std::string> violations;
  if (!root.IsMap() && !root.IsNull()) violations.emplace_back("the file must hold sections");
  if (root.IsMap()) {
    for (const auto& section : root) {
      if (violations.size() >= kMaxViolations) break;
      const std::string name = section.first.Scalar();
      if (section.second.IsMap()) {
        read_section(name, section.second, configuration, violations);
      } else if (!section.second.IsNull()) {
        violations.push_back(unknown_key(name));
      }
    }
  }
  if (violations.empty()) return configuration;
  std::string message = path.string() + ":";
  for (const std::string& violation : violations) {
    message += (violations.size() > 1 ? "\n  " : " ") + violation;
  }
  throw Error(ErrorCode::kUsage, message);
}

std::vector<std::string> configuration_keys() {
  std::vector<std::string> paths;
  for (const Key& key : keys()) paths.emplace_back(key.path);
  return paths;
}

}  // namespace gdfmap
