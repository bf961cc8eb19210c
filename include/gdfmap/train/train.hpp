#pragma once

#include <cstdint>
#include <optional>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/fit/fit_config.hpp>
#include <gdfmap/map/map.hpp>

namespace gdfmap {

struct TrainOptions {
  /// Empty: the configuration that the map was trained with, or the defaults for its cube size.
  std::optional<FitConfig> config;
  /// Lets `config` replace a different stored one; the map is then fitted again as a whole.
  bool retrain = false;
};

/// What one run did.
struct TrainReport {
  std::int64_t num_tiles = 0;          ///< candidates: occupied tiles and their surroundings
  std::int64_t num_tiles_trained = 0;  ///< of them stale, and brought up to date by this run
  std::int64_t num_tiles_deleted = 0;  ///< no candidates any more
  std::int64_t num_tiles_damaged = 0;  ///< found damaged, each also told as a warning
  std::int64_t num_cubes_fitted = 0;
  std::int64_t num_cubes_unchanged = 0;     ///< in stale tiles, but with the same inputs as before
  std::int64_t num_cubes_out_of_reach = 0;  ///< of them, which no change can have reached
  std::int64_t num_cubes_poor = 0;          ///< of the fitted ones
  std::int64_t num_cubes_failed = 0;        ///< of the fitted ones
};

/// Brings the cubes of a map (opened for writing) in line with its points. Fits only cubes whose
/// inputs changed; the result depends on the points and the configuration alone, not on what was
/// trained before, nor on threads or memory. Stored tiles that are damaged are fitted again.
/// Interrupted, it has committed what was finished: run it again.
/// @throws Error kUsage when `config` differs from the stored one without `retrain` (the message
/// lists
///         the keys), kInterrupted when stopped, and what the stores throw.
TrainReport train(Map& map, const TrainOptions& options = {}, const RunContext& context = {});

}  // namespace gdfmap
