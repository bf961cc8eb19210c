#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>
#include <gdfmap/tiling/ingest.hpp>

#include "support/temporary_directory.hpp"

namespace gdfmap {

/// A directory of one test, deleted with it.
class TilingTest : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path path(const std::string& name = "points.db") const {
    return directory_ / name;
  }
  [[nodiscard]] PointStore create(const std::string& name = "points.db") const {
    return {path(name), db::OpenMode::kCreate};
  }

  test::TemporaryDirectory directory_;
};

/// A cloud in memory; its identity is the hash of its coordinates.
class MemoryReader : public PointReader {
 public:
  explicit MemoryReader(std::vector<Vector3> points, std::size_t points_per_read = 1000)
      : points_(std::move(points)), points_per_read_(points_per_read) {
    info_.format = "memory";
    info_.num_points = points_.size();
  }

  /// Where the file says that the sensor stood.
  void state_sensor(const Vector3& p_source) { info_.sensor_origin = p_source; }

  [[nodiscard]] const CloudInfo& info() const override { return info_; }
  [[nodiscard]] std::size_t read(std::span<Vector3> points) override {
    const std::size_t count =
        std::min({points.size(), points_per_read_, points_.size() - num_read_});
    std::copy_n(points_.begin() + static_cast<std::ptrdiff_t>(num_read_), count, points.begin());
    num_read_ += count;
    return count;
  }
  [[nodiscard]] Digest identity() override {
    num_read_ = points_.size();
    return hash128(bytes());
  }
  [[nodiscard]] std::uint64_t num_bytes() const override { return bytes().size(); }

 private:
  [[nodiscard]] std::span<const std::byte> bytes() const {
    return {reinterpret_cast<const std::byte*>(points_.data()), points_.size() * sizeof(Vector3)};
  }

  CloudInfo info_;
  std::vector<Vector3> points_;
  std::size_t points_per_read_;
  std::size_t num_read_ = 0;
};

/// A wavy surface around the world's origin, on both sides of zero.
inline std::vector<Vector3> wavy_surface(std::size_t count, std::uint32_t seed,
                                         double extent = 30.0) {
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) * 0x1p-32 - 0.5; };
  std::vector<Vector3> points(count);
  for (Vector3& p : points) {
    p.x() = extent * uniform();
    p.y() = extent * uniform();
    p.z() = 2.0 * std::sin(0.3 * p.x()) + 0.02 * uniform();
  }
  return points;
}

/// Everything that a reader of the store can learn about the points, as comparable values.
struct Content {
  std::map<TileKey, std::vector<TileOffset>> points;  // sorted, each once
  std::map<TileKey, Digest> digests;
  std::map<TileKey, CubeMask> cubes;
  bool operator==(const Content&) const = default;
};

inline void sort_points(std::map<TileKey, std::vector<TileOffset>>& tiles) {
  for (auto& [key, points] : tiles) {
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
  }
}

inline Content content_of(PointStore& store) {
  Content content;
  store.for_each_tile([&](const TilePoints& tile) {
    content.digests[tile.key] = tile.digest;
    content.cubes[tile.key] = tile.cubes;
    store.for_each_block(tile.key, [&](std::span<const TileOffset> block) {
      std::vector<TileOffset>& points = content.points[tile.key];
      points.insert(points.end(), block.begin(), block.end());
    });
  });
  sort_points(content.points);
  return content;
}

inline const Lattice kLattice(1.0);

inline IngestReport ingest(const std::vector<Vector3>& points, PointStore& store,
                           const IngestOptions& options = {}, const RunContext& context = {}) {
  MemoryReader reader(points);
  return ingest_points(reader, "memory", kLattice, store, options, context);
}

template <typename Body>
Error error_of(Body&& body) {
  try {
    body();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error was thrown";
  return {ErrorCode::kInternal, ""};
}

}  // namespace gdfmap
