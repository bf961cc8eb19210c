#include <array>
#include <cstdint>
#include <memory>

#include <gdfmap/io/point_reader.hpp>

#include "formats.hpp"
#include "harness.hpp"

namespace gdfmap::fuzz {
namespace {

/// LZF makes at most 264 bytes of three, and no format needs less than a byte for a point.
constexpr std::uint64_t kMostPointsPerByte = 100;

/// Reads a cloud to its end, `open(path)` opens it.
template <typename Open>
bool read_cloud(Input bytes, const Open& open) {
  static MemoryFile file(".cloud");
  const std::filesystem::path& path = file.hold(bytes);
  return accepts({ErrorCode::kCorrupt}, [&] {
    const std::unique_ptr<PointReader> reader = open(path);
    std::array<Vector3, 64> points;
    std::uint64_t num_points = 0;
    while (const std::size_t count = reader->read(points)) {
      require(count <= points.size(), "no more points than were asked for");
      num_points += count;
      require(num_points <= kMostPointsPerByte * bytes.size(), "points need bytes");
    }
    static_cast<void>(reader->identity());
    require(reader->num_bytes() == bytes.size(), "every byte is hashed");
  });
}

template <std::unique_ptr<PointReader> (*open)(std::unique_ptr<io::InputFile>)>
bool read_as(Input bytes) {
  return read_cloud(bytes, [](const std::filesystem::path& path) {
    return open(std::make_unique<io::InputFile>(path));
  });
}

}  // namespace

bool fuzz_ply(Input bytes) { return read_as<io::open_ply>(bytes); }
bool fuzz_pcd(Input bytes) { return read_as<io::open_pcd>(bytes); }
bool fuzz_las(Input bytes) { return read_as<io::open_las>(bytes); }
bool fuzz_xyz(Input bytes) { return read_cloud(bytes, open_point_cloud); }

}  // namespace gdfmap::fuzz
