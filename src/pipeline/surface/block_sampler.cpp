#include "block_sampler.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <gdfmap/core/flush_to_zero.hpp>

namespace gdfmap::surface {

std::size_t BlockSampler::sample(const SampleBox& box) {
  const FlushToZero flush;
  prepare(box);
  const Neighbourhood cubes(field_.tiles, {0, axes_[0].low, axes_[1].low, axes_[2].low},
                            {0, axes_[0].high, axes_[1].high, axes_[2].high});
  const std::vector<SampleBox> parts = domain_parts(cubes);
  std::size_t num_samples = 0;
  for (const SampleBox& part : parts) num_samples += part.count();
  if (num_samples == 0) return 0;
  values_.resize(plane() * box_.size(2));
  std::fill_n(values_.data(), plane() * box_.size(2), 0.0f);
  is_complete_ = true;
  if (wanted_ == Wanted::kValuesAndErrors) errors_.assign(plane() * box_.size(2), 0.0f);
  cubes.for_each(
      [this](const CubeKey& key, const Neighbourhood::Cube* cube) { add_cube(key, cube); });
  normalise();
  keep(parts);
  return num_samples;
}

void BlockSampler::prepare(const SampleBox& box) {
  box_ = box;
  row_stride_ = padded(box.size(0));
  poor_cubes_.clear();
  const SampleGrid& grid = field_.domain.grid();
  for (std::size_t a = 0; a < 3; ++a) {
    Axis& axis = axes_[a];
    axis.cubes.clear();
    axis.blends.clear();
    axis.first_cubes.clear();
    axis.low = std::numeric_limits<std::int64_t>::max();
    axis.high = std::numeric_limits<std::int64_t>::min();
    for (std::int64_t i = box.begin[a]; i < box.end[a]; ++i) {
      // The next sample is mostly in the same cube.
      const bool is_next = !axis.cubes.empty() && i < grid.first_in_cube(axis.cubes.back() + 1);
      const std::int64_t cube = is_next ? axis.cubes.back() : grid.cube_of(i);
      axis.cubes.push_back(cube);
      const double p = grid.position(i);
      const std::int64_t half_cube = field_.zones.half_cube(p);
      const std::int64_t first = BlendZone::first_cube(half_cube);
      axis.first_cubes.push_back(first);
      const AxisBlend<double>& blend = axis.blends.emplace_back(field_.zones.blend(half_cube, p));
      axis.low = std::min(axis.low, first);
      axis.high = std::max(axis.high, first + static_cast<std::int64_t>(blend.count) - 1);
    }
  }
}

/// The samples of the block that are in the domain, cube by cube.
std::vector<SampleBox> BlockSampler::domain_parts(const Neighbourhood& cubes) {
  std::vector<SampleBox> parts;
  CubeKey key;
  for (key.x = axes_[0].cubes.front(); key.x <= axes_[0].cubes.back(); ++key.x) {
    for (key.y = axes_[1].cubes.front(); key.y <= axes_[1].cubes.back(); ++key.y) {
      for (key.z = axes_[2].cubes.front(); key.z <= axes_[2].cubes.back(); ++key.z) {
        const Neighbourhood::Cube* const cube = cubes.find(key);
        if (cube == nullptr) continue;
        const SampleBox part = field_.domain.samples_in(key).intersection(box_);
        if (part.count() == 0) continue;
        if (cube->mae > field_.max_mae) {
          poor_cubes_.push_back(key);
        } else {
          parts.push_back(part);
        }
      }
    }
  }
  return parts;
}

void BlockSampler::add_cube(const CubeKey& key, const Neighbourhood::Cube* cube) {
  if (!find_shares(key)) return;
  if (cube == nullptr) {
    if (std::exchange(is_complete_, false)) missing_.assign(plane() * box_.size(2), 0.0f);
    add_shares(1.0f, missing_);
    return;
  }
  add_gaussians(rows_.fill(cube->kernel));
  if (wanted_ == Wanted::kValuesAndErrors && std::isfinite(cube->mae)) {
    add_shares(static_cast<float>(cube->mae), errors_);
  }
}

/// False where the cube shares no sample.
bool BlockSampler::find_shares(const CubeKey& key) {
  const std::array<std::int64_t, 3> cube = {key.x, key.y, key.z};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::vector<AxisBlend<double>>& blends = axes_[a].blends;
    Share& own = shares_[a];
    own.position.resize(blends.size());
    own.share.resize(blends.size());
    std::fill_n(own.position.data(), padded(blends.size()), 0.0f);
    std::fill_n(own.share.data(), padded(blends.size()), 0.0f);
    own.begin = blends.size();
    own.end = 0;
    for (std::size_t i = 0; i < blends.size(); ++i) {
      for (std::size_t j = 0; j < blends[i].count; ++j) {
        const std::int64_t shared = axes_[a].first_cubes[i] + static_cast<std::int64_t>(j);
        if (shared != cube[a] || blends[i].weight[j] == 0.0) continue;
        own.position.data()[i] = static_cast<float>(blends[i].p_local[j]);
        own.share.data()[i] = static_cast<float>(blends[i].weight[j]);
        own.begin = std::min(own.begin, i);
        own.end = i + 1;
      }
    }
    if (own.begin >= own.end) return false;
  }
  return true;
}

