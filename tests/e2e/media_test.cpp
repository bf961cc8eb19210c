#include <filesystem>

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include "e2e/expect.hpp"
#include "e2e/map_bytes.hpp"
#include "e2e/scene.hpp"
#include "support/map_fixture.hpp"
#include "support/temporary_directory.hpp"

namespace gdfmap::test {
namespace {

constexpr int kIo = 3;

/// A file system in memory of a given size; not mounted where the system does not permit it.
class SmallDisk {
 public:
  SmallDisk(std::filesystem::path place, const std::string& size) : place_(std::move(place)) {
    std::filesystem::create_directory(place_);
    mounted_ = ::mount("tmpfs", place_.c_str(), "tmpfs", 0, ("size=" + size).c_str()) == 0;
  }
  ~SmallDisk() {
    if (mounted_) ::umount2(place_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  [[nodiscard]] bool mounted() const { return mounted_; }
  void resize(const std::string& size) const { remount(0, "size=" + size); }
  /// Makes the disk so small that only this many bytes are free.
  void leave_room(std::uintmax_t num_bytes) const {
    const std::filesystem::space_info space = std::filesystem::space(place_);
    resize(std::to_string(space.capacity - space.free + num_bytes));
  }
  void make_read_only() const { remount(MS_RDONLY, ""); }
  [[nodiscard]] std::string operator/(const std::string& name) const { return place_ / name; }
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(place_)) {
      names.push_back(entry.path().filename());
    }
    return names;
  }

 private:
  void remount(unsigned long flags, const std::string& data) const {
    EXPECT_EQ(::mount("tmpfs", place_.c_str(), "tmpfs", MS_REMOUNT | flags, data.c_str()), 0);
  }

