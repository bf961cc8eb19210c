#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/pipeline/npy.hpp>

namespace gdfmap {
namespace {

TEST(Npy, WritesFormatOneWithAlignedData) {
  const std::vector<float> values = {1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f};
  const std::string bytes = npy_bytes(values, {2, 3});
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
  const auto length = load<std::uint16_t>(reinterpret_cast<const std::byte*>(bytes.data() + 8));
  EXPECT_EQ((10u + length) % 64, 0u);
  const std::string header = bytes.substr(10, length);
  EXPECT_NE(header.find("'descr': '<f4'"), std::string::npos);
  EXPECT_NE(header.find("'fortran_order': False"), std::string::npos);
  EXPECT_NE(header.find("'shape': (2,3,)"), std::string::npos);
  EXPECT_EQ(header.back(), '\n');
  ASSERT_EQ(bytes.size(), 10u + length + 6 * sizeof(float));
  EXPECT_EQ(load<float>(reinterpret_cast<const std::byte*>(bytes.data() + 10 + length + 8)), 3.0f);
}

}  // namespace
}  // namespace gdfmap
