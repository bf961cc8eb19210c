#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = GDFMAP_SOURCE_DIR;

/// The layers, lowest first; a module includes headers of lower layers and its own alone.
const std::map<std::string, int> kLayers = {
    {"core", 0},  {"db", 1},     {"io", 1},    {"field", 1},    {"edt", 1},
    {"fit", 2},   {"tiling", 2}, {"store", 2}, {"gdf1", 2},     {"map", 3},
    {"query", 4}, {"train", 5},  {"align", 5}, {"pipeline", 6}, {"interop", 7}};

/// Where each third-party header may be included; always in .cpp files.
const std::map<std::string, std::set<std::string>> kThirdParty = {
    {"sqlite3", {"db"}},         {"xxhash", {"core"}},    {"ceres/", {"fit"}},
    {"yaml-cpp/", {"pipeline"}}, {"cairo", {"pipeline"}}, {"nlohmann/", {"gdf1", "tools"}},
    {"CLI/", {"tools"}},         {"omp.h", {"core"}},     {"pcl/", {"interop"}},
    {"nanoflann", {"align"}}};

struct Include {
  fs::path file;
  std::string header;
};

std::vector<fs::path> sources_below(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(kRoot / directory)) {
    const auto extension = entry.path().extension();
    if (extension == ".hpp" || extension == ".cpp") files.push_back(entry.path());
  }
  return files;
}

std::vector<Include> includes_of(const fs::path& file) {
  static const std::regex pattern(R"(^\s*#include\s+[<"]([^>"]+)[>"])");
  std::vector<Include> includes;
  std::ifstream stream(file);
  std::smatch match;
  for (std::string line; std::getline(stream, line);) {
    if (std::regex_search(line, match, pattern)) includes.push_back({file, match[1]});
  }
  return includes;
}

/// Second part of src/<module>/… or of include/gdfmap/<module>/…; "tools" for the program.
std::string module_of(const fs::path& file) {
  const fs::path relative = fs::relative(file, kRoot);
  auto part = relative.begin();
  if (*part == "tools") return "tools";
  part = std::next(part, *part == "include" ? 2 : 1);
  return part->string();
}

TEST(Architecture, ArrowsPointDown) {
  int num_checked = 0;
  for (const char* directory : {"src", "include"}) {
    for (const fs::path& file : sources_below(directory)) {
      const std::string from = module_of(file);
      ASSERT_TRUE(kLayers.contains(from)) << file << " is in no known module";
      for (const Include& include : includes_of(file)) {
        // Public headers are named gdfmap/module/…, a module's private ones module/….
        const bool is_public = include.header.starts_with("gdfmap/");
        const std::string path = is_public ? include.header.substr(7) : include.header;
        const std::string to = path.substr(0, path.find('/'));
        if (!is_public && (to == path || !kLayers.contains(to))) continue;
        ASSERT_TRUE(kLayers.contains(to)) << file << " includes " << include.header;
        EXPECT_TRUE(to == from || kLayers.at(to) < kLayers.at(from))
            << file << " (" << from << ") includes " << include.header;
        ++num_checked;
      }
    }
  }
  EXPECT_GT(num_checked, 100);
}

TEST(Architecture, ThirdPartyHeadersStayInOneModulesSources) {
  for (const char* directory : {"src", "include", "tools"}) {
    for (const fs::path& file : sources_below(directory)) {
      for (const Include& include : includes_of(file)) {
        for (const auto& [header, modules] : kThirdParty) {
          if (!include.header.starts_with(header)) continue;
          // The program's own headers are nobody's interface; those of interop are for programs
          // that have the library anyway.
          EXPECT_TRUE(file.extension() == ".cpp" || module_of(file) == "tools" ||
                      module_of(file) == "interop")
              << file << " includes " << include.header;
          EXPECT_TRUE(modules.contains(module_of(file))) << file << " includes " << include.header;
        }
      }
    }
  }
}

TEST(Architecture, PublicHeadersIncludeStdEigenAndGdfmapAlone) {
  for (const fs::path& file : sources_below("include")) {
    if (module_of(file) == "interop") continue;
    for (const Include& include : includes_of(file)) {
      const bool is_std = include.header.find_first_of("./") == std::string::npos;
      EXPECT_TRUE(is_std || include.header.starts_with("Eigen/") ||
                  include.header.starts_with("gdfmap/"))
          << file << " includes " << include.header;
    }
  }
}

TEST(Architecture, TheLibraryNeitherPrintsNorExits) {
  static const std::regex forbidden(
      R"(std::cout|std::cerr|[^nf]printf\(|\bputs\(|std::exit|[^_a-z]exit\(|\babort\(|getenv)");
  for (const char* directory : {"src", "include"}) {
    for (const fs::path& file : sources_below(directory)) {
      std::ifstream stream(file);
      int number = 0;
      for (std::string line; std::getline(stream, line);) {
        ++number;
        EXPECT_FALSE(std::regex_search(line, forbidden)) << file << ":" << number << ": " << line;
      }
    }
  }
}

TEST(Architecture, EveryHeaderOfAModuleHasItsPlace) {
  for (const fs::path& file : sources_below("include")) {
    const fs::path relative = fs::relative(file, kRoot);
    EXPECT_EQ(std::distance(relative.begin(), relative.end()), 4) << file;
  }
}

}  // namespace
