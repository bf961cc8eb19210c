#include "e2e/map_bytes.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "e2e/program.hpp"
#include "support/map_fixture.hpp"

namespace gdfmap::test {
namespace {

std::string exported(const std::filesystem::path& map, const std::string& extension) {
  const std::string path = map.string() + extension;
  const Result result = gdfmap({"export", map.string(), path});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return read_file(path);
}

}  // namespace

MapBytes bytes_of(const std::filesystem::path& map) {
  MapBytes bytes{exported(map, ".bin"), exported(map, ".csv"), content_digest_of(map)};
  EXPECT_GT(bytes.bin.size(), 120u);
  EXPECT_GT(bytes.csv.size(), 120u);
  return bytes;
}

std::string content_digest_of(const std::filesystem::path& map) {
  const Result result = gdfmap({"info", map.string(), "--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return nlohmann::json::parse(result.out).at("content_digest");
}

}  // namespace gdfmap::test
