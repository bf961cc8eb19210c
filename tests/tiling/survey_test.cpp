// Sensors of sources, alignment, and clouds that are published together.

#include <gtest/gtest.h>

#include <gdfmap/tiling/ingest.hpp>

#include "tiling_fixtures.hpp"

namespace gdfmap {
namespace {

using SurveyTest = TilingTest;

Eigen::Isometry3d quarter_turn(const Vector3& translation) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(std::acos(0.0), Vector3::UnitZ()).toRotationMatrix();
  T.translation() = translation;
  return T;
}

IngestOptions seen_from(const Vector3& p_source) {
  IngestOptions options;
  options.sensor_origin_source = p_source;
  return options;
}

TEST_F(SurveyTest, TheSensorMovesWithThePoints) {
  PointStore store = create();
  IngestOptions options = seen_from({2.0, 0.0, 1.0});
  options.transform = {.scale = 0.5, .T_map_source = quarter_turn({10.0, 20.0, 30.0})};
  const auto origin = ingest({{4, 0, 2}}, store, options).source.sensor_origin;
  ASSERT_TRUE(origin);
  EXPECT_LT((*origin - Vector3(10.0, 21.0, 30.5)).norm(), 1e-12);
  EXPECT_EQ(store.sources()[0].sensor_origin, origin);
}

TEST_F(SurveyTest, WhatTheFileStatesOfItsSensorIsOverruledByTheOptions) {
  PointStore store = create();
  for (const bool overruled : {false, true}) {
    MemoryReader reader({{1, 2, overruled ? 4.0 : 3.0}});
    reader.state_sensor({5, 6, 7});
    const auto options = overruled ? seen_from({0, 0, 1}) : IngestOptions{};
    const auto report = ingest_points(reader, "memory", kLattice, store, options, {});
    EXPECT_EQ(report.source.sensor_origin, overruled ? Vector3(0, 0, 1) : Vector3(5, 6, 7));
  }
  EXPECT_FALSE(ingest({{8, 8, 8}}, store).source.sensor_origin);
}

TEST_F(SurveyTest, WhereTheSensorStoodChangesNeitherIdentityNorDigests) {
  const std::vector<Vector3> cloud = wavy_surface(5000, 1);
  PointStore without = create("without.db"), with = create("with.db");
  const SourceRecord plain = ingest(cloud, without).source;
  const SourceRecord seen = ingest(cloud, with, seen_from({1, 2, 3})).source;
  EXPECT_EQ(plain.identity, seen.identity);
  EXPECT_TRUE(content_of(without) == content_of(with));
}

TEST_F(SurveyTest, ItCanBeToldLaterWhereTheSensorStood) {
  PointStore store = create();
  ingest({{4, 0, 2}}, store);
  const IngestReport told = ingest({{4, 0, 2}}, store, seen_from({1, 2, 3}));
  EXPECT_TRUE(told.already_present);
  EXPECT_TRUE(told.sensor_origin_changed);
  EXPECT_EQ(store.sources()[0].sensor_origin, Vector3(1, 2, 3));
  EXPECT_FALSE(ingest({{4, 0, 2}}, store, seen_from({1, 2, 3})).sensor_origin_changed);
  // Saying nothing takes nothing back.
  EXPECT_FALSE(ingest({{4, 0, 2}}, store).sensor_origin_changed);
  EXPECT_EQ(store.sources()[0].sensor_origin, Vector3(1, 2, 3));
}

TEST_F(SurveyTest, ASensorNowhereIsRefused) {
  PointStore store = create();
  EXPECT_EQ(error_of([&] {
              ingest({{4, 0, 2}}, store, seen_from({1, std::nan(""), 3}));
            }).code(),
            ErrorCode::kUsage);
  EXPECT_TRUE(store.sources().empty());
}

TEST_F(SurveyTest, AnAlignmentMovesThePointsAfterTheTransformAndIsKept) {
  const std::vector<Vector3> cloud = wavy_surface(5000, 2);
  const Eigen::Isometry3d correction = quarter_turn({0.5, -0.25, 0.125});
  IngestOptions nominal = seen_from({1, 0, 0});
  nominal.transform.T_map_source = quarter_turn({100, 0, 0});
  IngestOptions composed = nominal;
  composed.transform.T_map_source = correction * nominal.transform.T_map_source;
  IngestOptions aligned = nominal;
  aligned.alignment = Alignment{"ndt", correction, 0.75, 0.0125};

  PointStore expected = create("expected.db"), store = create();
  const SourceRecord source = ingest(cloud, store, aligned).source;
  const SourceRecord direct = ingest(cloud, expected, composed).source;
  EXPECT_TRUE(content_of(store) == content_of(expected));
  EXPECT_EQ(source.sensor_origin, direct.sensor_origin);
  EXPECT_EQ(source.parameters, nominal.canonical() + " align=ndt");
  EXPECT_TRUE(store.sources()[0].alignment.starts_with("method=ndt T_map_nominal="));
  EXPECT_TRUE(store.sources()[0].alignment.ends_with(" inlier_ratio=0.75 rmse=0.0125"));
  // What registration finds is not asked for: the same cloud is known before it is registered.
  aligned.alignment->T_map_nominal = Eigen::Isometry3d::Identity();
  EXPECT_TRUE(ingest(cloud, store, aligned).already_present);
}

TEST_F(SurveyTest, CloudsAreVisibleTogether) {
  PointStore store = create();
  const RunContext context;
  SurveyIngest survey(kLattice, store, context);
  for (const std::uint32_t seed : {1u, 2u, 2u}) {
    MemoryReader reader(wavy_surface(3000, seed));
    survey.stage(reader, "scan" + std::to_string(seed), {});
    EXPECT_TRUE(PointStore(path(), db::OpenMode::kRead).sources().empty());
  }
  const std::vector<IngestReport> reports = survey.publish();
  ASSERT_EQ(reports.size(), 3U);
  EXPECT_FALSE(reports[1].already_present);
  EXPECT_TRUE(reports[2].already_present);  // the same cloud twice in one survey
  EXPECT_EQ(reports[2].source.id, reports[1].source.id);
  EXPECT_EQ(store.sources().size(), 2U);

  PointStore one_by_one = create("other.db");
  for (const std::uint32_t seed : {1u, 2u}) ingest(wavy_surface(3000, seed), one_by_one);
  EXPECT_TRUE(content_of(store) == content_of(one_by_one));
}

TEST_F(SurveyTest, ASurveyThatIsGivenUpLeavesNothing) {
  PointStore store = create();
  ingest(wavy_surface(3000, 7), store);
  const Content before = content_of(store);
  {
    const RunContext context;
    SurveyIngest survey(kLattice, store, context);
    MemoryReader reader(wavy_surface(3000, 1));
    survey.stage(reader, "scan", {});
  }
  EXPECT_TRUE(content_of(store) == before);
  db::Database database(path(), db::OpenMode::kRead);
  EXPECT_EQ(database.query_int("SELECT count(*) FROM sources"), 1);
  EXPECT_EQ(database.query_int("SELECT count(DISTINCT source) FROM blocks"), 1);
}

}  // namespace
}  // namespace gdfmap
