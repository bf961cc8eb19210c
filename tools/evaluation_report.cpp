#include "evaluation_report.hpp"

#include <nlohmann/json.hpp>

#include "text.hpp"

namespace gdfmap::cli {
namespace {

void add_row(Table& table, const std::string& name, const ErrorStatistics& e) {
  if (e.num_samples == 0) {
    table.add({name, "0"});
    return;
  }
  std::vector<std::string> row = {name, grouped(e.num_samples)};
  for (const double error : {e.mae, e.median, e.rmse, e.p95, e.max}) row.push_back(fixed(error, 4));
  if (e.num_gradients > 0) {
    row.push_back(fixed(e.gradient_norm_mean, 3));
    row.push_back(fixed(e.gradient_norm_std, 3));
    row.push_back(fixed(e.gradient_angle_mean_deg, 1));
  }
  table.add(std::move(row));
}

std::string band_name(const BandStatistics& band) {
  return rounded(band.min_distance) + " to " + rounded(band.max_distance) + " m";
}

nlohmann::ordered_json errors_json(const ErrorStatistics& e) {
  return {{"num_samples", e.num_samples},
          {"mae", e.mae},
          {"median", e.median},
          {"rmse", e.rmse},
          {"p95", e.p95},
          {"max", e.max},
          {"num_gradients", e.num_gradients},
          {"num_nan_gradients", e.num_nan_gradients},
          {"gradient_norm_mean", e.gradient_norm_mean},
          {"gradient_norm_std", e.gradient_norm_std},
          {"gradient_angle_mean_deg", e.gradient_angle_mean_deg},
          {"off_axis_norm_mean", e.off_axis_norm_mean},
          {"off_axis_norm_std", e.off_axis_norm_std},
          {"off_axis_angle_mean_deg", e.off_axis_angle_mean_deg}};
}

nlohmann::ordered_json bands_json(const std::vector<BandStatistics>& bands) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const BandStatistics& band : bands) {
    nlohmann::ordered_json entry = {{"min_distance", band.min_distance},
                                    {"max_distance", band.max_distance}};
    entry.update(errors_json(band.errors));
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace

std::string evaluation_text(const Evaluation& evaluation) {
  Table table(Table::Alignment::kRight);
  table.add({"errors in metres", "samples", "mae", "median", "rmse", "p95", "max", "norm", "+-",
             "angle (deg)"});
  add_row(table, "all", evaluation.all);
  add_row(table, "populated cubes", evaluation.populated);
  add_row(table, "empty cubes", evaluation.empty);
  add_row(table, "outer shell", evaluation.outer_shell);
  for (const BandStatistics& band : evaluation.bands) add_row(table, band_name(band), band.errors);
  Table rest(Table::Alignment::kLeft);
  rest.add({"expected error", fixed(evaluation.mean_expected_error, 4) + " m on average"});
  rest.add({"answers", grouped(evaluation.num_fine) + " fine, " + grouped(evaluation.num_coarse) +
                           " coarse, " + grouped(evaluation.num_far) + " far, " +
                           grouped(evaluation.num_unknown) + " unknown"});
  rest.add({"set aside", grouped(evaluation.num_set_aside)});
  rest.add({"gradients", grouped(evaluation.all.num_nan_gradients) +
                             " not a number; norm off the " + "medial axis " +
                             fixed(evaluation.all.off_axis_norm_mean, 3) + " +- " +
                             fixed(evaluation.all.off_axis_norm_std, 3)});
  return table.text() + "\n" + rest.text();
}

nlohmann::ordered_json evaluation_json(const Evaluation& evaluation) {
  nlohmann::ordered_json json = errors_json(evaluation.all);
  json["num_fine"] = evaluation.num_fine;
  json["num_coarse"] = evaluation.num_coarse;
  json["num_far"] = evaluation.num_far;
  json["num_unknown"] = evaluation.num_unknown;
  json["num_set_aside"] = evaluation.num_set_aside;
  json["mean_expected_error"] = evaluation.mean_expected_error;
  json["populated"] = errors_json(evaluation.populated);
  json["empty"] = errors_json(evaluation.empty);
  json["outer_shell"] = errors_json(evaluation.outer_shell);
  json["bands"] = bands_json(evaluation.bands);
  nlohmann::ordered_json level = {{"level", 0}};  // the only one that is trained
  level.update(errors_json(evaluation.all));
  json["levels"] = nlohmann::ordered_json::array({std::move(level)});
  return json;
}

}  // namespace gdfmap::cli