void BlockSampler::add_gaussians(const GaussianRows& rows) {
  const auto& [x, y, z] = shares_;
  const std::size_t x_stride = padded(box_.size(0));
  factors_[0].resize(rows.count * x_stride);
  for (std::size_t k = 0; k < rows.count; ++k) {
    field_.kernels.factors_of_gaussian(x.position.data(), x.share.data(), x_stride, rows.mean[0][k],
                                       rows.inverse[0][k], factors_[0].data() + k * x_stride);
  }
  for (std::size_t a = 1; a < 3; ++a) {
    const Share& own = shares_[a];
    factors_[a].resize(rows.stride * box_.size(a));
    for (std::size_t i = own.begin; i < own.end; ++i) {
      field_.kernels.factors_of_sample(own.position.data()[i], own.share.data()[i], rows.mean[a],
                                       rows.inverse[a], a == 2 ? rows.weight : nullptr, rows.stride,
                                       factors_[a].data() + i * rows.stride);
    }
  }
  products_.resize(rows.stride);
  field_.kernels.add_block({rows.count, factors_[0].data(), x_stride, factors_[1].data(),
                            factors_[2].data(), rows.stride, x.begin / kLaneFloats * kLaneFloats,
                            padded(x.end), y.begin, y.end, z.begin, z.end, products_.data(),
                            values_.data(), row_stride_, plane()});
}

void BlockSampler::add_shares(float factor, std::vector<float>& sums) const {
  const auto& [x, y, z] = shares_;
  for (std::size_t k = z.begin; k < z.end; ++k) {
    for (std::size_t j = y.begin; j < y.end; ++j) {
      const float share = factor * z.share.data()[k] * y.share.data()[j];
      float* const row = sums.data() + k * plane() + j * row_stride_;
      for (std::size_t i = x.begin; i < x.end; ++i) row[i] += share * x.share.data()[i];
    }
  }
}

void BlockSampler::normalise() {
  if (is_complete_) return;
  for (std::size_t i = 0; i < missing_.size(); ++i) {
    if (!(missing_[i] > 0.0f)) continue;
    values_.data()[i] /= 1.0f - missing_[i];
    if (wanted_ == Wanted::kValuesAndErrors) errors_[i] /= 1.0f - missing_[i];
  }
}

/// Marks everything outside the domain.
void BlockSampler::keep(const std::vector<SampleBox>& parts) {
  if (parts.size() == 1 && parts.front().count() == box_.count()) return;
  AlignedFloats kept;
  kept.resize(plane() * box_.size(2));
  std::fill_n(kept.data(), plane() * box_.size(2), kOutside);
  for (const SampleBox& part : parts) {
    const auto within = [&](std::int64_t index, std::size_t axis) {
      return static_cast<std::size_t>(index - box_.begin[axis]);
    };
    for (std::size_t z = within(part.begin[2], 2); z < within(part.end[2], 2); ++z) {
      for (std::size_t y = within(part.begin[1], 1); y < within(part.end[1], 1); ++y) {
        const std::size_t at = z * plane() + y * row_stride_ + within(part.begin[0], 0);
        std::copy_n(values_.data() + at, part.size(0), kept.data() + at);
      }
    }
  }
  values_ = std::move(kept);
}

}  // namespace gdfmap::surface
