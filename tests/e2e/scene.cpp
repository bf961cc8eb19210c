#include "e2e/scene.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace gdfmap::test {
namespace {

/// Knuth's MMIX generator.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state_ >> 11) / 9007199254740992.0;
  }

 private:
  std::uint64_t state_;
};

}  // namespace

std::vector<Vector3> square(double x, double y, double height, double edge, std::size_t count) {
  Random random(count);
  std::vector<Vector3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double u = random.uniform() - 0.5;
    const double v = random.uniform() - 0.5;
    points.emplace_back(x + edge * u, y + edge * v, height);
  }
  return points;
}

std::vector<Vector3> shuffled(std::vector<Vector3> points) {
  Random random(7);
  for (std::size_t i = points.size(); i > 1; --i) {
    std::swap(points[i - 1],
              points[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);
  }
  return points;
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  if (!(file << text << std::flush)) throw std::runtime_error("cannot write " + path.string());
}

void write_xyz(const std::filesystem::path& path, std::span<const Vector3> points) {
  std::string text;
  std::array<char, 128> line;
  for (const Vector3& p : points) {
    std::snprintf(line.data(), line.size(), "%.17g %.17g %.17g\n", p.x(), p.y(), p.z());
    text += line.data();
  }
  write_text(path, text);
}

std::vector<Vector3> first_scan() { return square(0.1, 0.0, 0.2, 1.6, 2000); }

std::vector<Vector3> second_scan() { return square(0.9, 0.3, 0.7, 1.4, 1500); }

}  // namespace gdfmap::test
