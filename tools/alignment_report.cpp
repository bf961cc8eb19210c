#include "alignment_report.hpp"

#include <numbers>

#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>

#include "register_report.hpp"
#include "text.hpp"

namespace gdfmap::cli {
namespace {

/// How far a cloud was moved: of its centre, and about it.
std::string motion_text(const RegistrationResult& registration) {
  const Eigen::Isometry3d& T = registration.T_target_source;
  const Vector3 moved = registration.center - T.inverse() * registration.center;
  const double angle = Eigen::AngleAxisd(T.linear()).angle() * 180.0 / std::numbers::pi;
  return fixed(moved.norm(), 3) + " m (" + point_text(moved) + "), " + fixed(angle, 2) + " degrees";
}

}  // namespace

std::string alignment_text(const AlignmentReport& report) {
  const RegistrationResult& r = report.registration;
  Table table(Table::Alignment::kLeft);
  table.add({report.accepted ? "aligned" : "rejected", report.path});
  if (!report.accepted) table.add({"because", report.reason});
  table.add({"moved by", motion_text(r)});
  table.add({"on the map", fixed(100.0 * r.inlier_ratio, 1) + " % of " +
                               grouped(std::uint64_t{r.num_points}) + " thinned points, " +
                               fixed(1000.0 * r.rmse, 1) + " mm off; noise " +
                               fixed(1000.0 * report.noise, 1) + " mm"});
  table.add({"backward", fixed(100.0 * report.backward_translation, 2) + " cm, " +
                             fixed(report.backward_rotation_deg, 3) + " degrees off"});
  if (report.num_tiles_left_out > 0) {
    table.add({"left out", grouped(std::uint64_t{report.num_tiles_left_out}) +
                               " tiles of the map: the cloud is too large to be seen at once, "
                               "cut it with --region"});
  }
  if (const auto& shifts = report.patch_shifts; !shifts.empty()) {
    table.add({"patches",
               std::to_string(shifts.size()) + ", " + fixed(100.0 * shifts[shifts.size() / 2], 2) +
                   " cm off in the middle, " + fixed(100.0 * shifts.back(), 2) + " cm at most"});
  }
  return table.text();
}

nlohmann::ordered_json alignment_json(const AlignmentReport& report) {
  return {{"path", report.path},
          {"accepted", report.accepted},
          {"reason", report.reason},
          {"registration", registration_json(report.method, report.registration)},
          {"noise", report.noise},
          {"backward_translation", report.backward_translation},
          {"backward_rotation_deg", report.backward_rotation_deg},
          {"num_tiles_left_out", report.num_tiles_left_out},
          {"patch_shifts", report.patch_shifts}};
}

void throw_if_not_aligned(std::span<const AlignmentReport> reports) {
  for (const AlignmentReport& report : reports) {
    if (report.accepted) continue;
    throw Error(ErrorCode::kCondition,
                report.path + ": not aligned, nothing was ingested: " + report.reason);
  }
}

}  // namespace gdfmap::cli
