#include "support/map_fixture.hpp"

#include <fstream>
#include <iterator>

#include <gdfmap/io/point_reader.hpp>
#include <gdfmap/io/point_writer.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/pipeline/synthetic_scene.hpp>

namespace gdfmap::test {

void write_cloud(const std::filesystem::path& path, std::span<const Vector3> points) {
  const auto writer = create_point_cloud(path);
  writer->write(points);
  writer->finish();
}

std::vector<Vector3> read_cloud(const std::filesystem::path& path) {
  const std::unique_ptr<PointReader> reader = open_point_cloud(path);
  std::vector<Vector3> points, batch(65'536);
  while (const std::size_t count = reader->read(batch)) {
    points.insert(points.end(), batch.begin(), batch.begin() + static_cast<std::ptrdiff_t>(count));
  }
  return points;
}

std::vector<Vector3> scene_points(const std::string& scene, std::uint64_t count, double size) {
  const SyntheticScene synthetic(scene, size);
  std::vector<Vector3> points;
  points.reserve(count);
  for (std::uint64_t i = 0; i < count; ++i) points.push_back(synthetic.sample(i, 1, 0.0));
  return points;
}

FitConfig quick_fit_config(int max_iterations) {
  FitConfig config;
  config.populated_steps = {8};
  config.empty_steps = {4};
  config.max_iterations = max_iterations;
  return config;
}

Map map_of(const std::filesystem::path& path, std::span<const Vector3> points, double cube_size,
           int num_levels) {
  const std::filesystem::path cloud = path.string() + ".ply";
  write_cloud(cloud, points);
  Map map = open_or_create_map(path, {cube_size, num_levels});
  ingest(cloud, map);
  return map;
}

std::string read_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

}  // namespace gdfmap::test
