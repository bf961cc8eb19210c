#include <thread>

#include <fcntl.h>
#include <sys/stat.h>

#include <gdfmap/core/hash.hpp>

#include "io_test_support.hpp"

namespace gdfmap::io_test {
namespace {

const std::string kPly =
    "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
    "property float z\nend_header\n" +
    raw_list({1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f});
const std::string kPcdHeader =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\n"
    "HEIGHT 1\nPOINTS 2\nDATA ";
const std::string kCompressedPcd = kPcdHeader + "binary_compressed\n" +
                                   compressed_body(raw_list({1.0f, 4.0f, 2.0f, 5.0f, 3.0f, 6.0f}));
const std::string kText = "1 2 3\n4 5 6\n";
const Points kPoints = {{1, 2, 3}, {4, 5, 6}};

std::string las_bytes() {
  LasFile las;
  las.scale = 1.0;
  las.legacy_count = 2;
  las.add(1, 2, 3);
  las.add(4, 5, 6);
  return las.bytes();
}

Digest hash_of(const std::string& bytes) { return hash128(std::as_bytes(std::span(bytes))); }

/// Puts a file in the place of standard input while it lives.
class RedirectedInput {
 public:
  explicit RedirectedInput(int descriptor) : saved_(::dup(STDIN_FILENO)) {
    ::dup2(descriptor, STDIN_FILENO);
    ::close(descriptor);
  }
  ~RedirectedInput() {
    ::dup2(saved_, STDIN_FILENO);
    ::close(saved_);
  }
  RedirectedInput(const RedirectedInput&) = delete;
  RedirectedInput& operator=(const RedirectedInput&) = delete;

 private:
  int saved_;
};

/// A pipe that delivers bytes in small pieces.
class PipedInput {
 public:
  explicit PipedInput(const std::string& bytes)
      : ends_(open_pipe()), input_(ends_[0]), feeder_([this, bytes] { feed(bytes); }) {}
  ~PipedInput() { feeder_.join(); }

 private:
  static std::array<int, 2> open_pipe() {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe(ends.data()), 0);
    return ends;
  }
  void feed(const std::string& bytes) const {
    constexpr std::size_t kPiece = 7;
    for (std::size_t i = 0; i < bytes.size(); i += kPiece) {
      const std::string piece = bytes.substr(i, kPiece);
      if (::write(ends_[1], piece.data(), piece.size()) < 0) break;
    }
    ::close(ends_[1]);
  }

  std::array<int, 2> ends_;
  RedirectedInput input_;
  std::thread feeder_;
};

TEST(OpenPointCloud, FindsTheFormatInTheBytesAndNotInTheName) {
  const TestDirectory directory;
  const auto format_of = [&](const std::string& bytes) {
    return open_point_cloud(directory.write("cloud.misleading", bytes))->info().format;
  };
  EXPECT_EQ(format_of(kPly), "PLY binary_little_endian");
  EXPECT_EQ(format_of(kCompressedPcd), "PCD binary_compressed");
  EXPECT_EQ(format_of("\n# a comment\n" + kPcdHeader.substr(kPcdHeader.find("FIELDS")) +
                      "ascii\n1 2 3\n4 5 6\n"),
            "PCD ascii");
  EXPECT_EQ(format_of(las_bytes()), "LAS 1.2 format 0");
  EXPECT_EQ(format_of(kText), "XYZ");
}

TEST(OpenPointCloud, ReportsMissingFilesAndDirectoriesWithTheSystemsMessage) {
  const TestDirectory directory;
  const Error missing =
      error_of([&] { static_cast<void>(open_point_cloud(directory / "missing.ply")); });
  EXPECT_EQ(missing.code(), ErrorCode::kIo);
  EXPECT_NE(std::string(missing.what()).find("missing.ply: No such file"), std::string::npos)
      << missing.what();
  const Error folder = error_of([&] { static_cast<void>(open_point_cloud(directory / "")); });
  EXPECT_EQ(folder.code(), ErrorCode::kIo);
  EXPECT_NE(std::string(folder.what()).find("directory"), std::string::npos) << folder.what();
}

TEST(OpenPointCloud, SaysThatAFileIsEmpty) {
  const TestDirectory directory;
  expect_corrupt(directory.write("nothing.ply", ""), "nothing.ply: is empty");
}

TEST(OpenPointCloud, HashesAllBytesOfEveryFormat) {
  const TestDirectory directory;
  const std::string tail(3'000'000, 't');  // more than a buffer behind the points
  for (const std::string& bytes :
       {kPly + tail, kCompressedPcd + tail, kPcdHeader + "ascii\n1 2 3\n4 5 6\n" + tail,
        las_bytes() + tail, kText}) {
    const auto reader = open_point_cloud(directory.write("h", bytes));
    SCOPED_TRACE(reader->info().format);
    expect_points(read_rest(*reader), kPoints);
    EXPECT_EQ(reader->identity(), hash_of(bytes));
    EXPECT_EQ(reader->num_bytes(), bytes.size());
  }
}

TEST(OpenPointCloud, HashesAFileWhosePointsWereNotRead) {
  const TestDirectory directory;
  for (const std::string& bytes : {kPly, kCompressedPcd, las_bytes(), kText}) {
    EXPECT_EQ(open_point_cloud(directory.write("h", bytes))->identity(), hash_of(bytes));
  }
}

TEST(OpenPointCloud, ReadsStandardInputWhereOnePassSuffices) {
  for (const std::string& bytes :
       {kPly, kPcdHeader + "ascii\n1 2 3\n4 5 6\n", las_bytes(), kText}) {
    const PipedInput input(bytes);
    const auto reader = open_point_cloud("-");
    SCOPED_TRACE(reader->info().format);
    expect_points(read_rest(*reader), kPoints);
    EXPECT_EQ(reader->identity(), hash_of(bytes));
    EXPECT_EQ(reader->num_bytes(), bytes.size());
  }
}

TEST(OpenPointCloud, RefusesCompressedPcdFromStandardInput) {
  const TestDirectory directory;
  const auto path = directory.write("c.pcd", kCompressedPcd);
  const RedirectedInput input(::open(path.c_str(), O_RDONLY));
  const Error error = error_of([] { static_cast<void>(open_point_cloud("-")); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_NE(std::string(error.what()).find("standard input: a PCD with DATA binary_compressed"),
            std::string::npos)
      << error.what();
}

TEST(OpenPointCloud, ReportsATruncatedStreamWhereItEnds) {
  const PipedInput input(kPly.substr(0, kPly.size() - 1));
  const auto reader = open_point_cloud("-");
  const Error error = error_of([&] { static_cast<void>(read_rest(*reader)); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_NE(std::string(error.what()).find("standard input: vertex 2 of 2: file ends"),
            std::string::npos)
      << error.what();
}

TEST(OpenPointCloud, ReadsNamedPipes) {
  const TestDirectory directory;
  const auto path = directory / "pipe";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  std::thread writer([&] { std::ofstream(path, std::ios::binary) << las_bytes(); });
  expect_points(read_points(path), kPoints);
  writer.join();
}

TEST(OpenPointCloud, AFileWithMoreBytesThanItsSizeSaysIsReadToItsEnd) {
  // The kernel's own files say that they are empty.
  const Error error = error_of([] { static_cast<void>(read_points("/proc/cpuinfo")); });
  EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
  EXPECT_EQ(std::string(error.what()).find("is empty"), std::string::npos) << error.what();
}

}  // namespace
}  // namespace gdfmap::io_test
