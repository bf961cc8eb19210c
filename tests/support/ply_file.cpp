#include "support/ply_file.hpp"

#include <sstream>
#include <stdexcept>

#include <gdfmap/core/bytes.hpp>

#include "support/map_fixture.hpp"

namespace gdfmap::test {
namespace {

class Bytewise {
 public:
  Bytewise(const std::string& text, std::size_t at)
      : reader_(std::as_bytes(std::span(text)).subspan(at), "PLY") {}

  double number(const std::string& type) {
    if (type == "double") return reader_.get<double>();
    if (type == "float") return static_cast<double>(reader_.get<float>());
    if (type == "int") return reader_.get<std::int32_t>();
    if (type == "uchar") return reader_.get<std::uint8_t>();
    if (type == "char") return reader_.get<std::int8_t>();
    throw std::runtime_error("unexpected type " + type);
  }
  [[nodiscard]] bool at_end() const { return reader_.remaining() == 0; }

 private:
  ByteReader reader_;
};

struct Header {
  std::size_t num_vertices = 0, num_faces = 0;
  std::vector<std::string> types, names;
};

Header parse(std::istringstream& text) {
  Header header;
  bool in_vertices = false;
  for (std::string line; std::getline(text, line) && line != "end_header";) {
    std::istringstream words(line);
    std::string first, second, third;
    words >> first >> second >> third;
    if (first == "element") {
      in_vertices = second == "vertex";
      (in_vertices ? header.num_vertices : header.num_faces) = std::stoull(third);
    } else if (first == "property" && in_vertices) {
      header.types.push_back(second);
      header.names.push_back(third);
    } else if (first == "property" && line != "property list uchar int vertex_indices") {
      throw std::runtime_error("unexpected " + line);
    }
  }
  return header;
}

}  // namespace

std::vector<Vector3> PlyFile::vectors(const char* x, const char* y, const char* z) const {
  std::vector<Vector3> result;
  for (std::size_t i = 0; i < num_vertices(); ++i) {
    result.emplace_back(values.at(x)[i], values.at(y)[i], values.at(z)[i]);
  }
  return result;
}

PlyFile read_ply(const std::filesystem::path& path) {
  const std::string bytes = read_file(path);
  const std::string start = "ply\nformat binary_little_endian 1.0\n", end = "end_header\n";
  if (!bytes.starts_with(start)) throw std::runtime_error("no binary PLY");
  const std::size_t body = bytes.find(end) + end.size();
  std::istringstream text(bytes.substr(0, body));
  const Header header = parse(text);
  PlyFile file;
  file.properties = header.names;
  Bytewise reader(bytes, body);
  for (const std::string& name : header.names) file.values[name].reserve(header.num_vertices);
  for (std::size_t i = 0; i < header.num_vertices; ++i) {
    for (std::size_t p = 0; p < header.names.size(); ++p) {
      file.values[header.names[p]].push_back(reader.number(header.types[p]));
    }
  }
  for (std::size_t i = 0; i < header.num_faces; ++i) {
    if (reader.number("uchar") != 3.0) throw std::runtime_error("no triangle");
    auto& triangle = file.triangles.emplace_back();
    for (std::int64_t& index : triangle) index = static_cast<std::int64_t>(reader.number("int"));
  }
  if (!reader.at_end()) throw std::runtime_error("bytes left");
  return file;
}

}  // namespace gdfmap::test
