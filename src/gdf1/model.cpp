#include <algorithm>
#include <string>

#include <gdfmap/core/error.hpp>
#include <gdfmap/gdf1/model.hpp>

#include "format.hpp"

namespace gdfmap {

ModelFormat model_format(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  if (extension == ".bin") return ModelFormat::kGdf1;
  if (extension == ".csv") return ModelFormat::kCsv;
  throw Error(ErrorCode::kUsage,
              path.string() + ": the name of a model ends in .bin (GDF1) or .csv");
}

std::unique_ptr<ModelWriter> create_model(const std::filesystem::path& path, double cube_size,
                                          const Vector3& shift, const Digest& content_digest) {
  switch (model_format(path)) {
    case ModelFormat::kGdf1:
      return gdf1::create_gdf1(path, cube_size, shift, content_digest);
    case ModelFormat::kCsv:
      break;
  }
  return gdf1::create_csv(path, cube_size, shift, content_digest);
}

ModelSummary visit_model(const std::filesystem::path& path, const CubeVisitor& visit,
                         std::optional<double> cube_size) {
  switch (model_format(path)) {
    case ModelFormat::kGdf1:
      return gdf1::visit_gdf1(path, visit);
    case ModelFormat::kCsv:
      break;
  }
  return gdf1::visit_csv(path, visit, cube_size);
}

Model read_model(const std::filesystem::path& path, std::optional<double> cube_size) {
  Model model;
  const auto keep = [&](Gdf1Cube&& cube) { model.cubes.push_back(std::move(cube)); };
  const ModelSummary summary = visit_model(path, keep, cube_size);
  model.header = summary.header;
  model.counts = summary.counts;
  return model;
}

Gdf1Header read_model_header(const std::filesystem::path& path, std::optional<double> cube_size) {
  if (model_format(path) == ModelFormat::kGdf1) return gdf1::read_gdf1_header(path);
  return gdf1::visit_csv(
             path, [](Gdf1Cube&&) {}, cube_size)
      .header;
}

}  // namespace gdfmap
