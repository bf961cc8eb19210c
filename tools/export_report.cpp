#include "export_report.hpp"

#include <nlohmann/json.hpp>

#include "text.hpp"

namespace gdfmap::cli {

std::string export_text(const ExportReport& report, const std::string& path) {
  Table table(Table::Alignment::kLeft);
  table.add({"written", path});
  table.add({"cubes",
             grouped(report.num_cubes) + " with " + grouped(report.num_gaussians) + " Gaussians"});
  table.add(
      {"left out", grouped(report.num_poor) + " poor, " + grouped(report.num_failed) + " failed"});
  if (!report.shift.isZero(0.0)) {
    table.add({"shift", point_text(report.shift) + " m, subtracted; see " + path + ".json"});
  }
  return table.text();
}

nlohmann::ordered_json export_json(const ExportReport& report) {
  return {{"num_cubes", report.num_cubes},
          {"num_gaussians", report.num_gaussians},
          {"num_poor", report.num_poor},
          {"num_failed", report.num_failed},
          {"shift", {report.shift.x(), report.shift.y(), report.shift.z()}}};
}

}  // namespace gdfmap::cli
