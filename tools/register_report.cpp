#include "register_report.hpp"

#include <numbers>
#include <vector>

#include <nlohmann/json.hpp>

#include "text.hpp"

namespace gdfmap::cli {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

template <typename Derived>
nlohmann::ordered_json matrix_json(const Eigen::MatrixBase<Derived>& matrix) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    nlohmann::ordered_json row = nlohmann::ordered_json::array();
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) row.push_back(matrix(r, c));
    rows.push_back(row);
  }
  return rows;
}

template <typename Derived>
nlohmann::ordered_json vector_json(const Eigen::MatrixBase<Derived>& vector) {
  return matrix_json(vector.transpose()).front();
}

/// "x", "yaw" and the like where a motion is mostly one of them, else its six numbers.
std::string motion_text(const Twist& motion) {
  static constexpr const char* kNames[] = {"along x", "along y", "along z",
                                           "about x", "about y", "about z"};
  constexpr double kMostly = 0.95;
  Eigen::Index axis = 0;
  if (motion.cwiseAbs().maxCoeff(&axis) >= kMostly) return kNames[axis];
  std::string text;
  for (const double c : motion) text += (text.empty() ? "(" : ", ") + rounded(c, 2);
  return text + ")";
}

std::string deviation_text(const RegistrationResult& result) {
  const Twist deviation = result.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const double metres = deviation.head<3>().maxCoeff();
  const double degrees = deviation.tail<3>().maxCoeff() / kDegree;
  return rounded(metres, 2) + " m, " + rounded(degrees, 2) + " degrees";
}

}  // namespace

std::string transform_text(const Eigen::Isometry3d& T) {
  std::string text;
  for (Eigen::Index r = 0; r < 4; ++r) {
    for (Eigen::Index c = 0; c < 4; ++c) text += (c > 0 ? " " : "") + exact(T.matrix()(r, c));
    text += "\n";
  }
  return text;
}

std::string registration_text(const std::string& method, const RegistrationResult& result) {
  Table table(Table::Alignment::kLeft);
  const std::string reason = result.reason.empty() ? "" : ": " + result.reason;
  table.add({"status", name_of(result.status) + reason});
  table.add({"method", method + ", " + grouped(std::int64_t{result.iterations}) + " iterations"});
  table.add({"inliers", rounded(100.0 * result.inlier_ratio, 3) + " % of " +
                            grouped(std::uint64_t{result.num_points}) +
                            " thinned points, in the worst direction " +
                            rounded(100.0 * result.direction_ratio, 3) + " %"});
  if (!result.information.isZero()) {  // else too little lies on the target for figures
    table.add({"rmse", rounded(result.rmse, 3) + " m"});
    table.add({"deviation", deviation_text(result) + ", at most, if errors are independent"});
  }
  for (const Twist& motion : result.unobservable) {
    table.add({"unobserved", motion_text(motion)});
  }
  return table.text() + "T_target_source\n" + transform_text(result.T_target_source);
}

nlohmann::ordered_json registration_json(const std::string& method,
                                         const RegistrationResult& result) {
  nlohmann::ordered_json unobservable = nlohmann::ordered_json::array();
  for (const Twist& motion : result.unobservable) unobservable.push_back(vector_json(motion));
  return {{"status", name_of(result.status)},
          {"reason", result.reason},
          {"method", method},
          {"T_target_source", matrix_json(result.T_target_source.matrix())},
          {"iterations", result.iterations},
          {"inlier_ratio", result.inlier_ratio},
          {"direction_ratio", result.direction_ratio},
          {"rmse", result.rmse},
          {"num_points", result.num_points},
          {"num_inliers", result.num_inliers},
          {"center", vector_json(result.center)},
          {"eigenvalues", vector_json(result.eigenvalues)},
          {"unobservable", unobservable},
          {"information", matrix_json(result.information)},
          {"covariance", matrix_json(result.covariance)}};
}

}  // namespace gdfmap::cli
