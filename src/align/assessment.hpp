#pragma once

#include <gdfmap/align/registration.hpp>

namespace gdfmap {

/// Fills in all that is known of result.T_target_source, and the status: what its gates say, or, if
/// they say nothing, kConverged or kMaxIterations.
void assess(const MapWindow& target, const Scan& source, const RegistrationOptions& options,
            bool converged, RegistrationResult& result);

}  // namespace gdfmap
