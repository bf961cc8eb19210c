#include <algorithm>
#include <array>
#include <utility>

#include "ascii_record_reader.hpp"
#include "fixed_record_reader.hpp"
#include "formats.hpp"
#include "ply_header.hpp"
#include "text.hpp"

namespace gdfmap::io {
namespace {

constexpr std::array<std::string_view, 3> kAxisNames = {"x", "y", "z"};

/// Properties in the order of the file; -1: not a coordinate.
using Axes = std::vector<int>;

bool has_lists(const PlyElement& element) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [](const PlyProperty& p) { return p.list_length.has_value(); });
}

/// Size of a record whose lists are empty.
std::size_t min_record_bytes(const PlyElement& element) {
  std::size_t bytes = 0;
  for (const PlyProperty& p : element.properties) bytes += size_of(p.list_length.value_or(p.type));
  return bytes;
}

std::endian byte_order(PlyEncoding encoding) {
  return encoding == PlyEncoding::kBigEndian ? std::endian::big : std::endian::little;
}

Axes find_axes(const InputFile& file, const PlyElement& vertex) {
  Axes axes(vertex.properties.size(), -1);
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view name = kAxisNames[static_cast<std::size_t>(axis)];
    const auto found =
        std::find_if(vertex.properties.begin(), vertex.properties.end(),
                     [&](const PlyProperty& p) { return equal_ignoring_case(p.name, name); });
    if (found == vertex.properties.end()) {
      file.fail("the PLY element vertex has no property " + std::string(name));
    }
    if (found->list_length) file.fail("the PLY property " + std::string(name) + " is a list");
    axes[static_cast<std::size_t>(found - vertex.properties.begin())] = axis;
  }
  return axes;
}

/// Walks one binary record with lists; false when the file ends inside it or a list has no valid
/// length. `axes` empty: coordinates are passed over too.
bool walk_record(InputFile& file, const PlyElement& element, std::endian order, const Axes& axes,
                 Vector3& point) {
  for (std::size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    const ScalarType first_type = property.list_length.value_or(property.type);
    const std::byte* const from = file.take(size_of(first_type));
    if (from == nullptr) return false;
    if (property.list_length) {
      constexpr double kMaxListLength = 1e15;  // no file is that long, no product overflows
      const double length = decode(from, first_type, order);
      if (length < 0.0 || length > kMaxListLength) return false;
      if (!file.skip(static_cast<std::uint64_t>(length) * size_of(property.type))) return false;
    } else if (!axes.empty() && axes[i] >= 0) {
      point[axes[i]] = decode(from, property.type, order);
    }
  }
  return true;
}

/// Binary PLY whose vertices contain lists, so that each has a size of its own.
class PlyListReader final : public FileReader {
 public:
  PlyListReader(std::unique_ptr<InputFile> file, CloudInfo info, PlyElement vertex, Axes axes,
                std::endian order)
      : FileReader(std::move(file), std::move(info), "vertex"),
        vertex_(std::move(vertex)),
        axes_(std::move(axes)),
        order_(order) {
    require_bytes(this->file(), vertex_.count, min_record_bytes(vertex_), "points");
  }

  [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
    std::size_t filled = 0;
    for (; filled < points.size() && num_done_ < vertex_.count; ++filled, ++num_done_) {
      if (!walk_record(file(), vertex_, order_, axes_, points[filled])) {
        fail_at(num_done_, "file ends, or the length of a list is damaged");
      }
    }
    return filled;
  }

 private:
  PlyElement vertex_;
  Axes axes_;
  std::endian order_;
  std::uint64_t num_done_ = 0;
};

void skip_ascii_element(InputFile& file, const PlyElement& element) {
  for (std::uint64_t i = 0; i < element.count; ++i) {
    if (!skip_line(file)) file.fail("file ends inside the PLY element " + in_quotes(element.name));
  }
}

void skip_binary_element(InputFile& file, const PlyElement& element, std::endian order) {
  const std::size_t bytes_each = min_record_bytes(element);
  require_bytes(file, element.count, bytes_each, "elements " + in_quotes(element.name));
  Vector3 unused;
  for (std::uint64_t i = 0; i < element.count; ++i) {
    if (!walk_record(file, element, order, {}, unused)) {
      file.fail("file ends inside the PLY element " + in_quotes(element.name) +
                ", or the length of a list is damaged");
    }
  }
}

void skip_element(InputFile& file, const PlyElement& element, PlyEncoding encoding) {
  if (element.properties.empty()) return;
  if (encoding == PlyEncoding::kAscii) {
    skip_ascii_element(file, element);
  } else {
    skip_binary_element(file, element, byte_order(encoding));
  }
}

RecordLayout fixed_layout(const PlyElement& vertex, const Axes& axes, std::endian order) {
  RecordLayout layout;
  layout.order = order;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const ScalarType type = vertex.properties[i].type;
    if (axes[i] >= 0) layout.xyz[static_cast<std::size_t>(axes[i])] = {layout.stride, type};
    layout.stride += size_of(type);
  }
  return layout;
}

std::vector<AsciiColumn> ascii_columns(const PlyElement& vertex, const Axes& axes) {
  std::vector<AsciiColumn> columns;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    columns.push_back({axes[i], vertex.properties[i].list_length.has_value()});
  }
  return columns;
}

std::string format_name(PlyEncoding encoding) {
  switch (encoding) {
    case PlyEncoding::kAscii:
      return "PLY ascii";
    case PlyEncoding::kLittleEndian:
      return "PLY binary_little_endian";
    case PlyEncoding::kBigEndian:
      break;
  }
  return "PLY binary_big_endian";
}

}  // namespace

std::unique_ptr<PointReader> open_ply(std::unique_ptr<InputFile> file) {
  const PlyHeader header = read_ply_header(*file);
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const PlyElement& e) { return e.name == "vertex"; });
  if (vertex == header.elements.end()) file->fail("the PLY header has no element vertex");
  Axes axes = find_axes(*file, *vertex);
  for (auto element = header.elements.begin(); element != vertex; ++element) {
    skip_element(*file, *element, header.encoding);
  }

  CloudInfo info{format_name(header.encoding), vertex->count};
  if (header.encoding == PlyEncoding::kAscii) {
    return std::make_unique<AsciiRecordReader>(std::move(file), std::move(info), "vertex",
                                               ascii_columns(*vertex, axes));
  }
  const std::endian order = byte_order(header.encoding);
  if (has_lists(*vertex)) {
    return std::make_unique<PlyListReader>(std::move(file), std::move(info), *vertex,
                                           std::move(axes), order);
  }
  return std::make_unique<FixedRecordReader>(std::move(file), std::move(info), "vertex",
                                             fixed_layout(*vertex, axes, order));
}

}  // namespace gdfmap::io
