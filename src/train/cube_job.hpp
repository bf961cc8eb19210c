#pragma once

#include <span>
#include <vector>

#include <gdfmap/fit/cube_fit.hpp>
#include <gdfmap/store/tile_record.hpp>

namespace gdfmap {

/// Where cubes.db keeps the configuration that it was trained with, in canonical form.
inline constexpr const char* kFitConfigKey = "fit_config";

/// What one cube is fitted to; owns its samples.
struct CubeJob {
  CubeKey key;
  bool populated = false;
  double edge = 1.0;                     ///< metres
  std::vector<float> targets, held_out;  ///< on the grid of its class
};

/// Digest of everything that decides a cube's record: its samples, its class, the configuration and
/// the fit version, in 48 bits. Equal digests, equal records.
[[nodiscard]] std::uint64_t input_digest(const CubeJob& job, const Digest& configuration);

/// Digest of a configuration and the fit version.
[[nodiscard]] Digest configuration_digest(const FitConfig& config);

/// Fits cubes of one level: a pure function of each, whatever the others and the thread.
/// @param inputs  their input digests
/// @param fitter  of this configuration
[[nodiscard]] std::vector<CubeRecord> run(std::span<const CubeJob> jobs,
                                          std::span<const std::uint64_t> inputs,
                                          const FitConfig& config, CubeFitter& fitter);

}  // namespace gdfmap
