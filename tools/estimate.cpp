#include "estimate.hpp"

#include <nlohmann/json.hpp>

#include "text.hpp"

namespace gdfmap::cli {

std::string estimate_text(const TrainingEstimate& estimate) {
  return "about " + grouped(estimate.num_cubes) + " cubes, " + byte_text(estimate.num_bytes) +
         ", " + duration_text(60.0 * estimate.core_minutes) + " on one core";
}

nlohmann::ordered_json estimate_json(const TrainingEstimate& estimate) {
  return {{"num_cubes", estimate.num_cubes},
          {"num_bytes", estimate.num_bytes},
          {"core_minutes", estimate.core_minutes}};
}

}  // namespace gdfmap::cli
