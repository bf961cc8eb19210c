#include <array>
#include <charconv>
#include <map>
#include <sstream>
#include <string_view>

#include <gdfmap/core/error.hpp>
#include <gdfmap/fit/fit_config.hpp>

namespace gdfmap {
namespace {

template <typename Number>
void write(Number value, std::string& text) {
  std::array<char, 32> buffer;  // shortest text that reads back to the same number
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  text.append(buffer.data(), result.ptr);
}

void write(const std::vector<int>& values, std::string& text) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i > 0) text += ' ';
    write(values[i], text);
  }
}

void write(Solver value, std::string& text) {
  text += value == Solver::kCeres ? "ceres" : "tensor";
}

void write(CubeCodec value, std::string& text) {
  text += value == CubeCodec::kQuantized ? "quantized" : "float32";
}

template <typename Number>
bool read(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size();
}

bool read(std::string_view text, std::vector<int>& values) {
  values.clear();
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (!read(text.substr(begin, end - begin), values.emplace_back())) return false;
    begin = end + 1;
  }
  return true;
}

bool read(std::string_view text, Solver& value) {
  const auto found = find_solver(text);
  if (found) value = *found;
  return found.has_value();
}

bool read(std::string_view text, CubeCodec& value) {
  const auto found = find_codec(text);
  if (found) value = *found;
  return found.has_value();
}

/// Calls visit(key, member) for every member, in the order of the canonical text.
template <typename Config, typename Visit>
void for_each_member(Config& config, const Visit& visit) {
  visit("adaptive.populated_steps", config.populated_steps);
  visit("adaptive.empty_steps", config.empty_steps);
  visit("adaptive.mae_threshold", config.mae_threshold);
  visit("adaptive.empty_mae_threshold", config.empty_mae_threshold);
  visit("adaptive.empty_distance_threshold", config.empty_distance_threshold);
  visit("trainer.mae_threshold_max", config.mae_threshold_max);
  visit("solver.max_iterations", config.max_iterations);
  visit("fit.solver", config.solver);
  visit("fit.codec", config.codec);
}

std::map<std::string, std::string> to_values(const FitConfig& config) {
  std::map<std::string, std::string> values;
  for_each_member(config, [&](const char* key, const auto& member) { write(member, values[key]); });
  return values;
}

}  // namespace

std::optional<Solver> find_solver(std::string_view name) {
  if (name == "tensor") return Solver::kTensor;
  if (name == "ceres") return Solver::kCeres;
  return std::nullopt;
}

std::optional<CubeCodec> find_codec(std::string_view name) {
  if (name == "quantized") return CubeCodec::kQuantized;
  if (name == "float32") return CubeCodec::kFloat32;
  return std::nullopt;
}

std::optional<FitPreset> find_preset(std::string_view name) {
  if (name == "fast") return FitPreset::kFast;
  if (name == "balanced") return FitPreset::kBalanced;
  if (name == "best") return FitPreset::kBest;
  return std::nullopt;
}

FitConfig FitConfig::preset(FitPreset preset, double cube_size) {
  FitConfig config;
  if (preset == FitPreset::kFast) {
    config.populated_steps = {8, 16};
    config.empty_steps = {4, 8};
    config.mae_threshold = 0.025;
    config.empty_mae_threshold = 0.012;
    config.max_iterations = 12;
  } else if (preset == FitPreset::kBest) {
    config.populated_steps = {8, 16, 32, 48};
    config.empty_steps = {5, 8, 12, 18, 28};
    config.mae_threshold = 0.006;
    config.empty_mae_threshold = 0.0048;
    config.max_iterations = 30;
  }
  config.mae_threshold *= cube_size;
  config.empty_mae_threshold *= cube_size;
  config.mae_threshold_max *= cube_size;
  config.empty_distance_threshold *= cube_size;
  return config;
}

std::string FitConfig::canonical() const {
  std::string text;
  for_each_member(*this, [&](const char* key, const auto& member) {
    text += std::string(key) + " = ";
    write(member, text);
    text += '\n';
  });
  return text;
}

FitConfig FitConfig::from_canonical(const std::string& text) {
  FitConfig config;
  std::istringstream lines(text);
  for_each_member(config, [&](const char* key, auto& member) {
    std::string line;
    std::getline(lines, line);
    const std::string prefix = std::string(key) + " = ";
    if (!line.starts_with(prefix) || !read(std::string_view(line).substr(prefix.size()), member)) {
      throw Error(ErrorCode::kCorrupt, "stored fit configuration: cannot read \"" + line +
                                           "\" where " + key + " is expected");
    }
  });
  return config;
}

std::vector<std::string> FitConfig::differing_keys(const FitConfig& other) const {
  std::vector<std::string> keys;
  const auto values = to_values(other);
  for (const auto& [key, value] : to_values(*this)) {
    if (values.at(key) != value) keys.push_back(key);
  }
  return keys;
}

}  // namespace gdfmap
