#pragma once

#include <string>
#include <vector>

#include "io_test_support.hpp"

namespace gdfmap::io_test {

struct SmallCloud {
  const char* name;  ///< the format first: "ply ascii"
  std::string bytes;
};

inline std::string ply(const std::string& format, const std::string& body) {
  return "ply\nformat " + format +
         " 1.0\ncomment c\nelement face 1\nproperty list uchar int i\nelement vertex 3\n"
         "property list uchar uchar l\nproperty float x\nproperty double y\nproperty short z\n"
         "end_header\n" +
         body;
}

inline std::string pcd(const std::string& data, const std::string& body) {
  return "# .PCD v0.7\nVERSION 0.7\nFIELDS x y _ z\nSIZE 4 8 1 2\nTYPE F F U I\nCOUNT 1 1 2 1\n"
         "WIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA " +
         data + "\n" + body;
}

inline std::string las(int minor, int format, std::uint16_t record_bytes) {
  LasFile file;
  file.minor = minor;
  file.format = format;
  file.header_bytes = minor == 4 ? 375 : 227;
  file.record_bytes = record_bytes;
  file.count = file.legacy_count = 3;
  for (int i = 0; i < 3; ++i) file.add(i, 2 * i, 3 * i);
  return file.bytes();
}

/// Small valid files: the smaller, the more of the damages hit something that matters.
inline std::vector<SmallCloud> small_clouds() {
  std::string vertices = raw(std::uint8_t{1}) + raw(7), records, columns;
  for (int i = 0; i < 3; ++i) {
    vertices += raw(std::uint8_t{1}) + "l" + raw(1.0f) + raw(2.0) + raw(std::int16_t{3});
    records += raw(1.0f) + raw(2.0) + "__" + raw(std::int16_t{3});
  }
  for (int i = 0; i < 3; ++i) columns += raw(1.0f);
  for (int i = 0; i < 3; ++i) columns += raw(2.0);
  for (int i = 0; i < 3; ++i) columns += raw(std::int16_t{3});
  return {{"ply ascii", ply("ascii", "1 7\n1 5 1 2 3\n0 1 2 3\n2 1 1 1 2 3\n")},
          {"ply binary", ply("binary_little_endian", vertices)},
          {"ply plain",
           "ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty float x\n"
           "property float y\nproperty uchar z\nend_header\n123456789abcdefghi"},
          {"pcd ascii", pcd("ascii", "1 2 0 0 3\nnan nan 0 0 1\n4 5 0 0 6\n")},
          {"pcd binary", pcd("binary", records)},
          {"pcd compressed", pcd("binary_compressed", compressed_body(columns))},
          {"las 1.2", las(2, 1, 28)},
          {"las 1.4", las(4, 7, 40)},
          {"xyz", "x;y;z\n1;2;3\n# c\n4;5;6\n"},
          {"csv", "1.5,2,3,red\n4,5,6,green\n-1e5,nan,0.25,blue\n"}};
}

}  // namespace gdfmap::io_test
