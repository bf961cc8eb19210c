#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/pipeline/slice_image.hpp>

#include "../../src/pipeline/drawing/color_map.hpp"
#include "../../src/pipeline/drawing/contour_labels.hpp"
#include "../../src/pipeline/drawing/contours.hpp"
#include "../../src/pipeline/drawing/distance_scale.hpp"
#include "../../src/pipeline/drawing/layout.hpp"
#include "../../src/pipeline/drawing/ticks.hpp"
#include "picture.hpp"

namespace gdfmap {
namespace {

using namespace drawing;
using test::Picture;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class SliceImageTest : public ::testing::Test {
 protected:
  SliceImageTest() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::path(::testing::TempDir()) /
                 ("slice_" + std::to_string(::getpid()) + "_" + info->name());
    std::filesystem::create_directories(directory_);
    png_ = directory_ / "slice.png";
  }
  ~SliceImageTest() override { std::filesystem::remove_all(directory_); }

  std::filesystem::path directory_, png_;
};

/// A slice whose distances are a function of the sample's place.
template <typename Function>
SliceImage make_slice(int width, int height, const Function& distance) {
  SliceImage slice;
  slice.width = width;
  slice.height = height;
  slice.title = "a slice";
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < width; ++i) slice.distance.push_back(static_cast<float>(distance(i, j)));
  }
  return slice;
}

SliceImage ramp(int width = 200, int height = 100) {
  return make_slice(width, height, [&](int i, int) { return 2.0 * i / (width - 1); });
}

FigureLayout layout_of(const SliceImage& slice) {
  return make_layout(slice, distance_scale(slice));
}

