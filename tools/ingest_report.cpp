#include "ingest_report.hpp"

#include <nlohmann/json.hpp>

#include "text.hpp"

namespace gdfmap::cli {
namespace {

nlohmann::ordered_json counts_json(const IngestCounts& counts) {
  return {{"num_read", counts.num_read},
          {"num_stored", counts.num_stored},
          {"num_duplicates", counts.num_duplicates},
          {"num_thinned", counts.num_thinned},
          {"num_rejected",
           {{"not_finite", counts.num_rejected_not_finite},
            {"withheld", counts.num_rejected_withheld},
            {"zero", counts.num_rejected_zero},
            {"out_of_range", counts.num_rejected_out_of_range},
            {"outside", counts.num_rejected_outside}}}};
}

/// ", 3 not finite, 1 withheld": the reasons that occurred.
std::string reasons_text(const IngestCounts& counts) {
  std::string text;
  const auto append = [&](std::uint64_t count, const char* reason) {
    if (count > 0) text += (text.empty() ? "" : ", ") + grouped(count) + " " + reason;
  };
  append(counts.num_rejected_not_finite, "not finite");
  append(counts.num_rejected_withheld, "withheld");
  append(counts.num_rejected_zero, "exactly zero");
  append(counts.num_rejected_out_of_range, "out of range");
  append(counts.num_rejected_outside, "outside the region");
  return text.empty() ? "" : " (" + text + ")";
}

void add_counts(Table& table, const IngestCounts& counts) {
  table.add({"read", grouped(counts.num_read) + " points"});
  table.add({"stored", grouped(counts.num_stored)});
  table.add({"duplicates", grouped(counts.num_duplicates)});
  if (counts.num_thinned > 0) table.add({"thinned", grouped(counts.num_thinned)});
  table.add({"rejected", grouped(counts.num_rejected()) + reasons_text(counts)});
}

void add_sensor(Table& table, const SourceRecord& source) {
  if (source.sensor_origin) table.add({"sensor at", point_text(*source.sensor_origin) + " m"});
}

}  // namespace

std::string source_text(const SourceRecord& source) {
  Table table(Table::Alignment::kLeft);
  table.add({"source",
             std::to_string(source.id) + ": " + source.path + ", " + byte_text(source.num_bytes)});
  table.add({"options", source.parameters});
  if (!source.alignment.empty()) table.add({"aligned", source.alignment});
  add_sensor(table, source);
  add_counts(table, source.counts);
  return table.text();
}

nlohmann::ordered_json source_json(const SourceRecord& source) {
  nlohmann::ordered_json json = {{"id", source.id},
                                 {"path", source.path},
                                 {"parameters", source.parameters},
                                 {"identity", source.identity.hex()},
                                 {"num_bytes", source.num_bytes}};
  json["sensor_origin"] = nullptr;
  if (const auto& origin = source.sensor_origin) {
    json["sensor_origin"] = {origin->x(), origin->y(), origin->z()};
  }
  json["alignment"] = nullptr;
  if (!source.alignment.empty()) json["alignment"] = source.alignment;
  json.update(counts_json(source.counts));
  return json;
}

std::string ingest_text(const IngestReport& report) {
  Table table(Table::Alignment::kLeft);
  table.add({"source", std::to_string(report.source.id) + ": " + report.source.path + ", " +
                           byte_text(report.source.num_bytes)});
  if (report.already_present) table.add({"unchanged", "it is in the map already"});
  if (report.sensor_origin_changed) table.add({"changed", "where the sensor stood"});
  add_sensor(table, report.source);
  add_counts(table, report.source.counts);
  return table.text();
}

nlohmann::ordered_json ingest_json(std::span<const IngestReport> reports) {
  nlohmann::ordered_json sources = nlohmann::ordered_json::array();
  IngestCounts sum;
  for (const IngestReport& report : reports) {
    sources.push_back(source_json(report.source));
    sources.back()["already_present"] = report.already_present;
    sources.back()["sensor_origin_changed"] = report.sensor_origin_changed;
    if (!report.already_present) sum += report.source.counts;
  }
  nlohmann::ordered_json json = counts_json(sum);
  json["sources"] = std::move(sources);
  return json;
}

}  // namespace gdfmap::cli
