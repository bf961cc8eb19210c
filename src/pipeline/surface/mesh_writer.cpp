#include "mesh_writer.hpp"

#include <charconv>
#include <string>
#include <string_view>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/bytes.hpp>
#include <gdfmap/core/error.hpp>
#include <gdfmap/io/ply_writer.hpp>

namespace gdfmap::surface {
namespace {

class PlyMeshWriter final : public MeshWriter {
 public:
  explicit PlyMeshWriter(const std::filesystem::path& path)
      : file_(path, {.properties = {"double x", "double y", "double z", "float nx", "float ny",
                                    "float nz", "float expected_error"},
                     .has_triangles = true}) {}

  void write(std::span<const ProjectedPoint> vertices,
             std::span<const std::array<std::uint64_t, 3>> triangles) override {
    ByteWriter writer;
    for (const ProjectedPoint& vertex : vertices) {
      for (int axis = 0; axis < 3; ++axis) writer.put(vertex.position[axis]);
      for (int axis = 0; axis < 3; ++axis) writer.put(static_cast<float>(vertex.normal[axis]));
      writer.put(static_cast<float>(vertex.expected_error));
    }
    file_.write_vertices(writer.bytes(), vertices.size());
    file_.write_triangles(triangles);
  }
  void finish() override { file_.finish(); }

 private:
  PlyWriter file_;
};

/// Lines of text; vertices count from 1.
class ObjMeshWriter final : public MeshWriter {
 public:
  explicit ObjMeshWriter(const std::filesystem::path& path) : file_(path) {}

  void write(std::span<const ProjectedPoint> vertices,
             std::span<const std::array<std::uint64_t, 3>> triangles) override {
    text_.clear();
    for (const ProjectedPoint& vertex : vertices) {
      add_line("v", vertex.position);
      add_line("vn", Eigen::Vector3f(vertex.normal.cast<float>()));
    }
    for (const auto& triangle : triangles) {
      text_ += 'f';
      for (const std::uint64_t index : triangle) {
        const std::string number = std::to_string(index + 1);
        text_ += ' ' + number + "//" + number;
      }
      text_ += '\n';
    }
    file_.write(std::string_view(text_));
  }
  void finish() override { file_.commit(); }

 private:
  template <typename Vector>
  void add_line(const char* keyword, const Vector& v) {
    text_ += keyword;
    for (int axis = 0; axis < 3; ++axis) {
      std::array<char, 32> digits;
      const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), v[axis]).ptr;
      text_ += ' ';
      text_.append(digits.data(), end);
    }
    text_ += '\n';
  }

  AtomicFile file_;
  std::string text_;
};

}  // namespace

std::unique_ptr<MeshWriter> create_mesh(const std::filesystem::path& path) {
  if (path.extension() == ".ply") return std::make_unique<PlyMeshWriter>(path);
  if (path.extension() == ".obj") return std::make_unique<ObjMeshWriter>(path);
  throw Error(ErrorCode::kUsage, path.string() + ": a mesh is written as .ply or .obj");
}

}  // namespace gdfmap::surface
