#include "cube_job.hpp"

#include <algorithm>

#include <Eigen/Core>

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

std::uint64_t input_digest(const CubeJob& job, const Digest& configuration) {
  ByteWriter writer;
  writer.put(configuration);
  writer.put(job.key.level);
  writer.put(job.edge);
  writer.put(static_cast<std::uint8_t>(job.populated));
  writer.put(std::span(job.targets));
  writer.put(std::span(job.held_out));
  return hash64(writer.bytes()) & kMaxInputDigest;
}

namespace {

/// As the codec keeps it; the fit has rounded the Gaussians.
CubeRecord kept(CubeRecord record, double edge, CubeCodec codec) {
  if (codec != CubeCodec::kQuantized) return record;
  const LengthGrid lengths(edge);
  for (float* const error : {&record.errors.mae, &record.errors.rmse, &record.errors.p95}) {
    *error = lengths.of_code(lengths.nearest(*error));
  }
  for (float* const bound : {&record.errors.max, &record.reach}) {
    *bound = lengths.of_code(lengths.not_below(*bound));
  }
  record.num_iterations = std::min(record.num_iterations, kMostQuantizedIterations);
  return record;
}

CubeRecord record_of(const CubeJob& job, CubeFit fit, std::uint64_t input,
                     const FitConfig& config) {
  CubeRecord record;
  record.index = cube_index_in_tile(job.key);
  record.cube_class = job.populated ? CubeClass::kPopulated : CubeClass::kEmpty;
  record.num_iterations = fit.num_iterations;
  record.reach = Eigen::Map<const Eigen::ArrayXf>(job.targets.data(),
                                                  static_cast<Eigen::Index>(job.targets.size()))
                     .maxCoeff();
  record.input = input;
  if (!fit.finite) {
    record.status = CubeStatus::kFailed;
    record.failure = FailureReason::kNotFinite;
    return kept(std::move(record), job.edge, config.codec);
  }
  const double threshold =
      config.mae_threshold_max * static_cast<double>(level_scale(job.key.level));
  record.status = fit.errors.mae > threshold ? CubeStatus::kPoor : CubeStatus::kFitted;
  record.errors = fit.errors;
  record.gaussians = std::move(fit.gaussians);
  return kept(std::move(record), job.edge, config.codec);
}

}  // namespace

std::vector<CubeRecord> run(std::span<const CubeJob> jobs, std::span<const std::uint64_t> inputs,
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
