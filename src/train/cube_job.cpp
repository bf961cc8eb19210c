#include "cube_job.hpp"

#include <algorithm>

#include <gdfmap/core/bytes.hpp>
#include <gdfmap/field/quantization.hpp>

namespace gdfmap {

Digest configuration_digest(const FitConfig& config) {
  ByteWriter writer;
  writer.put(kFitVersion);
  const std::string text = config.canonical();
  writer.put_bytes(std::as_bytes(std::span(text)));
  return hash128(writer.bytes());
}

Digest input_digest(const CubeJob& job, const Digest& configuration) {
  ByteWriter writer;
  writer.put(configuration);
  writer.put(job.key.level);
  writer.put(job.edge);
  writer.put(static_cast<std::uint8_t>(job.populated));
  for (const float target : job.targets) writer.put(target);
  for (const float target : job.held_out) writer.put(target);
  return hash128(writer.bytes());
}

namespace {

CubeRecord record_of(const CubeJob& job, CubeFit fit, const Digest& input,
                     const FitConfig& config) {
  CubeRecord record;
  record.index = cube_index_in_tile(job.key);
  record.cube_class = job.populated ? CubeClass::kPopulated : CubeClass::kEmpty;
  record.num_iterations = fit.num_iterations;
  const auto kept = [&](float value) {
    return config.codec == CubeCodec::kQuantized ? round_up_to_8_bits(value) : value;
  };
  record.reach = kept(*std::max_element(job.targets.begin(), job.targets.end()));
  record.input = input;
  if (!fit.finite) {
    record.status = CubeStatus::kFailed;
    record.failure = FailureReason::kNotFinite;
    return record;
  }
  const double threshold =
      config.mae_threshold_max * static_cast<double>(level_scale(job.key.level));
  record.status = fit.errors.mae > threshold ? CubeStatus::kPoor : CubeStatus::kFitted;
  record.errors = {kept(fit.errors.mae), kept(fit.errors.rmse), kept(fit.errors.p95),
                   kept(fit.errors.max)};
  record.gaussians = std::move(fit.gaussians);
  return record;
}

}  // namespace

std::vector<CubeRecord> run(std::span<const CubeJob> jobs, std::span<const Digest> inputs,
                            const FitConfig& config, CubeFitter& fitter) {
  std::vector<CubeSamples> samples;
  for (const CubeJob& job : jobs) {
    samples.push_back({job.targets, job.held_out, job.key.level, job.edge, job.populated});
  }
  std::vector<CubeFit> fits = fitter.fit(samples);
  std::vector<CubeRecord> records;
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    records.push_back(record_of(jobs[i], std::move(fits[i]), inputs[i], config));
  }
  return records;
}

}  // namespace gdfmap
