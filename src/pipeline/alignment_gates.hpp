#pragma once

#include <gdfmap/align/registration.hpp>
#include <gdfmap/pipeline/aligned_ingest.hpp>

namespace gdfmap {

/// A scan registered with a map, and what judging that takes. The parts outlive it.
struct AlignmentCase {
  const RegistrationMethod& method;
  const RegistrationMethod& backward_method;  ///< of the map onto the scan
  const MapWindow& map;
  std::span<const Vector3> p_nominal;  ///< of the scan
  const RegistrationOptions& registration;
};

/// Puts a registered scan through the gates: fills in all of the report beyond its registration.
void judge_alignment(const AlignmentCase& alignment, const AlignmentOptions& options,
                     AlignmentReport& report);

}  // namespace gdfmap
