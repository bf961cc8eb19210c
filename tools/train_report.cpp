#include "train_report.hpp"

#include <nlohmann/json.hpp>

#include <gdfmap/core/error.hpp>

#include "text.hpp"

namespace gdfmap::cli {
namespace {

double cubes_per_second(const TrainReport& report, double seconds) {
  return static_cast<double>(report.num_cubes_fitted) / seconds;
}

}  // namespace

std::string train_text(const TrainReport& report, double seconds) {
  Table table(Table::Alignment::kLeft);
  table.add({"tiles", grouped(report.num_tiles) + ", " + grouped(report.num_tiles_trained) +
                          " of them trained, " + grouped(report.num_tiles_deleted) + " deleted"});
  if (report.num_tiles_damaged > 0) table.add({"damaged", grouped(report.num_tiles_damaged)});
  table.add({"fitted", grouped(report.num_cubes_fitted) + " cubes in " + duration_text(seconds) +
                           ", " + rounded(cubes_per_second(report, seconds), 3) + " cubes/s"});
  table.add({"unchanged", grouped(report.num_cubes_unchanged)});
  table.add({"poor", grouped(report.num_cubes_poor)});
  table.add({"failed", grouped(report.num_cubes_failed)});
  if (report.num_tiles_trained == 0) table.add({"", "the map was up to date"});
  return table.text();
}

nlohmann::ordered_json train_json(const TrainReport& report, double seconds) {
  return {{"num_tiles", report.num_tiles},
          {"num_tiles_trained", report.num_tiles_trained},
          {"num_tiles_deleted", report.num_tiles_deleted},
          {"num_tiles_damaged", report.num_tiles_damaged},
          {"num_cubes_fitted", report.num_cubes_fitted},
          {"num_cubes_unchanged", report.num_cubes_unchanged},
          {"num_cubes_out_of_reach", report.num_cubes_out_of_reach},
          {"num_cubes_poor", report.num_cubes_poor},
          {"num_cubes_failed", report.num_cubes_failed},
          {"seconds", seconds},
          {"cubes_per_second", cubes_per_second(report, seconds)}};
}

void throw_if_cubes_failed(Map& map) {
  const std::int64_t num_failed = map.cubes().totals().num_failed;
  if (num_failed == 0) return;
  throw Error(ErrorCode::kCondition,
              "cubes without a fit in " + map.path().string() + ": " + grouped(num_failed) +
                  "; `gdfmap tile` counts them by tile, all others are served");
}

}  // namespace gdfmap::cli
