#include "picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>

#include <cairo.h>
#include <gtest/gtest.h>

/// fontconfig keeps its parsed configuration until the process ends, which the leak checker
/// reports.
extern "C" const char* __lsan_default_suppressions() { return "leak:libfontconfig\n"; }

namespace gdfmap::test {
namespace {

constexpr int kBlur = 4;
constexpr double kTolerance = 0.1;

drawing::Color mean_color(const Picture& picture, int x0, int y0) {
  drawing::Color sum;
  for (int y = y0; y < y0 + kBlur; ++y) {
    for (int x = x0; x < x0 + kBlur; ++x) {
      const drawing::Color c = picture.color(x, y);
      sum = {sum.red + c.red, sum.green + c.green, sum.blue + c.blue};
    }
  }
  constexpr double n = kBlur * kBlur;
  return {sum.red / n, sum.green / n, sum.blue / n};
}

}  // namespace

Picture::Picture(const std::filesystem::path& path)
    : surface_(cairo_image_surface_create_from_png(path.c_str())) {
  EXPECT_EQ(cairo_surface_status(surface_), CAIRO_STATUS_SUCCESS) << path;
}

Picture::~Picture() { cairo_surface_destroy(surface_); }

int Picture::width() const { return cairo_image_surface_get_width(surface_); }
int Picture::height() const { return cairo_image_surface_get_height(surface_); }

std::uint32_t Picture::pixel(int x, int y) const {
  const unsigned char* const row =
      cairo_image_surface_get_data(surface_) +
      static_cast<std::ptrdiff_t>(y) * cairo_image_surface_get_stride(surface_);
  std::uint32_t value = 0;
  std::memcpy(&value, row + 4 * static_cast<std::ptrdiff_t>(x), sizeof(value));
  return value & 0xffffffu;
}

drawing::Color Picture::color(int x, int y) const {
  const std::uint32_t v = pixel(x, y);
  return {(v >> 16) / 255.0, (v >> 8 & 255) / 255.0, (v & 255) / 255.0};
}

void expect_golden(const std::filesystem::path& picture, const std::string& name) {
  const auto golden_path =
      std::filesystem::path(GDFMAP_SOURCE_DIR) / "tests/pipeline/golden" / (name + ".png");
  if (std::getenv("GDFMAP_WRITE_GOLDEN") != nullptr) {
    std::filesystem::create_directories(golden_path.parent_path());
    std::filesystem::copy_file(picture, golden_path,
                               std::filesystem::copy_options::overwrite_existing);
    return;
  }
  const Picture seen(picture), golden(golden_path);
  ASSERT_EQ(seen.width(), golden.width());
  ASSERT_EQ(seen.height(), golden.height());
  double worst = 0.0;
  int worst_x = 0, worst_y = 0;
  for (int y = 0; y + kBlur <= seen.height(); y += kBlur) {
    for (int x = 0; x + kBlur <= seen.width(); x += kBlur) {
      const drawing::Color a = mean_color(seen, x, y), b = mean_color(golden, x, y);
      const double difference = std::max(
          {std::abs(a.red - b.red), std::abs(a.green - b.green), std::abs(a.blue - b.blue)});
      if (difference <= worst) continue;
      worst = difference;
      worst_x = x;
      worst_y = y;
    }
  }
  EXPECT_LE(worst, kTolerance) << name << " at " << worst_x << ", " << worst_y;
}

}  // namespace gdfmap::test
