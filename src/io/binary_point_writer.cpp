#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/bytes.hpp>

#include "formats.hpp"
#include "header_count.hpp"

namespace gdfmap::io {
namespace {

template <typename T>
std::byte* encode(std::span<const Vector3> points, std::byte* to) {
  for (const Vector3& p : points) {
    for (int axis = 0; axis < 3; ++axis, to += sizeof(T)) store(to, static_cast<T>(p[axis]));
  }
  return to;
}

/// Text header, then packed x, y, z: binary PLY and PCD.
class BinaryPointWriter final : public PointWriter {
 public:
  BinaryPointWriter(const std::filesystem::path& path, std::string_view header,
                    bool double_precision)
      : file_(path),
        count_offsets_(find_placeholders(header)),
        double_precision_(double_precision),
        buffer_(kWriterBlockPoints * 3 * sizeof(double)) {
    file_.write(header);
  }

  void write(std::span<const Vector3> points) override {
    count_ += points.size();
    while (!points.empty()) {
      const auto block = points.first(std::min(points.size(), kWriterBlockPoints));
      const std::byte* const end = double_precision_ ? encode<double>(block, buffer_.data())
                                                     : encode<float>(block, buffer_.data());
      file_.write(std::span<const std::byte>(buffer_.data(), end));
      points = points.subspan(block.size());
    }
  }

  void finish() override {
    for (const std::uint64_t offset : count_offsets_) write_count(file_, offset, count_);
    file_.commit();
  }

 private:
  AtomicFile file_;
  std::vector<std::uint64_t> count_offsets_;
  bool double_precision_;
  Bytes buffer_;
  std::uint64_t count_ = 0;
};

}  // namespace

std::unique_ptr<PointWriter> create_ply(const std::filesystem::path& path,
                                        const WriterOptions& options) {
  const std::string type = options.double_precision ? "double" : "float";
  const std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex " +
                             std::string(kCountPlaceholder) + "\nproperty " + type +
                             " x\nproperty " + type + " y\nproperty " + type + " z\nend_header\n";
  return std::make_unique<BinaryPointWriter>(path, header, options.double_precision);
}

std::unique_ptr<PointWriter> create_pcd(const std::filesystem::path& path,
                                        const WriterOptions& options) {
  const std::string size = options.double_precision ? "8 8 8" : "4 4 4";
  const std::string count(kCountPlaceholder);
  const std::string header =
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE " + size +
      "\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " + count + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
      count + "\nDATA binary\n";
  return std::make_unique<BinaryPointWriter>(path, header, options.double_precision);
}

}  // namespace gdfmap::io
