#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <vector>

#include <gdfmap/pipeline/evaluate.hpp>

namespace gdfmap {

/// Collects the errors of judged samples in bins and draws them: how much of the space has which
/// error, level by level, and the error against the distance. A fixed amount of memory; not
/// thread-safe.
class ErrorPlot {
 public:
  /// Answers that state no distance are passed over.
  void add(std::span<const JudgedSample> samples);
  /// Writes a PNG file, which appears complete or not at all. The bytes depend on the samples and
  /// on the installed version of cairo and its fonts alone.
  /// @throws Error kUsage when no sample states a distance; kIo.
  void write(const std::filesystem::path& png) const;

  /// Errors of some samples, weighted by the space that they stand for: equal bins of their
  /// logarithm.
  class Histogram {
   public:
    void add(double error, double weight);
    [[nodiscard]] double total() const { return total_; }
    [[nodiscard]] std::uint64_t num_samples() const { return num_samples_; }
    [[nodiscard]] double mean() const { return sum_ / total_; }
    /// The error below which this share of the space lies, to the width of a bin.
    [[nodiscard]] double percentile(double share) const;
    /// Weight of each bin.
    [[nodiscard]] const std::vector<double>& weights() const { return weights_; }
    /// Metres, lower end of a bin.
    [[nodiscard]] static double bin_begin(std::size_t bin);

   private:
    std::vector<double> weights_ = std::vector<double>(kNumBins);
    double total_ = 0.0, sum_ = 0.0;
    std::uint64_t num_samples_ = 0;

    static constexpr std::size_t kNumBins = 140;  ///< 20 a decade, from 10⁻⁶ to 10 m
  };

 private:
  std::map<int, Histogram> by_level_;
  std::map<int, Histogram> by_distance_;  ///< keyed by floor(6 · log10(metres))
};

}  // namespace gdfmap
