#pragma once

#include <cstddef>
#include <exception>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include <gdfmap/io/point_reader.hpp>

#include "bounded_queue.hpp"

namespace gdfmap {

/// Reads and decodes a cloud on a thread of its own, a few batches ahead. Nothing else may use the
/// reader until next() has come to the end.
class ReadAhead {
 public:
  explicit ReadAhead(PointReader& reader);
  ~ReadAhead();
  ReadAhead(const ReadAhead&) = delete;
  ReadAhead& operator=(const ReadAhead&) = delete;

  /// The next points, valid until the next call; none at the end. @throws what the reader threw,
  /// after the points that came before.
  [[nodiscard]] std::span<const Vector3> next();
  /// PointReader::fraction_read() up to what next() gave last.
  [[nodiscard]] std::optional<double> fraction_read() const { return current_.fraction_read; }

  static constexpr std::size_t kPointsPerBatch = std::size_t{1} << 14;

 private:
  struct Batch {
    std::vector<Vector3> points;
    std::optional<double> fraction_read;
  };

  void read();
  void read_all();

  PointReader* reader_;
  BoundedQueue<Batch> free_, filled_;
  Batch current_;
  std::exception_ptr error_;  // of the thread; read after it has ended
  std::thread thread_;
};

}  // namespace gdfmap
