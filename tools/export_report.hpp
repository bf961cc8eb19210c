#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include <gdfmap/pipeline/model_exchange.hpp>

namespace gdfmap::cli {

[[nodiscard]] std::string export_text(const ExportReport& report, const std::string& path);
[[nodiscard]] nlohmann::ordered_json export_json(const ExportReport& report);

}  // namespace gdfmap::cli
