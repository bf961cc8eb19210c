#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "../../src/pipeline/drawing/color_map.hpp"

struct _cairo_surface;

namespace gdfmap::test {

/// The pixels of a PNG file.
class Picture {
 public:
  explicit Picture(const std::filesystem::path& path);
  ~Picture();
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;

  [[nodiscard]] int width() const;
  [[nodiscard]] int height() const;
  [[nodiscard]] std::uint32_t pixel(int x, int y) const;
  [[nodiscard]] drawing::Color color(int x, int y) const;

 private:
  _cairo_surface* surface_;
};

/// Expects a picture to look like tests/pipeline/golden/NAME.png: of the same size, and blurred
/// over four pixels, so that another version of a font or of cairo does not matter, no more than a
/// tenth of the full range away anywhere. With GDFMAP_WRITE_GOLDEN in the environment it becomes
/// the golden one instead, to be looked at.
void expect_golden(const std::filesystem::path& picture, const std::string& name);

}  // namespace gdfmap::test
