#include "canvas.hpp"

#include <cmath>
#include <cstdint>

#include <cairo.h>

#include <gdfmap/core/error.hpp>

namespace gdfmap::drawing {
namespace {

constexpr const char* kFont = "DejaVu Sans";
/// Height of figures over the em, by which text is centred.
constexpr double kFigureHeight = 0.73;

struct DestroySurface {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
struct DestroyContext {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
};
using Surface = std::unique_ptr<cairo_surface_t, DestroySurface>;
using Context = std::unique_ptr<cairo_t, DestroyContext>;

void check(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) {
    throw Error(ErrorCode::kInternal,
                std::string("drawing failed: ") + cairo_status_to_string(status));
  }
}

/// Unhinted grey text, so that sizes scale and no display setting shows.
void select_font(cairo_t* context, double size) {
  cairo_select_font_face(context, kFont, CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, size);
  cairo_font_options_t* const options = cairo_font_options_create();
  cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(context, options);
  cairo_font_options_destroy(options);
}

double advance_of(cairo_t* context, const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  return extents.x_advance;
}

double share_before(Align align) {
  switch (align) {
    case Align::kStart:
      return 0.0;
    case Align::kCentre:
      return 0.5;
    case Align::kEnd:
      break;
  }
  return 1.0;
}

std::uint32_t to_pixel(const Color& color) {
  const auto channel = [](double v) { return static_cast<std::uint32_t>(std::lround(255.0 * v)); };
  return channel(color.red) << 16 | channel(color.green) << 8 | channel(color.blue);
}

cairo_status_t append_bytes(void* closure, const unsigned char* data, unsigned int length) {
  auto& bytes = *static_cast<Bytes*>(closure);
  try {  // an exception must not pass through C
    const auto chunk = std::as_bytes(std::span(data, length));
    bytes.insert(bytes.end(), chunk.begin(), chunk.end());
  } catch (...) {
    return CAIRO_STATUS_NO_MEMORY;
  }
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

struct Canvas::Impl {
  Surface surface;
  Context context;

  void use(const Stroke& stroke) const {
    cairo_set_source_rgba(context.get(), stroke.color.red, stroke.color.green, stroke.color.blue,
                          stroke.opacity);
    cairo_set_line_width(context.get(), stroke.width);
    cairo_set_dash(context.get(), &stroke.dash, stroke.dash > 0.0 ? 1 : 0, 0.0);
  }
};

Canvas::Canvas(int width, int height) : impl_(std::make_unique<Impl>()) {
  impl_->surface.reset(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
  check(cairo_surface_status(impl_->surface.get()));
  impl_->context.reset(cairo_create(impl_->surface.get()));
  check(cairo_status(impl_->context.get()));
  cairo_set_source_rgb(impl_->context.get(), 1.0, 1.0, 1.0);
  cairo_paint(impl_->context.get());
  cairo_set_line_join(impl_->context.get(), CAIRO_LINE_JOIN_ROUND);
}

Canvas::~Canvas() = default;

void Canvas::fill_pixels(int x, int y, int width, int height,
                         const std::function<Color(int, int)>& color) {
  cairo_surface_t* const surface = impl_->surface.get();
  const bool is_inside = x >= 0 && y >= 0 && width >= 0 && height >= 0 &&
                         x + width <= cairo_image_surface_get_width(surface) &&
                         y + height <= cairo_image_surface_get_height(surface);
  if (!is_inside) throw Error(ErrorCode::kInternal, "drawing failed: outside the picture");
  cairo_surface_flush(surface);
  unsigned char* const data = cairo_image_surface_get_data(surface);
  const auto stride = static_cast<std::ptrdiff_t>(cairo_image_surface_get_stride(surface));
  for (int j = 0; j < height; ++j) {
    auto* const row = reinterpret_cast<std::uint32_t*>(data + (y + j) * stride) + x;
    for (int i = 0; i < width; ++i) row[i] = to_pixel(color(i, j));
  }
  cairo_surface_mark_dirty_rectangle(surface, x, y, width, height);
}

void Canvas::stroke_line(std::span<const Point> points, const Stroke& stroke) {
  if (points.size() < 2) return;
  impl_->use(stroke);
  for (const Point& p : points) cairo_line_to(impl_->context.get(), p.x, p.y);
  cairo_stroke(impl_->context.get());
}

void Canvas::fill_polygon(std::span<const Point> corners, const Color& color) {
  cairo_set_source_rgb(impl_->context.get(), color.red, color.green, color.blue);
  for (const Point& p : corners) cairo_line_to(impl_->context.get(), p.x, p.y);
  cairo_close_path(impl_->context.get());
  cairo_fill(impl_->context.get());
}

void Canvas::stroke_rectangle(const Rectangle& rectangle, const Stroke& stroke) {
  impl_->use(stroke);
  cairo_rectangle(impl_->context.get(), rectangle.x, rectangle.y, rectangle.width,
                  rectangle.height);
  cairo_stroke(impl_->context.get());
}

void Canvas::text(const std::string& text, const Point& anchor, const TextStyle& style) {
  cairo_t* const context = impl_->context.get();
  cairo_save(context);
  select_font(context, style.size);
  const double shift = share_before(style.align) * advance_of(context, text);
  cairo_translate(context, anchor.x, anchor.y);
  cairo_rotate(context, style.angle);
  cairo_move_to(context, -shift, 0.5 * kFigureHeight * style.size);
  cairo_set_source_rgb(context, style.color.red, style.color.green, style.color.blue);
  cairo_show_text(context, text.c_str());
  cairo_new_path(context);  // else the next line would start where the text ends
  cairo_restore(context);
}

Bytes Canvas::png() const {
  check(cairo_status(impl_->context.get()));
  Bytes bytes;
  check(cairo_surface_write_to_png_stream(impl_->surface.get(), append_bytes, &bytes));
  return bytes;
}

double text_width(const std::string& text, double size) {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, 1, 1));
  const Context context(cairo_create(surface.get()));
  check(cairo_status(context.get()));
  select_font(context.get(), size);
  return advance_of(context.get(), text);
}

}  // namespace gdfmap::drawing
