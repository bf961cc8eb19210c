#pragma once

#include <filesystem>
#include <optional>

#include <gdfmap/core/run_context.hpp>
#include <gdfmap/pipeline/configuration.hpp>
#include <gdfmap/pipeline/ingest.hpp>
#include <gdfmap/pipeline/model_exchange.hpp>
#include <gdfmap/train/train.hpp>

namespace gdfmap {

struct BuildReport {
  std::filesystem::path map;
  IngestReport ingest;
  TrainReport train;
  std::optional<ExportReport> bin, csv;
};

/// The ancestor's job in one call: ingests io.input_file into `<output_base>.gdfmap`, trains it,
/// and writes `<output_base>.bin` and `.csv`. Run again it continues, or finds nothing to do.
/// @throws Error kUsage when io.input_file or io.output_base is missing, or when the map holds
/// another
///         cloud than this one.
BuildReport build(const Configuration& configuration, const RunContext& context = {});

}  // namespace gdfmap
