#include "ingest_report.hpp"

#include <nlohmann/json.hpp>

#include "text.hpp"

namespace gdfmap::cli {
namespace {

nlohmann::ordered_json counts_json(const IngestCounts& counts) {
  return {{"num_read", counts.num_read},
          {"num_stored", counts.num_stored},
          {"num_duplicates", counts.num_duplicates},
          {"num_thinned", 0},
          {"num_rejected",
           {{"not_finite", counts.num_rejected_not_finite},
            {"withheld", counts.num_rejected_withheld},
            {"zero", counts.num_rejected_zero},
            {"out_of_range", counts.num_rejected_out_of_range}}}};
}

nlohmann::ordered_json source_json(const IngestReport& report) {
  nlohmann::ordered_json json = {{"path", report.source.path},
                                 {"already_present", report.already_present},
                                 {"identity", report.source.identity.hex()},
                                 {"num_bytes", report.source.num_bytes}};
  json.update(counts_json(report.source.counts));
  return json;
}

void add(IngestCounts& sum, const IngestCounts& counts) {
  sum.num_read += counts.num_read;
  sum.num_stored += counts.num_stored;
  sum.num_duplicates += counts.num_duplicates;
  sum.num_rejected_not_finite += counts.num_rejected_not_finite;
  sum.num_rejected_withheld += counts.num_rejected_withheld;
  sum.num_rejected_zero += counts.num_rejected_zero;
  sum.num_rejected_out_of_range += counts.num_rejected_out_of_range;
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
  return text.empty() ? "" : " (" + text + ")";
}

}  // namespace

std::string ingest_text(const IngestReport& report) {
  const IngestCounts& counts = report.source.counts;
  Table table(Table::Alignment::kLeft);
  table.add({"source", report.source.path + ", " + byte_text(report.source.num_bytes)});
  if (report.already_present) table.add({"unchanged", "it is in the map already"});
  table.add({"read", grouped(counts.num_read) + " points"});
  table.add({"stored", grouped(counts.num_stored)});
  table.add({"duplicates", grouped(counts.num_duplicates)});
  table.add({"rejected", grouped(counts.num_rejected()) + reasons_text(counts)});
  return table.text();
}

nlohmann::ordered_json ingest_json(std::span<const IngestReport> reports) {
  nlohmann::ordered_json sources = nlohmann::ordered_json::array();
  IngestCounts sum;
  for (const IngestReport& report : reports) {
    sources.push_back(source_json(report));
    if (!report.already_present) add(sum, report.source.counts);
  }
  nlohmann::ordered_json json = counts_json(sum);
  json["sources"] = std::move(sources);
  return json;
}

}  // namespace gdfmap::cli
