#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>

#include <gdfmap/gdf1/model.hpp>

namespace gdfmap::gdf1 {

// schema/gdf1_format.md says what the bytes mean.
inline constexpr std::string_view kMagic = "GDF1";
inline constexpr std::uint32_t kVersion = 1;
inline constexpr std::size_t kHeaderBytes = 120;
inline constexpr std::size_t kReservedBytes = 64;
inline constexpr std::size_t kCubeBytes = 24;
inline constexpr std::size_t kGaussianBytes = 32;

inline constexpr std::string_view kCsvHeader =
    "CubeX,CubeY,CubeZ,MAE,StdDev,G_ID,MeanX,MeanY,MeanZ,SigmaX,SigmaY,SigmaZ,Weight";
inline constexpr std::size_t kCsvColumns = 13;

/// Narrower Gaussians (metres) are zero almost everywhere and not-a-number in float32 gradients.
inline constexpr double kMinStandardDeviation = 1e-3;

/// Exported minima are floored to this many cubes.
inline constexpr std::int64_t kShiftCubes = 1024;

/// Where the digest in PATH.json starts to count: after what is patched when the writer finishes.
[[nodiscard]] constexpr std::size_t digest_offset(ModelFormat format) {
  return format == ModelFormat::kGdf1 ? kHeaderBytes : 0;
}

/// One per format; arguments as for create_model().
[[nodiscard]] std::unique_ptr<ModelWriter> create_gdf1(const std::filesystem::path& path,
                                                       double cube_size, const Vector3& shift,
                                                       const Digest& content_digest);
[[nodiscard]] std::unique_ptr<ModelWriter> create_csv(const std::filesystem::path& path,
                                                      double cube_size, const Vector3& shift,
                                                      const Digest& content_digest);

/// One per format; arguments as for visit_model().
ModelSummary visit_gdf1(const std::filesystem::path& path, const CubeVisitor& visit);
ModelSummary visit_csv(const std::filesystem::path& path, const CubeVisitor& visit,
                       std::optional<double> cube_size);
[[nodiscard]] Gdf1Header read_gdf1_header(const std::filesystem::path& path);

}  // namespace gdfmap::gdf1