/// The pixel in the middle of a sample.
struct Place {
  int x, y;
};
Place place_of(const FigureLayout& layout, int i, int j) {
  const int s = layout.pixels_per_sample;
  return {static_cast<int>(layout.plot.x) + i * s + s / 2,
          static_cast<int>(layout.plot.bottom()) - 1 - j * s - s / 2};
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_F(SliceImageTest, HasTheSizeOfItsLayout) {
  for (const auto& [width, height] : {std::pair{100, 100}, {900, 300}, {30, 700}, {1, 1}, {5, 1}}) {
    const SliceImage slice = ramp(std::max(width, 2), height);
    draw_slice(slice, png_);
    const Picture picture(png_);
    const FigureLayout layout = layout_of(slice);
    EXPECT_EQ(picture.width(), layout.width);
    EXPECT_EQ(picture.height(), layout.height);
    EXPECT_GE(layout.plot.width, 30.0);
    EXPECT_LT(layout.plot.right(), layout.width);
    EXPECT_LT(layout.plot.bottom(), layout.height);
  }
}

TEST_F(SliceImageTest, GivesTheSameBytesTwice) {
  draw_slice(ramp(), png_);
  const std::string first = bytes_of(png_);
  draw_slice(ramp(), png_);
  EXPECT_EQ(bytes_of(png_), first);
  EXPECT_EQ(first.substr(1, 3), "PNG");
}

TEST_F(SliceImageTest, ColoursDistancesByTheScale) {
  const SliceImage slice = ramp();
  draw_slice(slice, png_);
  const Picture picture(png_);
  const DistanceScale scale = distance_scale(slice);
  const FigureLayout layout = layout_of(slice);
  EXPECT_EQ(scale.end, 2.0);
  double last = -1.0;
  for (int i = 10; i < slice.width; i += 5) {
    const double distance = 2.0 * i / (slice.width - 1);
    const double from_line =
        std::abs(distance / scale.iso_step - std::round(distance / scale.iso_step));
    if (from_line < 0.1) continue;
    const auto [x, y] = place_of(layout, i, 10);
    const Color seen = picture.color(x, y), expected = scale.color(distance);
    EXPECT_NEAR(seen.red, expected.red, 0.02);
    EXPECT_NEAR(seen.green, expected.green, 0.02);
    EXPECT_NEAR(seen.blue, expected.blue, 0.02);
    EXPECT_GT(luminance(seen), last);
    last = luminance(seen);
  }
}

TEST_F(SliceImageTest, PutsTheFirstRowBelow) {
  const SliceImage slice = make_slice(50, 50, [](int, int j) { return 0.5 + j; });
  draw_slice(slice, png_);
  const Picture picture(png_);
  const FigureLayout layout = layout_of(slice);
  const auto low = place_of(layout, 25, 2), high = place_of(layout, 25, 47);
  EXPECT_LT(luminance(picture.color(low.x, low.y)), luminance(picture.color(high.x, high.y)));
}

TEST_F(SliceImageTest, DrawsTheSurfaceBlack) {
  const SliceImage slice =
      make_slice(100, 100, [](int i, int) { return 0.05 * std::abs(i - 40) + 0.01; });
  draw_slice(slice, png_);
  const Picture picture(png_);
  const auto [x, y] = place_of(layout_of(slice), 40, 77);
  EXPECT_EQ(picture.pixel(x, y), 0u);
}

std::set<std::uint32_t> colors_around(const Picture& picture, const FigureLayout& layout, int i,
                                      int j) {
  std::set<std::uint32_t> colors;
  const auto [x, y] = place_of(layout, i, j);
  for (int dy = -15; dy <= 15; ++dy) {
    for (int dx = -15; dx <= 15; ++dx) colors.insert(picture.pixel(x + dx, y + dy));
  }
  return colors;
}

bool is_grey(std::uint32_t pixel) {
  return (pixel >> 16) == (pixel & 255) && (pixel >> 8 & 255) == (pixel & 255);
}

TEST_F(SliceImageTest, HatchesWhatIsUnknown) {
  const SliceImage slice =
      make_slice(100, 100, [](int i, int) { return i < 50 ? 0.37 : static_cast<double>(kNan); });
  draw_slice(slice, png_);
  const Picture picture(png_);
  const FigureLayout layout = layout_of(slice);
  const auto unknown = colors_around(picture, layout, 75, 50);
  EXPECT_GT(unknown.size(), 1u);
  EXPECT_TRUE(std::all_of(unknown.begin(), unknown.end(), is_grey));
  const auto known = colors_around(picture, layout, 25, 50);
  EXPECT_EQ(known.size(), 1u);
  EXPECT_FALSE(is_grey(*known.begin()));
}

TEST_F(SliceImageTest, DrawsLowerBoundsPalerAndHatched) {
  SliceImage slice = make_slice(100, 100, [](int i, int) { return i == 0 ? 1.0 : 0.47; });
  slice.is_bound.assign(slice.distance.size(), 0);
  for (std::size_t k = 0; k < slice.is_bound.size(); ++k) slice.is_bound[k] = k % 100 >= 50 ? 1 : 0;
  draw_slice(slice, png_);
  const Picture picture(png_);
  const FigureLayout layout = layout_of(slice);
  const auto estimate = colors_around(picture, layout, 25, 50);
  const auto bound = colors_around(picture, layout, 75, 50);
  EXPECT_EQ(estimate.size(), 1u);
  EXPECT_GT(bound.size(), 1u);
  const auto [x, y] = place_of(layout, 25, 50);
  const auto [bx, by] = place_of(layout, 75, 50);
  for (int dx = -10; dx <= 10; ++dx) {
    EXPECT_GT(luminance(picture.color(bx + dx, by)), luminance(picture.color(x, y)) + 0.1);
  }
}

TEST_F(SliceImageTest, ExplainsOnlyWhatItShows) {
  const auto kinds_of = [](const SliceImage& slice) {
    std::set<LegendKind> kinds;
    for (const LegendEntry& entry : layout_of(slice).legend) kinds.insert(entry.kind);
    return kinds;
  };
  SliceImage slice = make_slice(10, 10, [](int, int) { return 1.0; });
  EXPECT_EQ(kinds_of(slice), (std::set{LegendKind::kIsoLine}));
  slice.distance[3] = kNan;
  slice.distance[5] = 0.0f;
  slice.is_bound.assign(slice.distance.size(), 0);
  slice.is_bound[7] = 1;
  EXPECT_EQ(kinds_of(slice), (std::set{LegendKind::kSurface, LegendKind::kIsoLine,
                                       LegendKind::kUnknown, LegendKind::kBound}));
}

TEST_F(SliceImageTest, SurvivesSlicesWithNothingToShow) {
  draw_slice(make_slice(20, 20, [](int, int) { return static_cast<double>(kNan); }), png_);
  draw_slice(make_slice(20, 20, [](int, int) { return 0.0; }), png_);
  SliceImage bounds = make_slice(20, 20, [](int i, int) { return i; });
  bounds.is_bound.assign(bounds.distance.size(), 1);
  draw_slice(bounds, png_);
  SliceImage titled = make_slice(2, 300, [](int i, int) { return i; });
  titled.title = std::string(400, 'm');
  draw_slice(titled, png_);
  EXPECT_EQ(Picture(png_).width(), layout_of(titled).width);
}

/// Distances to two points, with their gradient; a strip unknown, another one a bound.
SliceImage two_cones() {
  SliceImage slice = make_slice(80, 60, [](int i, int j) {
    return 0.05 * std::min(std::hypot(i - 20, j - 30), std::hypot(i - 60, j - 30));
  });
  slice.is_bound.assign(slice.distance.size(), 0);
  for (int j = 0; j < 60; ++j) {
    for (int i = 0; i < 80; ++i) {
      const double x = i < 40 ? i - 20 : i - 60, y = j - 30;
      const double norm = std::max(std::hypot(x, y), 1e-9);
      slice.gradient_u.push_back(static_cast<float>(x / norm));
      slice.gradient_v.push_back(static_cast<float>(y / norm));
      const auto n = static_cast<std::size_t>(80 * j + i);
      if (j < 6) slice.distance[n] = kNan;
      if (j >= 54) slice.is_bound[n] = 1;
    }
  }
  return slice;
}

TEST_F(SliceImageTest, LooksAsItDid) {
  draw_slice(two_cones(), png_);
  test::expect_golden(png_, "slice");
}

TEST_F(SliceImageTest, ArrowsPointAlongTheGradient) {
  SliceImage slice = make_slice(60, 60, [](int, int) { return 0.99; });
  slice.gradient_u.assign(slice.distance.size(), 1.0f);
  slice.gradient_v.assign(slice.distance.size(), 0.0f);
  draw_slice(slice, png_);
  const Picture picture(png_);
  const FigureLayout layout = layout_of(slice);
  // Rows of black shafts and heads: seen along the arrows more is black than across them.
  std::size_t longest_row = 0, longest_column = 0;
  const int size = static_cast<int>(layout.plot.width) - 8;
  const auto is_black = [&](int x, int y) {
    return luminance(picture.color(static_cast<int>(layout.plot.x) + 4 + x,
                                   static_cast<int>(layout.plot.y) + 4 + y)) < 0.05;
  };
  for (int a = 0; a < size; ++a) {
    std::size_t row = 0, column = 0;
    for (int b = 0; b < size; ++b) {
      row += is_black(b, a) ? 1 : 0;
      column += is_black(a, b) ? 1 : 0;
    }
    longest_row = std::max(longest_row, row);
    longest_column = std::max(longest_column, column);
  }
  EXPECT_GT(longest_row, static_cast<std::size_t>(size) / 2);
  EXPECT_LT(longest_column, static_cast<std::size_t>(size) / 3);
}

ErrorCode code_of(const SliceImage& slice, const std::filesystem::path& path) {
  try {
    draw_slice(slice, path);
  } catch (const Error& error) {
    return error.code();
  }
  ADD_FAILURE() << "no error";
  return ErrorCode::kInternal;
}

TEST_F(SliceImageTest, RefusesWhatCannotBeDrawn) {
  SliceImage slice = ramp();
  slice.distance.pop_back();
  EXPECT_EQ(code_of(slice, png_), ErrorCode::kUsage);
  slice = ramp();
  slice.is_bound.resize(7);
  EXPECT_EQ(code_of(slice, png_), ErrorCode::kUsage);
  slice = ramp();
  slice.gradient_u.resize(slice.distance.size());
  EXPECT_EQ(code_of(slice, png_), ErrorCode::kUsage);
  for (const double resolution : {0.0, -1.0, static_cast<double>(NAN)}) {
    slice = ramp();
    slice.resolution = resolution;
    EXPECT_EQ(code_of(slice, png_), ErrorCode::kUsage);
  }
  EXPECT_EQ(code_of(SliceImage{}, png_), ErrorCode::kUsage);
  EXPECT_EQ(code_of(ramp(kMaxPictureSide + 1, 1), png_), ErrorCode::kUsage);
  EXPECT_EQ(code_of(ramp(kMaxPictureSide, 1), png_), ErrorCode::kUsage);  // with its margins
  EXPECT_FALSE(std::filesystem::exists(png_));
}

TEST_F(SliceImageTest, FailsWithThePathWhereItCannotWrite) {
  const auto path = directory_ / "none" / "slice.png";
  EXPECT_EQ(code_of(ramp(), path), ErrorCode::kIo);
  EXPECT_TRUE(std::filesystem::is_empty(directory_));
}

TEST(DistanceScale, DrawsFewerIsoLinesWhereTheyWouldTouch) {
  SliceImage slice = ramp(1000, 10);  // up to 2 m
  const DistanceScale fine = distance_scale(slice);
  EXPECT_DOUBLE_EQ(fine.tick_step, 0.5);
  EXPECT_DOUBLE_EQ(fine.iso_step, 0.5);
  slice.resolution = 0.1;  // a picture of 100 m
  const DistanceScale coarse = distance_scale(slice);
  EXPECT_DOUBLE_EQ(coarse.tick_step, 0.5);
  EXPECT_DOUBLE_EQ(coarse.iso_step, 1.0);
  slice.resolution = 1.0;
  EXPECT_TRUE(distance_scale(slice).iso_levels().empty());
}

TEST(ColorMap, GrowsEvenlyInLightnessWithinSrgb) {
  double last = 0.0;
  for (int i = 0; i <= 1000; ++i) {
    const Color c = color_at(i / 1000.0);
    for (const double channel : {c.red, c.green, c.blue}) {
      EXPECT_GE(channel, 0.0);
      EXPECT_LE(channel, 1.0);
    }
    EXPECT_GT(luminance(c), last);
    last = luminance(c);
    // The cube root of luminance is lightness: even steps.
    EXPECT_NEAR(std::cbrt(last), 0.21 + 0.745 * i / 1000.0, 0.03) << i;
  }
  EXPECT_EQ(luminance(color_at(-1.0)), luminance(color_at(0.0)));
  EXPECT_EQ(luminance(color_at(2.0)), luminance(color_at(1.0)));
}

/// What an eye without green cones sees (Viénot, Brettel, Mollon 1999), in linear light.
double deuteranope_luminance(const Color& color) {
  const auto linear = [](double srgb) {
    return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
  };
  const double red = linear(color.red), green = linear(color.green), blue = linear(color.blue);
  const double yellow = 0.29275 * red + 0.70725 * green;
  return 0.93 * yellow + 0.07 * (-0.02234 * red + 0.02234 * green + blue);
}

TEST(ColorMap, KeepsItsOrderForEyesThatTellNoRedFromGreen) {
  double last = 0.0;
  for (int i = 0; i <= 100; ++i) {
    const double seen = std::cbrt(deuteranope_luminance(color_at(i / 100.0)));
    EXPECT_GT(seen, last + 0.003) << i;
    last = seen;
  }
}

TEST(Contours, RunAroundACircle) {
  constexpr int kSide = 80;
  const SliceImage slice =
      make_slice(kSide, kSide, [](int i, int j) { return std::hypot(i - 40.2, j - 39.7); });
  const auto lines = contours({slice.distance, kSide, kSide}, 20.0);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(lines[0].front().x, lines[0].back().x);
  EXPECT_EQ(lines[0].front().y, lines[0].back().y);
  double length = 0.0;
  for (std::size_t k = 0; k < lines[0].size(); ++k) {
    const Point p = lines[0][k];
    EXPECT_NEAR(std::hypot(p.x - 40.2, p.y - 39.7), 20.0, 0.02);
    if (k > 0) length += std::hypot(p.x - lines[0][k - 1].x, p.y - lines[0][k - 1].y);
  }
  EXPECT_NEAR(length, 40.0 * M_PI, 0.5);
}

TEST(Contours, EndAtUnknownSamplesAndAtTheRim) {
  SliceImage slice = make_slice(20, 20, [](int, int j) { return j; });
  EXPECT_EQ(contours({slice.distance, 20, 20}, 7.5).size(), 1u);
  slice.distance[7 * 20 + 10] = kNan;
  const auto lines = contours({slice.distance, 20, 20}, 7.5);
  ASSERT_EQ(lines.size(), 2u);
  for (const Polyline& line : lines) {
    for (const Point& p : line) EXPECT_DOUBLE_EQ(p.y, 7.5);
  }
}

TEST(Contours, JoinTheCornersOfASaddleThatAgreeWithItsCentre) {
  const std::vector<float> values = {1.0f, 0.0f, 0.0f, 0.9f};
  for (const double level : {0.4, 0.6}) {
    const auto lines = contours({values, 2, 2}, level);
    ASSERT_EQ(lines.size(), 2u);
    for (const Polyline& line : lines) {
      ASSERT_EQ(line.size(), 2u);
      // Above the level of the centre (0.475) the high corners are cut off, else the low ones.
      const double sum = line[0].x + line[0].y + line[1].x + line[1].y;
      const double slope = (line[1].y - line[0].y) / (line[1].x - line[0].x);
      EXPECT_EQ(slope<0.0, level> 0.475) << sum;
    }
  }
}

TEST(ContourLabels, StandOnStraightPartsApartFromEachOther) {
  std::vector<LabelledLine> lines;
  for (int k = 0; k < 30; ++k) {
    LabelledLine line;
    line.text = "0.5";
    for (int i = 0; i <= 100; ++i) {
      line.points.push_back({100.0 + 5.0 * i, 100.0 + 4.0 * k + (i < 30 ? 6.0 * (i % 2) : 0.0)});
    }
    lines.push_back(line);
  }
  place_labels(lines, {0.0, 0.0, 700.0, 400.0}, 10.0);
  std::vector<Point> centres;
  for (const LabelledLine& line : lines) {
    if (!line.has_label) continue;
    EXPECT_GT(line.label_centre.x, 240.0);  // not in the zigzag
    EXPECT_NEAR(line.label_angle, 0.0, 1e-12);
    for (const Point& other : centres) {
      EXPECT_GE(std::hypot(line.label_centre.x - other.x, line.label_centre.y - other.y), 70.0);
    }
    centres.push_back(line.label_centre);
    const auto parts = pieces(line);
    ASSERT_EQ(parts.size(), 2u);
    EXPECT_NEAR(parts[1].front().x - parts[0].back().x, line.gap_end - line.gap_begin, 1e-9);
  }
  EXPECT_GE(centres.size(), 2u);
}

TEST(Ticks, AreRoundNumbersWithTheDecimalsTheyNeed) {
  EXPECT_DOUBLE_EQ(round_step(0.13), 0.2);
  EXPECT_DOUBLE_EQ(round_step(0.021), 0.025);
  EXPECT_DOUBLE_EQ(round_step(5.1), 10.0);
  EXPECT_DOUBLE_EQ(round_step(1.0), 1.0);
  EXPECT_DOUBLE_EQ(round_end(static_cast<double>(0.4f)), 0.4);
  EXPECT_DOUBLE_EQ(round_end(9.2), 10.0);
  EXPECT_EQ(label_of(0.25, 0.25), "0.25");
  EXPECT_EQ(label_of(-3.0, 1.0), "\u22123");
  EXPECT_EQ(label_of(-1e-17, 0.5), "0.0");
  EXPECT_EQ(label_of(1200.0, 200.0), "1200");
  const auto ticks = multiples(-0.31, 0.2, 0.1);
  ASSERT_EQ(ticks.size(), 6u);
  EXPECT_NEAR(ticks.front(), -0.3, 1e-12);
  EXPECT_NEAR(ticks.back(), 0.2, 1e-12);
}

}  // namespace
}  // namespace gdfmap
