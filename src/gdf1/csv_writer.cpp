#include <array>
#include <charconv>
#include <string>

#include "format.hpp"
#include "model_output.hpp"

namespace gdfmap::gdf1 {
namespace {

/// The shortest decimal that reads back as the same float: both formats hold the same numbers.
void append_number(std::string& text, float value) {
  std::array<char, 32> digits;
  const auto result = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), result.ptr);
}

class CsvWriter final : public ModelWriter {
 public:
  CsvWriter(const std::filesystem::path& path, double cube_size, const Vector3& shift,
            const Digest& content_digest)
      : output_(path, ModelFormat::kCsv, cube_size, shift, content_digest) {
    append(std::string(kCsvHeader) + "\n");
  }

  void write(const Gdf1Cube& cube) override {
    std::string front;  // the same in all rows of a cube
    for (const float value : output_.admit(cube)) {
      append_number(front, value);
      front += ',';
    }
    append_number(front, cube.mae);
    front += ',';
    append_number(front, cube.standard_deviation);
    std::string rows;
    for (std::size_t k = 0; k < cube.gaussians.size(); ++k) {
      rows += front + ',' + std::to_string(k);
      append_gaussian(rows, cube, k);
      rows += '\n';
    }
    append(rows);
  }

  void finish(const Gdf1Header& header) override { output_.publish(header); }

 private:
  void append(const std::string& text) { output_.append(std::as_bytes(std::span(text))); }

  void append_gaussian(std::string& row, const Gdf1Cube& cube, std::size_t k) const {
    const std::array<std::int64_t, 3> key = {cube.key.x, cube.key.y, cube.key.z};
    for (std::size_t r = 0; r < kNumGaussianRows; ++r) {
      const float value = cube.gaussians.at(r, k);
      row += ',';
      append_number(row, r < 3 ? output_.placement().file_mean(key[r], r, value) : value);
    }
  }

  ModelOutput output_;
};

}  // namespace

std::unique_ptr<ModelWriter> create_csv(const std::filesystem::path& path, double cube_size,
                                        const Vector3& shift, const Digest& content_digest) {
  return std::make_unique<CsvWriter>(path, cube_size, shift, content_digest);
}

}  // namespace gdfmap::gdf1
