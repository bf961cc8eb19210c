#include <random>

#include "small_clouds.hpp"

namespace gdfmap::io_test {
namespace {

constexpr int kDamagesPerFile = 1500;

std::string damage(std::string bytes, std::mt19937& random) {
  const auto place = [&] { return random() % bytes.size(); };
  switch (random() % 6) {
    case 0:
      bytes[place()] ^= static_cast<char>(1u << random() % 8);
      break;
    case 1:
      bytes[place()] = static_cast<char>(random());
      break;
    case 2:
      bytes.resize(place());
      break;
    case 3:
      bytes.erase(place(), 1 + random() % 8);
      break;
    case 4:
      bytes.insert(place(), bytes.substr(place(), 1 + random() % 16));
      break;
    default:
      for (int i = 0; i < 4; ++i) bytes[place()] = "0123456789 -.\n\xff"[random() % 15];
  }
  return bytes;
}

/// Whether the file could be read; anything but success and gdfmap::Error fails the test.
bool can_be_read(const std::filesystem::path& path) {
  try {
    const auto reader = open_point_cloud(path);
    const Points points = read_rest(*reader, 2);
    EXPECT_LT(points.size(), 100u) << "points out of nothing";
    static_cast<void>(reader->identity());
    return true;
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCorrupt) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return false;
  }
}

TEST(DamagedFiles, AreReadOrRefusedAndNothingElse) {
  const TestDirectory directory;
  std::mt19937 random(20240229);
  for (const SmallCloud& sample : small_clouds()) {
    SCOPED_TRACE(sample.name);
    ASSERT_TRUE(can_be_read(directory.write("f", sample.bytes)));
    int num_refused = 0;
    for (int i = 0; i < kDamagesPerFile; ++i) {
      std::string bytes = damage(sample.bytes, random);
      if (random() % 2 == 0 && !bytes.empty()) bytes = damage(std::move(bytes), random);
      if (!can_be_read(directory.write("f", bytes))) ++num_refused;
    }
    EXPECT_GT(num_refused, kDamagesPerFile / 20) << "the damages do not reach the reader";
  }
}

TEST(DamagedFiles, AreRefusedWhereverABinaryOneIsCut) {
  const TestDirectory directory;
  for (const SmallCloud& sample : small_clouds()) {
    const std::string name = sample.name;
    if (name.find("ascii") != std::string::npos || name == "xyz" || name == "csv") continue;
    SCOPED_TRACE(name);
    for (std::size_t size = 0; size < sample.bytes.size(); ++size) {
      ASSERT_FALSE(can_be_read(directory.write("f", sample.bytes.substr(0, size))))
          << "cut to " << size << " of " << sample.bytes.size() << " bytes";
    }
  }
}

}  // namespace
}  // namespace gdfmap::io_test
