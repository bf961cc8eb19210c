#include <algorithm>
#include <charconv>
#include <optional>
#include <vector>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/sources.hpp>

namespace gdfmap {
namespace {

std::optional<std::int64_t> parse_id(const std::string& text) {
  std::int64_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return id;
}

/// "1 (a.ply), 2 (b.ply)"
std::string list_of(const std::vector<SourceRecord>& sources) {
  constexpr std::size_t kMaxListed = 10;
  std::string text;
  for (std::size_t i = 0; i < std::min(sources.size(), kMaxListed); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(sources[i].id) + " (" + sources[i].path + ")";
  }
  return sources.size() > kMaxListed ? text + ", ..." : text;
}

}  // namespace

SourceRecord select_source(PointStore& store, const std::string& id_or_path) {
  const std::vector<SourceRecord> sources = store.sources();
  const std::optional<std::int64_t> id = parse_id(id_or_path);
  std::vector<SourceRecord> found;
  std::copy_if(sources.begin(), sources.end(), std::back_inserter(found),
               [&](const SourceRecord& s) { return id ? s.id == *id : s.path == id_or_path; });
  if (found.size() == 1) return found.front();
  if (found.empty()) {
    throw Error(ErrorCode::kUsage, "there is no source " + id_or_path + "; the map has " +
                                       (sources.empty() ? std::string("none") : list_of(sources)));
  }
  throw Error(ErrorCode::kUsage, "several sources have the path " + id_or_path +
                                     ": name one by its id, " + list_of(found));
}

}  // namespace gdfmap
