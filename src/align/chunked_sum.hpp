#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include <gdfmap/core/parallel.hpp>

namespace gdfmap {

inline constexpr std::size_t kPointsPerChunk = 1024;

[[nodiscard]] inline std::size_t num_chunks(std::size_t count) {
  return (count + kPointsPerChunk - 1) / kPointsPerChunk;
}

/// Calls part(begin, end) for chunks of [0, count), side by side.
template <typename Part>
void for_each_chunk(std::size_t count, int num_threads, const Part& part) {
  parallel_for(num_chunks(count), num_threads, [&](std::size_t chunk) {
    const std::size_t begin = chunk * kPointsPerChunk;
    part(begin, std::min(count, begin + kPointsPerChunk));
  });
}

/// The sum of part(begin, end) over chunks of [0, count): made side by side, added in order, so
/// that it is the same for any number of threads. T is made by T{} and added by +=.
template <typename T, typename Part>
[[nodiscard]] T chunked_sum(std::size_t count, int num_threads, const Part& part) {
  std::vector<T> parts(num_chunks(count));
  for_each_chunk(count, num_threads, [&](std::size_t begin, std::size_t end) {
    parts[begin / kPointsPerChunk] = part(begin, end);
  });
  T sum{};
  for (const T& p : parts) sum += p;
  return sum;
}

}  // namespace gdfmap
