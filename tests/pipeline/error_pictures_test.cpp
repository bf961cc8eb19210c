#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/pipeline/error_map.hpp>
#include <gdfmap/pipeline/error_plot.hpp>

#include "picture.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

JudgedSample sample_at(double x, double distance, double error, FieldStatus status, int level = 0) {
  JudgedSample sample;
  sample.p_world = Vector3(x, 2.0, -3.0);
  sample.distance = distance;
  sample.weight = 1.0;
  sample.level = level;
  sample.answer = {distance + error, Vector3::UnitX(), status, 0.01};
  return sample;
}

/// What one vertex of the file holds after x, y and z.
struct Vertex {
  double x;
  std::uint8_t red, green, blue;
  float error, distance, weight;
  std::int8_t level;
  std::uint8_t status;
};

Vertex vertex_of(const std::string& file, std::size_t i) {
  constexpr std::size_t kSize = 3 * 8 + 3 + 3 * 4 + 2;
  const std::size_t body = file.find("end_header\n") + 11;
  const auto* const at = reinterpret_cast<const std::byte*>(file.data()) + body + i * kSize;
  return {load<double>(at),
          load<std::uint8_t>(at + 24),
          load<std::uint8_t>(at + 25),
          load<std::uint8_t>(at + 26),
          load<float>(at + 27),
          load<float>(at + 31),
          load<float>(at + 35),
          load<std::int8_t>(at + 39),
          load<std::uint8_t>(at + 40)};
}

class ErrorPicturesTest : public testing::Test {
 protected:
  test::TemporaryDirectory directory_;
};

TEST_F(ErrorPicturesTest, MapHoldsEverySampleWithItsError) {
  const std::vector<JudgedSample> samples = {
      sample_at(1.0, 0.5, 0.001, FieldStatus::kFine),
      sample_at(2.0, 0.25, -0.1, FieldStatus::kFine),
      sample_at(3.0, 7.0, -0.5, FieldStatus::kCoarse, 1),
      sample_at(4.0, 9.0, -4.0, FieldStatus::kFar, kNoLevel)};
  ErrorMapWriter writer(directory_ / "e.ply", 1.0);
  writer.add(std::span(samples).first(1));
  writer.add(std::span(samples).subspan(1));
  writer.finish();

  const std::string file = test::read_file(directory_ / "e.ply");
  const Vertex small = vertex_of(file, 0), large = vertex_of(file, 1);
  EXPECT_EQ(small.x, 1.0);
  EXPECT_NEAR(small.error, 0.001f, 1e-6f);
  EXPECT_NEAR(large.error, -0.1f, 1e-6f);
  EXPECT_EQ(large.weight, 1.0f);
  EXPECT_EQ(large.distance, 0.25f);
  EXPECT_GT(large.red + large.green + large.blue, small.red + small.green + small.blue + 300);
  const Vertex coarse = vertex_of(file, 2), far = vertex_of(file, 3);
  EXPECT_EQ(coarse.level, 1);
  EXPECT_EQ(coarse.status, 1);
  EXPECT_EQ(far.level, kNoLevel);
  EXPECT_EQ(far.status, 2);
  EXPECT_TRUE(std::isnan(far.error));
  EXPECT_TRUE(far.red == far.green && far.green == far.blue);

  const auto reader = open_point_cloud(directory_ / "e.ply");
  std::vector<Vector3> points(10);
  ASSERT_EQ(reader->read(points), 4u);
  EXPECT_EQ(points[3], Vector3(4.0, 2.0, -3.0));
}

TEST_F(ErrorPicturesTest, MapAppearsWholeOrNotAtAll) {
  {
    ErrorMapWriter writer(directory_ / "e.ply", 1.0);
    writer.add(std::vector{sample_at(1.0, 0.5, 0.001, FieldStatus::kFine)});
  }
  EXPECT_TRUE(std::filesystem::is_empty(directory_.path()));
  EXPECT_THROW(ErrorMapWriter(directory_ / "e.las", 1.0), Error);
}

/// Errors around `scale · distance`, spread evenly over a decade.
void add_decade(ErrorPlot& plot, int level, double scale) {
  std::vector<JudgedSample> samples;
  const FieldStatus status = level == 0 ? FieldStatus::kFine : FieldStatus::kCoarse;
  for (int i = 0; i < 4000; ++i) {
    const double distance = std::pow(10.0, -2.0 + (i % 100) / 50.0 + level);
    const double error = scale * distance * std::pow(10.0, (i / 100 + 0.5) / 40.0 - 0.5);
    samples.push_back(sample_at(0.0, distance, error, status, level));
  }
  plot.add(samples);
}

TEST_F(ErrorPicturesTest, PlotLooksAsItDid) {
  ErrorPlot plot;
  add_decade(plot, 0, 0.01);
  add_decade(plot, 1, 0.03);
  plot.write(directory_ / "e.png");
  test::expect_golden(directory_ / "e.png", "error_plot");
}

TEST_F(ErrorPicturesTest, PlotOfNothingIsRefused) {
  ErrorPlot plot;
  plot.add(std::vector{sample_at(1.0, 0.5, 0.001, FieldStatus::kFar)});
  EXPECT_THROW(plot.write(directory_ / "e.png"), Error);
}

TEST_F(ErrorPicturesTest, PlotOfExactAnswersIsDrawn) {
  ErrorPlot plot;
  plot.add(std::vector(30, sample_at(1.0, 0.5, 0.0, FieldStatus::kFine)));
  plot.write(directory_ / "e.png");
  EXPECT_GT(test::Picture(directory_ / "e.png").width(), 100);
}

TEST(ErrorHistogram, TellsWeightedPercentiles) {
  ErrorPlot::Histogram histogram;
  for (int i = 0; i < 100; ++i) histogram.add(0.001, 1.0);
  histogram.add(0.1, 100.0);
  histogram.add(1.0, 10.0);
  EXPECT_NEAR(histogram.percentile(0.25), 0.001, 0.0002);
  EXPECT_NEAR(histogram.percentile(0.7), 0.1, 0.015);
  EXPECT_NEAR(histogram.percentile(0.99), 1.0, 0.15);
  EXPECT_NEAR(histogram.mean(), (0.1 + 10.0 + 10.0) / 210.0, 1e-12);
  EXPECT_EQ(histogram.num_samples(), 102u);
}

}  // namespace
}  // namespace gdfmap
