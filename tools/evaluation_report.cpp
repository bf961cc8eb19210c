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
  if (e.num_off_axis_gradients > 0) {
    row.push_back(fixed(e.off_axis_norm_mean, 3));
    row.push_back(fixed(e.off_axis_norm_std, 3));
    row.push_back(fixed(e.off_axis_angle_mean_deg, 1));
  }
  table.add(std::move(row));
}

void add_bands(Table& table, const std::vector<BandStatistics>& bands) {
  for (const BandStatistics& band : bands) {
    add_row(table, rounded(band.min_distance) + " to " + rounded(band.max_distance) + " m",
            band.errors);
  }
}

std::string counts_text(const AnswerCounts& counts) {
  return grouped(counts.num_fine) + " fine, " + grouped(counts.num_coarse) + " coarse, " +
         grouped(counts.num_far) + " far, " + grouped(counts.num_unknown) + " unknown";
}

void add_counts(nlohmann::ordered_json& json, const AnswerCounts& counts) {
  json["num_fine"] = counts.num_fine;
  json["num_coarse"] = counts.num_coarse;
  json["num_far"] = counts.num_far;
  json["num_unknown"] = counts.num_unknown;
}

nlohmann::ordered_json errors_json(const ErrorStatistics& e) {
  return {{"num_samples", e.num_samples},
          {"mae", e.mae},
          {"median", e.median},
          {"rmse", e.rmse},
          {"p95", e.p95},
          {"max", e.max},
          {"relative_p95", e.relative_p95},
          {"own_cube_mae", e.own_cube_mae},
          {"mean_expected_error", e.expected_error},
          {"num_gradients", e.num_gradients},
          {"num_nan_gradients", e.num_nan_gradients},
          {"gradient_norm_mean", e.gradient_norm_mean},
          {"gradient_norm_std", e.gradient_norm_std},
          {"gradient_angle_mean_deg", e.gradient_angle_mean_deg},
          {"num_off_axis_gradients", e.num_off_axis_gradients},
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

nlohmann::ordered_json level_json(const LevelStatistics& level) {
  nlohmann::ordered_json json = {{"level", level.level}};
  json.update(errors_json(level.errors));
  add_counts(json, level.answers);
  json["bands"] = bands_json(level.bands);
  return json;
}

}  // namespace

std::string evaluation_text(const Evaluation& evaluation) {
  Table table(Table::Alignment::kRight);
  table.add({"errors in metres", "samples", "mae", "median", "rmse", "p95", "max", "norm", "+-",
             "angle", "off axis: norm", "+-", "angle"});
  add_row(table, "level 0", evaluation.all);
  add_row(table, "  populated cubes", evaluation.populated);
  add_row(table, "  empty cubes", evaluation.empty);
  add_row(table, "  outer shell", evaluation.outer_shell);
  for (const LevelStatistics& level : evaluation.levels) {
    if (level.level > 0) add_row(table, "level " + std::to_string(level.level), level.errors);
  }
  add_bands(table, evaluation.bands);
  add_bands(table, evaluation.gradient_bands);
  Table rest(Table::Alignment::kLeft);
  rest.add({"own cube alone", fixed(evaluation.populated.own_cube_mae, 4) + " m in populated, " +
                                  fixed(evaluation.empty.own_cube_mae, 4) + " m in empty cubes"});
  rest.add({"expected error", fixed(evaluation.all.expected_error, 4) + " m on average (level 0)"});
  rest.add({"answers", counts_text(evaluation.answers)});
  if (evaluation.beyond.total() > 0) rest.add({"in no cube", counts_text(evaluation.beyond)});
  rest.add({"stated", fixed(100.0 * evaluation.stated_share, 1) + " % of the space within " +
                          rounded(kMaxJudgedDistance) + " m of the points, where it was judged"});
  rest.add({"set aside", grouped(evaluation.num_set_aside)});
  rest.add({"gradients", grouped(evaluation.all.num_nan_gradients) + " of " +
                             grouped(evaluation.all.num_gradients) + " not a number (level 0)"});
  return table.text() + "\n" + rest.text();
}

nlohmann::ordered_json evaluation_json(const Evaluation& evaluation) {
  nlohmann::ordered_json json = errors_json(evaluation.all);
  add_counts(json, evaluation.answers);
  json["num_set_aside"] = evaluation.num_set_aside;
  json["stated_share"] = evaluation.stated_share;
  json["beyond"] = nlohmann::ordered_json::object();
  add_counts(json["beyond"], evaluation.beyond);
  json["populated"] = errors_json(evaluation.populated);
  json["empty"] = errors_json(evaluation.empty);
  json["outer_shell"] = errors_json(evaluation.outer_shell);
  json["bands"] = bands_json(evaluation.bands);
  json["gradient_bands"] = bands_json(evaluation.gradient_bands);
  json["levels"] = nlohmann::ordered_json::array();
  for (const LevelStatistics& level : evaluation.levels) {
    json["levels"].push_back(level_json(level));
  }
  return json;
}

}  // namespace gdfmap::cli
