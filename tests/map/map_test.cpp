#include <csignal>
#include <fstream>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/failpoint.hpp>
#include <gdfmap/map/map.hpp>

#include "support/temporary_directory.hpp"

namespace gdfmap {
namespace {

using test::TemporaryDirectory;

/// The code of the Error that a call throws, and its message.
template <typename Call>
std::pair<ErrorCode, std::string> error_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return {error.code(), error.what()};
  }
  ADD_FAILURE() << "nothing was thrown";
  return {ErrorCode::kInternal, ""};
}

TEST(Map, KeepsItsGeometryAndIdentity) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  std::string id;
  {
    const Map map = Map::create(path, {2.5, 0.625, 1});
    id = map.id();
    EXPECT_EQ(id.size(), 32u);
  }
  const Map map = Map::open(path, Access::kRead);
  EXPECT_EQ(map.id(), id);
  EXPECT_EQ(map.geometry(), (Geometry{2.5, 0.625, 1}));
  EXPECT_DOUBLE_EQ(map.lattice().cube_size(), 2.5);
  EXPECT_FALSE(map.is_imported());
}

TEST(Map, AtRestIsPlainFiles) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  { Map map = Map::create(path); }
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    const std::string name = entry.path().filename();
    EXPECT_TRUE(name == "points.db" || name == "cubes.db" || name == "lock") << name;
  }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory.path()), {}), 1);
}

TEST(Map, RefusesToCreateOverAMap) {
  const TemporaryDirectory directory;
  { Map map = Map::create(directory / "a.gdfmap"); }
  EXPECT_EQ(error_of([&] { Map::create(directory / "a.gdfmap"); }).first, ErrorCode::kUsage);
}

TEST(Map, RefusesImpossibleGeometryAndLeavesNothing) {
  const TemporaryDirectory directory;
  for (const Geometry& geometry : {Geometry{0.0, 0.25, 1}, Geometry{1.0, 0.6, 1},
                                   Geometry{1.0, 0.25, 0}, Geometry{1e9, 0.25, 1}}) {
    EXPECT_EQ(error_of([&] { Map::create(directory / "a.gdfmap", geometry); }).first,
              ErrorCode::kUsage);
  }
  EXPECT_TRUE(std::filesystem::is_empty(directory.path()));
}

TEST(Map, SaysWhenThereIsNone) {
  const TemporaryDirectory directory;
  const auto [code, message] =
      error_of([&] { Map::open(directory / "none.gdfmap", Access::kRead); });
  EXPECT_EQ(code, ErrorCode::kIo);
  EXPECT_NE(message.find("none.gdfmap"), std::string::npos);
}

TEST(Map, ASecondWriterIsRefusedAndToldWho) {
  const TemporaryDirectory directory;
  const Map map = Map::create(directory / "a.gdfmap");
  const auto [code, message] = error_of([&] { Map::open(directory / "a.gdfmap", Access::kWrite); });
  EXPECT_EQ(code, ErrorCode::kIo);
  EXPECT_NE(message.find("process " + std::to_string(::getpid())), std::string::npos) << message;
}

TEST(Map, ReadersAreFreeBesideAWriter) {
  const TemporaryDirectory directory;
  const Map writer = Map::create(directory / "a.gdfmap");
  Map reader = Map::open(directory / "a.gdfmap", Access::kRead);
  EXPECT_EQ(reader.cubes().totals().num_cubes, 0);
}

TEST(Map, AKilledWriterLeavesNoLock) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  { Map map = Map::create(path); }
  const pid_t child = ::fork();
  if (child == 0) {
    const Map map = Map::open(path, Access::kWrite);
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_NO_THROW(Map::open(path, Access::kWrite));
}

TEST(Map, WhatAKilledCreationLeftIsTakenOver) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  const pid_t child = ::fork();
  if (child == 0) {
    set_failpoint_handler([](const char* name) {
      if (std::string(name) == "map.before_rename") ::kill(::getpid(), SIGKILL);
    });
    static_cast<void>(Map::create(path));
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_FALSE(Map::exists(path));
  EXPECT_FALSE(std::filesystem::is_empty(directory.path()));
  { const Map map = Map::create(path); }
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory.path()), {}), 1);
  EXPECT_NO_THROW(Map::open(path, Access::kWrite));
}

