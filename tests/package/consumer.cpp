// Makes a map of a small cloud and asks for a distance: consumer DIRECTORY

#include <cstdio>
#include <exception>
#include <filesystem>
#include <vector>

#include <gdfmap/io/point_writer.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/query/distance_field.hpp>
#include <gdfmap/train/train.hpp>

namespace {

/// A square of 2 m in the plane z = 0.5.
std::vector<gdfmap::Vector3> square() {
  std::vector<gdfmap::Vector3> points;
  for (int x = 0; x < 40; ++x) {
    for (int y = 0; y < 40; ++y) points.emplace_back(0.05 * x, 0.05 * y, 0.5);
  }
  return points;
}

double distance_above_square(const std::filesystem::path& directory) {
  const auto writer = gdfmap::create_point_cloud(directory / "square.ply");
  writer->write(square());
  writer->finish();
  gdfmap::Map map = gdfmap::Map::create(directory / "square.gdfmap");
  gdfmap::ingest(directory / "square.ply", map);
  gdfmap::train(map);
  return gdfmap::DistanceField(map).at({1.0, 1.0, 1.0}).distance;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  try {
    const double distance = distance_above_square(argv[1]);
    std::printf("%.3f m\n", distance);
    return distance > 0.45 && distance < 0.55 ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
