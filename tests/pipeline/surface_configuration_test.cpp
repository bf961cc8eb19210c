#include <fstream>
#include <set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <gdfmap/pipeline/surface_configuration.hpp>

#include "configuration_fixture.hpp"
#include "support/map_fixture.hpp"

namespace gdfmap {
namespace {

using SurfaceConfigurationTest = test::ConfigurationFixture<load_surface_configuration>;

constexpr const char* kIo = "io: {input_csv: a.bin, output_ply: a.ply}\n";

TEST_F(SurfaceConfigurationTest, AcceptsTheAncestorsFile) {
  const SurfaceConfiguration c = load(R"(
io: {input_csv: "/map.bin", output_ply: "/map.ply"}
reconstruction: {threshold: 0.1, resolution: 0.2, max_mae: 0.3}
region: {enabled: true, x_min: -1.0, x_max: 2.0, y_min: -3.0, y_max: 4.0, z_min: -5.0, z_max: 6.0}
blending: {enabled: true}
)");
  EXPECT_EQ(c.input, "/map.bin");
  EXPECT_EQ(c.output, "/map.ply");
  EXPECT_EQ(c.threshold, 0.1);
  EXPECT_EQ(c.range().resolution, 0.2);
  EXPECT_EQ(c.range().max_mae, 0.3);
  ASSERT_TRUE(c.range().region);
  EXPECT_EQ(c.range().region->min(), Vector3(-1, -3, -5));
  EXPECT_EQ(c.range().region->max(), Vector3(2, 4, 6));
  EXPECT_TRUE(c.notices.empty());
}

TEST_F(SurfaceConfigurationTest, ARegionThatIsNotEnabledIsNone) {
  const SurfaceConfiguration c =
      load(std::string(kIo) + "region: {enabled: false, x_min: 5.0, x_max: 1.0}");
  EXPECT_FALSE(c.range().region);
}

TEST_F(SurfaceConfigurationTest, SaysWhatHasNoEffect) {
  const SurfaceConfiguration c = load(std::string(kIo) + "blending: {enabled: false, margin: 0.2}");
  ASSERT_EQ(c.notices.size(), 2u);
  EXPECT_EQ(c.notices[0].find("blending.enabled has no effect: "), 0u);
  EXPECT_EQ(c.notices[1].find("blending.margin has no effect: "), 0u);
}

TEST_F(SurfaceConfigurationTest, RefusesWhatIsWrong) {
  EXPECT_NE(message_of(std::string(kIo) + "reconstruction: {treshold: 0.1}")
                .find("did you mean reconstruction.threshold"),
            std::string::npos);
  EXPECT_NE(message_of(std::string(kIo) + "blending: {enabled: perhaps}").find("blending.enabled"),
            std::string::npos);
  EXPECT_NE(message_of(std::string(kIo) + "region: {enabled: true, x_min: 1.0}").find("region"),
            std::string::npos);
  EXPECT_NE(message_of("io: {input_csv: a.bin}").find("io.output_ply"), std::string::npos);
  message_of(std::string(kIo) + "reconstruction: {resolution: .nan}");
}

TEST_F(SurfaceConfigurationTest, TheFileOfDefaultsHoldsTheDefaults) {
  const auto path = std::filesystem::path(GDFMAP_SOURCE_DIR) / "config/surface.yaml";
  const SurfaceConfiguration c = load_surface_configuration(path);
  EXPECT_EQ(c.threshold, SurfacePointsOptions{}.threshold);
  EXPECT_EQ(c.range().resolution, SurfaceRange{}.resolution);
  EXPECT_EQ(c.range().max_mae, SurfaceRange{}.max_mae);
  EXPECT_FALSE(c.range().region);
  EXPECT_TRUE(c.notices.empty());
}

TEST_F(SurfaceConfigurationTest, TheSchemaKnowsTheSameKeys) {
  const auto path = std::filesystem::path(GDFMAP_SOURCE_DIR) / "schema/surface.schema.json";
  const auto schema = nlohmann::json::parse(test::read_file(path));
  std::set<std::string> in_schema;
  for (const auto& [section, content] : schema["properties"].items()) {
    for (const auto& [key, entry] : content["properties"].items()) {
      in_schema.insert(section + "." + key);
    }
  }
  const auto keys = surface_configuration_keys();
  EXPECT_EQ(in_schema, std::set<std::string>(keys.begin(), keys.end()));
}

}  // namespace
}  // namespace gdfmap
