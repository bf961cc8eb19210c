#include <algorithm>
#include <fstream>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <yaml-cpp/yaml.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/configuration.hpp>

#include "configuration_fixture.hpp"
#include "support/map_fixture.hpp"

namespace gdfmap {
namespace {

using ConfigurationTest = test::ConfigurationFixture<load_configuration>;

/// The ancestor's file, every key of its README and of its own config.yaml.
constexpr const char* kAncestorsFile = R"(
io: {input_file: "/in.ply", output_base: "/out", export_csv: true, export_bin: false}
processing: {num_threads: 16, cube_size: 1.0}
downsampling: {step: 100}
trainer: {sample_points: 1000, mae_threshold_good: 0.03, mae_threshold_max: 0.30, edt_mode: "pure"}
solver: {max_iterations: 200, max_time_seconds: 0.3}
adaptive:
  populated_steps: [8, 16, 32]
  empty_steps: [2, 4, 8, 16]
  mae_threshold: 0.03
  empty_distance_threshold: 2.0
edt: {voxel_size: 0.05, margin_signed: 0.2, margin_pure: 0.25, edt_extension: 0.25,
      empty_search_margin: 0.25, empty_nearby_count: 100}
)";

TEST_F(ConfigurationTest, AcceptsTheAncestorsFile) {
  const Configuration c = load(kAncestorsFile);
  EXPECT_EQ(c.input_file, "/in.ply");
  EXPECT_EQ(c.output_base, "/out");
  EXPECT_TRUE(c.export_csv);
  EXPECT_FALSE(c.export_bin);
  EXPECT_EQ(c.num_threads, 16);
  const FitConfig fit = c.fit_config(1.0);
  EXPECT_EQ(fit.empty_steps, (std::vector<int>{2, 4, 8, 16}));
  EXPECT_EQ(fit.mae_threshold, 0.03);
  EXPECT_EQ(fit.empty_mae_threshold, 0.03) << "one threshold for all, as there";
  EXPECT_EQ(fit.max_iterations, 200);
}

TEST_F(ConfigurationTest, SaysOnceAndWhyWhatHasNoEffect) {
  const Configuration c = load(kAncestorsFile);
  const std::set<std::string> expected = {
      "downsampling.step",       "trainer.sample_points", "trainer.mae_threshold_good",
      "solver.max_time_seconds", "edt.voxel_size",        "edt.margin_signed",
      "edt.margin_pure",         "edt.edt_extension",     "edt.empty_search_margin",
      "edt.empty_nearby_count"};
  std::set<std::string> said;
  for (const std::string& notice : c.notices) {
    EXPECT_EQ(notice.find('\n'), std::string::npos);
    EXPECT_NE(notice.find(" has no effect: "), std::string::npos);
    said.insert(notice.substr(0, notice.find(' ')));
  }
  EXPECT_EQ(said, expected);
  EXPECT_EQ(c.notices.size(), expected.size());
}

TEST_F(ConfigurationTest, AnUnknownKeyNamesTheNearest) {
  EXPECT_NE(
      message_of("adaptive: {mae_treshold: 0.02}").find("did you mean adaptive.mae_threshold"),
      std::string::npos);
  EXPECT_NE(message_of("proccessing: {cube_size: 1}").find("did you mean processing.cube_size"),
            std::string::npos);
}

TEST_F(ConfigurationTest, ReportsAllViolationsAtOnceWithTheirPaths) {
  const std::string message = message_of(
      "processing: {cube_size: -1}\nadaptive: {populated_steps: [16, 8], mae_threshold: high}\n"
      "trainer: {edt_mode: signed}\nfit: {solver: magic}\n");
  for (const char* path : {"processing.cube_size", "adaptive.populated_steps",
                           "adaptive.mae_threshold", "trainer.edt_mode", "fit.solver"}) {
    EXPECT_NE(message.find(path), std::string::npos) << path << " in " << message;
  }
}

TEST_F(ConfigurationTest, RefusesNumbersOutOfRange) {
  message_of("processing: {cube_size: .nan}");
  message_of("processing: {num_threads: -1}");
  message_of("solver: {max_iterations: 0}");
  message_of("adaptive: {populated_steps: [8, 128]}");
  message_of("adaptive: {populated_steps: []}");
}

TEST_F(ConfigurationTest, RefusesWhatIsNoYamlAndWhatIsNotThere) {
  message_of("io: [unclosed");
  message_of("just text");
  try {
    load_configuration(directory_ / "none.yaml");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kIo);
  }
}

TEST_F(ConfigurationTest, EmptyCubesHaveAThresholdOfTheirOwn) {
  const FitConfig both =
      load("adaptive: {mae_threshold: 0.02, empty_mae_threshold: 0.01}").fit_config(1.0);
  EXPECT_EQ(both.mae_threshold, 0.02);
  EXPECT_EQ(both.empty_mae_threshold, 0.01);
}

TEST_F(ConfigurationTest, AnEmptyFileGivesTheDefaults) {
  EXPECT_EQ(load("").fit_config(2.0), FitConfig::defaults(2.0));
}

TEST_F(ConfigurationTest, TheDefaultFileHoldsTheDefaults) {
  const auto path = std::filesystem::path(GDFMAP_SOURCE_DIR) / "config/default.yaml";
  const Configuration c = load_configuration(path);
  EXPECT_EQ(c.fit_config(1.0), FitConfig::defaults(1.0));
  EXPECT_EQ(c.cube_size, 1.0);
  EXPECT_TRUE(c.notices.empty());
}

TEST_F(ConfigurationTest, TheSchemaKnowsTheSameKeys) {
  const auto path = std::filesystem::path(GDFMAP_SOURCE_DIR) / "schema/config.schema.json";
  const auto schema = nlohmann::json::parse(test::read_file(path));
  std::set<std::string> in_schema;
  for (const auto& [section, content] : schema["properties"].items()) {
    for (const auto& [key, entry] : content["properties"].items()) {
      in_schema.insert(section + "." + key);
    }
  }
  const auto keys = configuration_keys();
  EXPECT_EQ(in_schema, std::set<std::string>(keys.begin(), keys.end()));
}

TEST_F(ConfigurationTest, AnOverlongKeyIsToldShortAndOnOneLine) {
  const std::string message = message_of("\"" + std::string(100'000, 'k') + "\\nx\": 1");
  EXPECT_LT(message.size(), 300u);
  EXPECT_EQ(message_of("\"a\\nb\": 1").find('\n'), std::string::npos);
}

TEST_F(ConfigurationTest, TellsTwentyViolationsAndNoMore) {
  std::string yaml = "io:\n", sections;
  for (int i = 0; i < 1000; ++i) {
    yaml += "  unknown_" + std::to_string(i) + ": 1\n";
    sections += "unknown_" + std::to_string(i) + ": 1\n";
  }
  for (const std::string& text : {yaml, sections}) {
    const std::string message = message_of(text);
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 20) << message;
  }
}

TEST_F(ConfigurationTest, AFileTooLargeForAConfigurationIsRefused) {
  EXPECT_NE(message_of(std::string((1 << 20) + 1, '#')).find("too large"), std::string::npos);
  EXPECT_NO_THROW(load(std::string(1 << 20, '#')));
}

TEST_F(ConfigurationTest, ADirectoryCannotBeRead) {
  try {
    load_configuration(directory_.path());
    FAIL() << "a directory was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kIo);
  }
}

}  // namespace
}  // namespace gdfmap
