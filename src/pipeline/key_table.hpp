#pragma once

#include <functional>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "yaml_file.hpp"

namespace gdfmap {

/// Keys of a configuration `C` that a YAML file fills in, member by member. `C` has a member
/// `notices`, a list of lines on keys that are accepted and change nothing.
template <typename C>
struct KeyTable {
  /// Reads a value into a configuration; returns what is wrong with it, or nothing.
  using Read = std::function<std::string(const YamlValue&, C&)>;
  struct Key {
    const char* path;  ///< "section.key"
    Read read;
  };

  static std::string number_text(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
  }

  static Read text(std::string C::*member) {
    return [=](const YamlValue& value, C& c) -> std::string {
      const auto given = value.text();
      if (!given) return "must be text";
      c.*member = *given;
      return {};
    };
  }

  static Read flag(bool C::*member) {
    return [=](const YamlValue& value, C& c) -> std::string {
      const auto given = value.flag();
      if (!given) return "must be true or false";
      c.*member = *given;
      return {};
    };
  }

  /// A number in [low, high].
  template <typename Member>
  static Read number(Member C::*member, double low, double high) {
    return [=](const YamlValue& value, C& c) -> std::string {
      const auto given = value.number();
      if (!given || !(*given >= low && *given <= high)) {
        return "must be a number from " + number_text(low) + " to " + number_text(high);
      }
      c.*member = *given;
      return {};
    };
  }

  template <typename Member>
  static Read whole_number(Member C::*member, int low, int high) {
    return [=](const YamlValue& value, C& c) -> std::string {
      const auto given = value.whole_number();
      if (!given || *given < low || *given > high) {
        return "must be a whole number from " + std::to_string(low) + " to " + std::to_string(high);
      }
      c.*member = *given;
      return {};
    };
  }

  /// An ascending list of numbers in [1, most].
  static Read ladder(std::optional<std::vector<int>> C::*member, int most) {
    return [=](const YamlValue& value, C& c) -> std::string {
      const auto given = value.whole_numbers();
      bool is_ladder = given && !given->empty() && given->front() >= 1 && given->back() <= most;
      for (std::size_t i = 1; is_ladder && i < given->size(); ++i) {
        is_ladder = (*given)[i] > (*given)[i - 1];
      }
      if (!is_ladder) {
        return "must be an ascending list of whole numbers from 1 to " + std::to_string(most);
      }
      c.*member = *given;
      return {};
    };
  }

  /// One of a few names. @param find  what a name means; nothing for others
  template <typename Choice>
  static Read choice(std::optional<Choice> C::*member,
                     std::optional<Choice> (*find)(std::string_view), const char* names) {
    return [=](const YamlValue& value, C& c) -> std::string {
      c.*member = find(value.text().value_or(""));
      return c.*member ? "" : std::string("must be ") + names;
    };
  }

  /// Accepted for the ancestor's sake.
  static Key without_effect(const char* path, const char* reason) {
    return {path, [=](const YamlValue&, C& c) -> std::string {
              c.notices.push_back(std::string(path) + " has no effect: " + reason);
              return {};
            }};
  }

  /// The keys as they fill in `c`, which outlives them.
  static std::vector<YamlKey> bound(std::span<const Key> keys, C& c) {
    std::vector<YamlKey> result;
    for (const Key& key : keys) {
      result.push_back({key.path, [&](const YamlValue& value) { return key.read(value, c); }});
    }
    return result;
  }
};

}  // namespace gdfmap
