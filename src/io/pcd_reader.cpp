#include <utility>

#include "ascii_record_reader.hpp"
#include "fixed_record_reader.hpp"
#include "formats.hpp"
#include "pcd_compressed_reader.hpp"
#include "pcd_header.hpp"

namespace gdfmap::io {
namespace {

RecordLayout fixed_layout(const PcdHeader& header, const std::array<std::size_t, 3>& coordinates) {
  RecordLayout layout;
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (coordinates[axis] == i) {
        layout.xyz[axis] = {layout.stride, *header.fields[i].scalar_type()};
      }
    }
    layout.stride += header.fields[i].bytes();
  }
  return layout;
}

/// A row holds COUNT words for every field, padding included.
std::vector<AsciiColumn> ascii_columns(const PcdHeader& header,
                                       const std::array<std::size_t, 3>& coordinates) {
  std::vector<AsciiColumn> columns;
  std::array<std::size_t, 3> first_words{};
  for (std::size_t i = 0; i < header.fields.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (coordinates[axis] == i) first_words[axis] = columns.size();
    }
    columns.resize(columns.size() + header.fields[i].count);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    columns[first_words[axis]].axis = static_cast<int>(axis);
  }
  return columns;
}

CloudInfo cloud_info(const PcdHeader& header, const char* format) {
  CloudInfo info{format, header.num_points};
  if (!header.viewpoint) return info;
  const std::array<double, 7>& v = *header.viewpoint;
  info.sensor_origin = Vector3(v[0], v[1], v[2]);
  // A quaternion is no rotation where it is a multiple of one; zero is none either.
  info.has_sensor_rotation = v[4] != 0.0 || v[5] != 0.0 || v[6] != 0.0;
  return info;
}

}  // namespace

std::unique_ptr<PointReader> open_pcd(std::unique_ptr<InputFile> file) {
  const PcdHeader header = read_pcd_header(*file);
  const auto coordinates = find_pcd_coordinates(*file, header.fields);
  const auto info = [&](const char* format) { return cloud_info(header, format); };
  switch (header.encoding) {
    case PcdEncoding::kAscii:
      return std::make_unique<AsciiRecordReader>(std::move(file), info("PCD ascii"), "point",
                                                 ascii_columns(header, coordinates));
    case PcdEncoding::kBinary:
      return std::make_unique<FixedRecordReader>(std::move(file), info("PCD binary"), "point",
                                                 fixed_layout(header, coordinates));
    case PcdEncoding::kBinaryCompressed:
      break;
  }
  return std::make_unique<PcdCompressedReader>(std::move(file), info("PCD binary_compressed"),
                                               header, coordinates);
}

}  // namespace gdfmap::io
