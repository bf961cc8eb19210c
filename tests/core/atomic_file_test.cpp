#include <iterator>

#include <gtest/gtest.h>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/error.hpp>

#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

std::size_t num_entries(const std::filesystem::path& directory) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(directory),
                                                std::filesystem::directory_iterator()));
}

TEST(AtomicFile, AppearsOnCommitAlone) {
  const test::TemporaryDirectory directory;
  const auto path = directory / "file";
  AtomicFile file(path);
  file.write(std::string_view("hello world"));
  EXPECT_FALSE(std::filesystem::exists(path));
  file.write_at(0, std::as_bytes(std::span("J", 1)));
  file.write(std::string_view("!"));
  file.commit();
  EXPECT_EQ(test::read_file(path), "Jello world!");
}

TEST(AtomicFile, LeavesTheOldFileWhenAbandoned) {
  const test::TemporaryDirectory directory;
  const auto path = directory / "file";
  {
    AtomicFile file(path);
    file.write(std::string_view("old"));
    file.commit();
  }
  {
    AtomicFile file(path);
    file.write(std::string_view("new"));
  }
  EXPECT_EQ(test::read_file(path), "old");
  EXPECT_EQ(num_entries(directory.path()), 1u);
}

TEST(AtomicFile, NamesThePathThatCannotBeWritten) {
  try {
    AtomicFile file("/nonexistent/place/file");
    FAIL() << "created a file in a directory that does not exist";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kIo);
    EXPECT_NE(std::string(error.what()).find("/nonexistent/place/file"), std::string::npos);
  }
}

}  // namespace
}  // namespace gdfmap
