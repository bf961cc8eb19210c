#include <gdfmap/core/bytes.hpp>

#include "format.hpp"
#include "model_output.hpp"

namespace gdfmap::gdf1 {
namespace {

void put_vector(ByteWriter& out, const Vector3& v) {
  for (Eigen::Index a = 0; a < 3; ++a) out.put(static_cast<float>(v[a]));
}

class Gdf1Writer final : public ModelWriter {
 public:
  Gdf1Writer(const std::filesystem::path& path, double cube_size, const Vector3& shift,
             const Digest& content_digest)
      : output_(path, ModelFormat::kGdf1, cube_size, shift, content_digest) {}

  void write(const Gdf1Cube& cube) override {
    ByteWriter out;
    for (const float value : output_.admit(cube)) out.put(value);
    out.put(cube.mae);
    out.put(cube.standard_deviation);
    out.put(static_cast<std::uint32_t>(cube.gaussians.size()));
    for (std::size_t k = 0; k < cube.gaussians.size(); ++k) put_gaussian(out, cube, k);
    output_.append(out.bytes());
  }

  void finish(const Gdf1Header& header) override {
    output_.write_front(encode(header));
    output_.publish(header);
  }

 private:
  void put_gaussian(ByteWriter& out, const Gdf1Cube& cube, std::size_t k) const {
    const Gaussians& g = cube.gaussians;
    const std::array<std::int64_t, 3> key = {cube.key.x, cube.key.y, cube.key.z};
    out.put(static_cast<std::uint32_t>(k));
    for (std::size_t a = 0; a < 3; ++a) {
      out.put(output_.placement().file_mean(key[a], a, g.at(kMeanX + a, k)));
    }
    for (std::size_t a = 0; a < 3; ++a) out.put(g.at(kRootSigmaX + a, k));
    out.put(g.at(kWeight, k));
  }

  [[nodiscard]] Bytes encode(const Gdf1Header& header) const {
    ByteWriter out;
    out.put_bytes(std::as_bytes(std::span(kMagic)));
    out.put(kVersion);
    out.put(header.num_cubes);
    out.put(header.average_mae);
    out.put(header.average_standard_deviation);
    const Vector3 shift = output_.placement().shift();
    const bool empty = header.bounds.isEmpty();
    put_vector(out, empty ? Vector3::Zero() : Vector3(header.bounds.min() - shift));
    put_vector(out, empty ? Vector3::Zero() : Vector3(header.bounds.max() - shift));
    out.put(static_cast<float>(header.cube_size));
    out.put(static_cast<float>(header.empty_search_margin));
    out.put(static_cast<float>(header.margin));
    out.put_bytes(Bytes(kReservedBytes));
    return out.take();
  }

  ModelOutput output_;
};

}  // namespace

std::unique_ptr<ModelWriter> create_gdf1(const std::filesystem::path& path, double cube_size,
                                         const Vector3& shift, const Digest& content_digest) {
  return std::make_unique<Gdf1Writer>(path, cube_size, shift, content_digest);
}

}  // namespace gdfmap::gdf1