TEST(Map, OneOfTwoThatCreateItAtTheSameTimeIsTold) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  static std::filesystem::path place;
  static std::pair<ErrorCode, std::string> told;
  place = path;
  set_failpoint_handler([](const char* name) {
    if (std::string(name) != "map.before_rename") return;
    set_failpoint_handler(nullptr);
    told = error_of([] { Map::create(place); });
  });
  const Map map = Map::create(path);
  EXPECT_EQ(told.first, ErrorCode::kIo);
  EXPECT_NE(told.second.find("busy"), std::string::npos) << told.second;
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory.path()), {}), 1);
  // The lock was never let go in between.
  EXPECT_EQ(error_of([&] { Map::open(path, Access::kWrite); }).first, ErrorCode::kIo);
}

TEST(Map, RefusesDatabasesOfDifferentMaps) {
  const TemporaryDirectory directory;
  { Map a = Map::create(directory / "a.gdfmap"), b = Map::create(directory / "b.gdfmap"); }
  std::filesystem::copy_file(directory / "b.gdfmap/cubes.db", directory / "a.gdfmap/cubes.db",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(error_of([&] { Map::open(directory / "a.gdfmap", Access::kRead); }).first,
            ErrorCode::kCorrupt);
}

TEST(Map, RefusesDatabasesThatStateDifferentGeometries) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  { Map map = Map::create(path); }
  db::Database(path / "cubes.db", db::OpenMode::kWrite)
      .execute("UPDATE meta SET value = '2' WHERE key = 'cube_size'");
  const auto [code, message] = error_of([&] { Map::open(path, Access::kRead); });
  EXPECT_EQ(code, ErrorCode::kCorrupt);
  EXPECT_NE(message.find("geometries"), std::string::npos) << message;
}

TEST(Map, ALostCubeStoreIsMadeAnewByAWriter) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  std::string id;
  {
    const Map map = Map::create(path);
    id = map.id();
  }
  std::filesystem::remove(path / "cubes.db");
  EXPECT_EQ(error_of([&] { Map::open(path, Access::kRead); }).first, ErrorCode::kCorrupt);
  EXPECT_EQ(Map::open(path, Access::kWrite).id(), id);
  EXPECT_EQ(Map::open(path, Access::kRead).id(), id);
}

TEST(Map, CubesAloneCanBeRead) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  { Map map = Map::create(path); }
  std::filesystem::remove(path / "points.db");
  Map map = Map::open(path, Access::kRead);
  EXPECT_FALSE(map.has_points());
  EXPECT_EQ(map.cubes().totals().num_cubes, 0);
  EXPECT_EQ(error_of([&] { map.points(); }).first, ErrorCode::kIo);
}

TEST(Map, AnImportedOneHasNoPoints) {
  const TemporaryDirectory directory;
  Map map = Map::create_imported(directory / "a.gdfmap", {1.0, 0.3, 1});
  EXPECT_TRUE(map.is_imported());
  EXPECT_EQ(error_of([&] { map.points(); }).first, ErrorCode::kUsage);
}

TEST(Map, RefusesAFileThatIsNoDatabase) {
  const TemporaryDirectory directory;
  const auto path = directory / "a.gdfmap";
  { Map map = Map::create(path); }
  std::ofstream(path / "cubes.db", std::ios::trunc) << "this is not a database, however long it is";
  const auto [code, message] = error_of([&] { Map::open(path, Access::kRead); });
  EXPECT_EQ(code, ErrorCode::kCorrupt);
  EXPECT_NE(message.find("cubes.db"), std::string::npos);
}

TEST(Map, ATrailingSlashNamesTheSameMap) {
  const TemporaryDirectory directory;
  { Map map = Map::create(directory.path() / "a.gdfmap/"); }
  EXPECT_TRUE(Map::exists(directory / "a.gdfmap"));
}

}  // namespace
}  // namespace gdfmap
