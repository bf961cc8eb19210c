#include "read_ahead.hpp"

#include <utility>

namespace gdfmap {
namespace {

constexpr std::size_t kNumBatches = 6;

}  // namespace

ReadAhead::ReadAhead(PointReader& reader)
    : reader_(&reader), free_(kNumBatches), filled_(kNumBatches) {
  for (std::size_t i = 1; i < kNumBatches; ++i) free_.push(Batch());
  thread_ = std::thread(&ReadAhead::read, this);
}

ReadAhead::~ReadAhead() {
  free_.abandon();
  filled_.abandon();
  if (thread_.joinable()) thread_.join();
}

std::span<const Vector3> ReadAhead::next() {
  free_.push(std::move(current_));
  auto batch = filled_.pop();
  if (batch) {
    current_ = std::move(*batch);
    return current_.points;
  }
  if (thread_.joinable()) thread_.join();
  if (error_) std::rethrow_exception(error_);
  return {};
}

void ReadAhead::read() {
  try {
    read_all();
  } catch (...) {
    error_ = std::current_exception();
  }
  filled_.close();
}

void ReadAhead::read_all() {
  while (auto batch = free_.pop()) {
    batch->points.resize(kPointsPerBatch);
    batch->points.resize(reader_->read(batch->points));
    batch->fraction_read = reader_->fraction_read();
    if (batch->points.empty() || !filled_.push(std::move(*batch))) return;
  }
}

}  // namespace gdfmap
