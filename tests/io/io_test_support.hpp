#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/io/point_writer.hpp>

namespace gdfmap::io_test {

using Points = std::vector<Vector3>;

/// A directory of its own for every test, removed with the object.
class TestDirectory {
 public:
  TestDirectory() {
    const auto* const test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::path(::testing::TempDir()) /
            (std::string("gdfmap_io_") + test->test_suite_name() + "_" + test->name() + "_" +
             std::to_string(::getpid()));
    std::filesystem::create_directories(path_);
  }
  ~TestDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TestDirectory(const TestDirectory&) = delete;
  TestDirectory& operator=(const TestDirectory&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    const std::filesystem::path path = path_ / name;
    std::filesystem::remove(path);  // some file systems write a truncated file through to the disk
    std::ofstream out(path, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    return path;
  }

 private:
  std::filesystem::path path_;
};

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// The bytes of a number in a given order.
template <typename T>
std::string raw(T value, std::endian order = std::endian::little) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (order != std::endian::native) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

template <typename T>
std::string raw_list(std::initializer_list<T> values, std::endian order = std::endian::little) {
  std::string bytes;
  for (const T value : values) bytes += raw(value, order);
  return bytes;
}

/// Reads on with spans of `span_size` points until the end.
inline Points read_rest(PointReader& reader, std::size_t span_size = 1000) {
  Points all, block(span_size);
  while (const std::size_t count = reader.read(block)) {
    all.insert(all.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(count));
  }
  return all;
}

inline Points read_points(const std::filesystem::path& path, std::size_t span_size = 1000) {
  return read_rest(*open_point_cloud(path), span_size);
}

/// The error that a call throws; fails the test when there is none.
template <typename F>
Error error_of(const F& f) {
  try {
    f();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << "message has two lines";
    return error;
  }
  ADD_FAILURE() << "no gdfmap::Error was thrown";
  return Error(ErrorCode::kInternal, "none");
}

/// Expects kCorrupt, at opening or at reading, with a message that holds `part`.
inline void expect_corrupt(const std::filesystem::path& path, const std::string& part) {
  const Error error = error_of([&] { static_cast<void>(read_points(path)); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt) << error.what();
  EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  EXPECT_NE(std::string(error.what()).find(path.filename().string()), std::string::npos)
      << error.what();
}

inline bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

inline void expect_points(const Points& actual, const Points& expected) {
  ASSERT_EQ(actual.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      ASSERT_TRUE(same(actual[i][axis], expected[i][axis]))
          << "point " << i << ", axis " << axis << ": " << actual[i][axis] << " instead of "
          << expected[i][axis];
    }
  }
}

/// A plain LZF compressor: greedy, with the last place of every three bytes.
inline std::string compress_lzf(const std::string& data) {
  std::string result;
  std::map<std::string, std::size_t> last_place;
  std::string literals;
  const auto flush = [&] {
    for (std::size_t i = 0; i < literals.size(); i += 32) {
      const std::string run = literals.substr(i, 32);
      result += static_cast<char>(run.size() - 1);
      result += run;
    }
    literals.clear();
  };
  for (std::size_t i = 0; i < data.size();) {
    std::size_t length = 0, distance = 0;
    if (const auto found = last_place.find(data.substr(i, 3));
        i + 3 <= data.size() && found != last_place.end() && i - found->second <= 8192) {
      distance = i - found->second;
      while (length < 264 && i + length < data.size() &&
             data[i + length] == data[i + length - distance]) {
        ++length;
      }
    }
    if (length >= 3) {
      flush();
      const std::size_t code = length - 2, place = distance - 1;
      result += static_cast<char>(std::min<std::size_t>(code, 7) << 5 | place >> 8);
      if (code >= 7) result += static_cast<char>(code - 7);
      result += static_cast<char>(place & 255);
    } else {
      length = 1;
      literals += data[i];
    }
    for (std::size_t k = 0; k < length; ++k) last_place[data.substr(i + k, 3)] = i + k;
    i += length;
  }
  flush();
  return result;
}

/// What follows the line "DATA binary_compressed".
inline std::string compressed_body(const std::string& data) {
  const std::string packed = compress_lzf(data);
  return raw(static_cast<std::uint32_t>(packed.size())) +
         raw(static_cast<std::uint32_t>(data.size())) + packed;
}

/// A LAS file put together field by field; every member may be set to something wrong.
struct LasFile {
  int minor = 2;
  int format = 0;
  std::uint16_t header_bytes = 227;
  std::optional<std::uint32_t> points_offset;  ///< default: behind header and padding
  std::size_t padding = 0;                     ///< variable-length records
  std::uint16_t record_bytes = 20;
  std::uint32_t legacy_count = 0;
  std::uint64_t count = 0;  ///< written where header_bytes has room for it
  double scale = 0.01;
  Vector3 offset = Vector3::Zero();
  std::string records;

  std::string bytes() const {
    std::string header(header_bytes, '\0');
    const auto set = [&](std::size_t at, const std::string& value) {
      if (at + value.size() <= header.size()) header.replace(at, value.size(), value);
    };
    set(0, "LASF");
    set(24, raw(std::uint8_t{1}) + raw(static_cast<std::uint8_t>(minor)));
    set(94, raw(header_bytes));
    set(96, raw(points_offset.value_or(static_cast<std::uint32_t>(header_bytes + padding))));
    set(104, raw(static_cast<std::uint8_t>(format)) + raw(record_bytes) + raw(legacy_count));
    set(131, raw_list({scale, scale, scale}));
    set(155, raw_list({offset.x(), offset.y(), offset.z()}));
    set(247, raw(count));
    return header + std::string(padding, 'v') + records;
  }

  /// Appends a record: three steps, byte 15 with the flags, the rest filled with something.
  void add(std::int32_t x, std::int32_t y, std::int32_t z, int byte15 = 0) {
    std::string record(record_bytes, '\x5a');
    record.replace(0, 12, raw_list({x, y, z}));
    if (record.size() > 15) record[15] = static_cast<char>(byte15);
    records += record;
  }
};

}  // namespace gdfmap::io_test