  std::filesystem::path place_;
  bool mounted_ = false;
};

class Media : public ::testing::Test {
 protected:
  [[nodiscard]] std::string path(const std::string& name) const { return directory_ / name; }
  void make_scan() { write_xyz(path("scan.xyz"), first_scan()); }
  /// Half a megabyte of blocks.
  void make_large_scan() { write_xyz(path("large.xyz"), square(40.0, 0.0, 1.0, 60.0, 100'000)); }
  void make_map(const std::string& map) {
    EXPECT_TRUE(exits_with(0, gdfmap({"ingest", map, path("scan.xyz")})));
    EXPECT_TRUE(exits_with(0, gdfmap({"train", map})));
  }

  TemporaryDirectory directory_;
};

TEST_F(Media, AMapOnAReadOnlyDiskIsReadAndNotWritten) {
  const SmallDisk disk(directory_ / "disk", "64m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not permitted here";
  make_scan();
  make_map(disk / "a.gdfmap");
  const std::string digest = content_digest_of(disk / "a.gdfmap");
  const Result before = gdfmap({"query", disk / "a.gdfmap", "--at", "0.1,0.1,0.5"});
  disk.make_read_only();

  EXPECT_EQ(content_digest_of(disk / "a.gdfmap"), digest);
  EXPECT_EQ(gdfmap({"query", disk / "a.gdfmap", "--at", "0.1,0.1,0.5"}).out, before.out);
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", disk / "a.gdfmap"})));
  EXPECT_TRUE(exits_with(0, gdfmap({"export", disk / "a.gdfmap", path("out.bin")})));

  EXPECT_TRUE(refuses(kIo, "train", "a.gdfmap", gdfmap({"train", disk / "a.gdfmap"})));
  EXPECT_TRUE(
      refuses(kIo, "ingest", "a.gdfmap", gdfmap({"ingest", disk / "a.gdfmap", path("scan.xyz")})));
  EXPECT_TRUE(
      refuses(kIo, "ingest", "b.gdfmap", gdfmap({"ingest", disk / "b.gdfmap", path("scan.xyz")})));
  EXPECT_TRUE(
      refuses(kIo, "export", "out.bin", gdfmap({"export", disk / "a.gdfmap", disk / "out.bin"})));
  EXPECT_TRUE(refuses(kIo, "synth", "out.ply",
                      gdfmap({"synth", "room", disk / "out.ply", "--points", "10"})));
}

TEST_F(Media, AMapInADirectoryWithoutPermissionIsReadAndNotWritten) {
  make_scan();
  make_map(path("a.gdfmap"));
  ::chmod(directory_.path().c_str(), 0555);
  ::chmod(path("a.gdfmap").c_str(), 0555);
  Launch launch;
  launch.program = GDFMAP_PROGRAM;
  launch.unprivileged = ::geteuid() == 0;
  const auto gdfmap_here = [&](std::vector<std::string> arguments) {
    launch.arguments = std::move(arguments);
    return run(launch);
  };
  const Result first = gdfmap_here({"info", path("a.gdfmap")});
  if (first.exit_code == 127) GTEST_SKIP() << "user nobody cannot run " << GDFMAP_PROGRAM;
  EXPECT_TRUE(exits_with(0, first));
  EXPECT_TRUE(exits_with(0, gdfmap_here({"query", path("a.gdfmap"), "--at", "0.1,0.1,0.5"})));
  EXPECT_TRUE(refuses(kIo, "train", "a.gdfmap", gdfmap_here({"train", path("a.gdfmap")})));
  EXPECT_TRUE(refuses(kIo, "ingest", "ermission denied",
                      gdfmap_here({"ingest", path("b.gdfmap"), path("scan.xyz")})));
  EXPECT_TRUE(refuses(kIo, "export", "ermission denied",
                      gdfmap_here({"export", path("a.gdfmap"), path("out.bin")})));
  ::chmod(path("a.gdfmap").c_str(), 0755);
  ::chmod(directory_.path().c_str(), 0755);
}

TEST_F(Media, CubesAloneOnAReadOnlyDiskAnswerQueries) {
  const SmallDisk disk(directory_ / "disk", "64m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not permitted here";
  make_scan();
  make_map(path("a.gdfmap"));
  std::filesystem::create_directory(disk / "robot.gdfmap");
  std::filesystem::copy_file(path("a.gdfmap/cubes.db"), disk / "robot.gdfmap/cubes.db");
  disk.make_read_only();
  const auto answers = [&](const std::string& map) {
    const Result result = gdfmap({"query", map, "--points", path("scan.xyz")});
    EXPECT_TRUE(exits_with(0, result));
    return result.out;
  };
  EXPECT_EQ(answers(disk / "robot.gdfmap"), answers(path("a.gdfmap")));
  EXPECT_EQ(content_digest_of(disk / "robot.gdfmap"), content_digest_of(path("a.gdfmap")));
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", disk / "robot.gdfmap"})));
  EXPECT_TRUE(exits_with(0, gdfmap({"export", disk / "robot.gdfmap", path("out.bin")})));
  EXPECT_TRUE(refuses(kIo, "train", "robot.gdfmap", gdfmap({"train", disk / "robot.gdfmap"})));
}

TEST_F(Media, CubesAloneCannotBeTrainedAndSayWhy) {
  make_scan();
  make_map(path("a.gdfmap"));
  std::filesystem::create_directory(path("robot.gdfmap"));
  std::filesystem::copy_file(path("a.gdfmap/cubes.db"), path("robot.gdfmap/cubes.db"));
  EXPECT_TRUE(
      refuses(kIo, "train", "points.db is missing", gdfmap({"train", path("robot.gdfmap")})));
  EXPECT_EQ(content_digest_of(path("robot.gdfmap")), content_digest_of(path("a.gdfmap")));
}

TEST_F(Media, AFullDiskStopsIngestWithoutATrace) {
  make_scan();
  for (const char* size : {"16k", "40k", "80k"}) {
    const SmallDisk disk(directory_ / "disk", size);
    if (!disk.mounted()) GTEST_SKIP() << "mounting is not permitted here";
    const Result result = gdfmap({"ingest", disk / "a.gdfmap", path("scan.xyz")});
    EXPECT_TRUE(refuses(kIo, "ingest", "a.gdfmap", result)) << size;
    EXPECT_EQ(disk.files(), std::vector<std::string>{}) << size;
  }
}

TEST_F(Media, AFullDiskStopsTheFirstIngestAndTheNewMapGoes) {
  const SmallDisk disk(directory_ / "disk", "256k");  // room for an empty map
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not permitted here";
  make_large_scan();
  const Result result = gdfmap({"ingest", disk / "a.gdfmap", path("large.xyz")});
  EXPECT_TRUE(refuses(kIo, "ingest", "points.db", result));
  EXPECT_EQ(disk.files(), std::vector<std::string>{});
}

TEST_F(Media, AFullDiskStopsALaterIngestAndTheMapStaysAsItWas) {
  const SmallDisk disk(directory_ / "disk", "64m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not permitted here";
  make_scan();
  make_map(disk / "a.gdfmap");
  const std::string digest = content_digest_of(disk / "a.gdfmap");
  make_large_scan();
  disk.leave_room(100'000);
  EXPECT_TRUE(
      refuses(kIo, "ingest", "a.gdfmap", gdfmap({"ingest", disk / "a.gdfmap", path("large.xyz")})));
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", disk / "a.gdfmap"})));
  EXPECT_EQ(content_digest_of(disk / "a.gdfmap"), digest);
  disk.leave_room(8192);
  EXPECT_TRUE(
      refuses(kIo, "export", "out.csv", gdfmap({"export", disk / "a.gdfmap", disk / "out.csv"})));
  EXPECT_EQ(disk.files(), std::vector<std::string>{"a.gdfmap"});

  disk.resize("64m");
  EXPECT_TRUE(exits_with(0, gdfmap({"ingest", disk / "a.gdfmap", path("large.xyz")})));
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", disk / "a.gdfmap"})));
}

TEST_F(Media, AFullDiskStopsTrainWhichContinuesOnceThereIsRoom) {
  const SmallDisk disk(directory_ / "disk", "64m");
  if (!disk.mounted()) GTEST_SKIP() << "mounting is not permitted here";
  make_scan();
  make_map(path("reference.gdfmap"));
  EXPECT_TRUE(exits_with(0, gdfmap({"ingest", disk / "a.gdfmap", path("scan.xyz")})));
  disk.leave_room(120'000);
  EXPECT_TRUE(
      refuses(kIo, "train", "a.gdfmap", gdfmap({"train", disk / "a.gdfmap", "--memory", "64M"})));
  EXPECT_TRUE(exits_with(0, gdfmap({"verify", disk / "a.gdfmap"})));

  disk.resize("64m");
  EXPECT_TRUE(exits_with(0, gdfmap({"train", disk / "a.gdfmap"})));
  EXPECT_EQ(bytes_of(disk / "a.gdfmap"), bytes_of(path("reference.gdfmap")));
}

}  // namespace
}  // namespace gdfmap::test
