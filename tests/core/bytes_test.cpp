#include <gtest/gtest.h>

#include <gdfmap/core/bytes.hpp>

namespace gdfmap {
namespace {

TEST(ByteWriter, WritesLittleEndian) {
  ByteWriter writer;
  writer.put(std::uint32_t{0x01020304});
  writer.put(std::int16_t{-2});
  const Bytes bytes = writer.take();
  const unsigned char expected[] = {4, 3, 2, 1, 0xfe, 0xff};
  ASSERT_EQ(bytes.size(), sizeof(expected));
  EXPECT_EQ(std::memcmp(bytes.data(), expected, sizeof(expected)), 0);
}

TEST(ByteReader, ReadsWhatWasWritten) {
  ByteWriter writer;
  writer.put(1.5);
  writer.put(Digest{7, 9});
  writer.put(std::uint8_t{200});
  ByteReader reader(writer.bytes(), "test");
  EXPECT_EQ(reader.get<double>(), 1.5);
  EXPECT_EQ(reader.get_digest(), (Digest{7, 9}));
  EXPECT_EQ(reader.get<std::uint8_t>(), 200);
  EXPECT_EQ(reader.remaining(), 0u);
}

TEST(ByteReader, RefusesToReadPastTheEnd) {
  const Bytes bytes(3);
  ByteReader reader(bytes, "block 7");
  try {
    static_cast<void>(reader.get<std::uint32_t>());
    FAIL() << "read past the end";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
    EXPECT_STREQ(error.what(), "block 7: truncated");
  }
}

TEST(Load, ReadsBothByteOrders) {
  const std::byte raw[] = {std::byte{1}, std::byte{2}};
  EXPECT_EQ(load<std::uint16_t>(raw), 0x0201);
  EXPECT_EQ(load<std::uint16_t>(raw, std::endian::big), 0x0102);
}

}  // namespace
}  // namespace gdfmap
