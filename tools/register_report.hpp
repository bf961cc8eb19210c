#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/align/registration.hpp>

namespace gdfmap::cli {

/// 4 × 4, row by row; every number reads back as it was.
[[nodiscard]] std::string transform_text(const Eigen::Isometry3d& T);

[[nodiscard]] std::string registration_text(const std::string& method,
                                            const RegistrationResult& result);
[[nodiscard]] nlohmann::ordered_json registration_json(const std::string& method,
                                                       const RegistrationResult& result);

}  // namespace gdfmap::cli
