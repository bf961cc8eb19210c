#include <charconv>
#include <string>
#include <string_view>

#include <gdfmap/core/atomic_file.hpp>

#include "formats.hpp"

namespace gdfmap::io {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{64} << 10;

/// A point a line, in the fewest digits that give the same doubles when read.
class XyzWriter final : public PointWriter {
 public:
  XyzWriter(const std::filesystem::path& path, char separator)
      : file_(path), separator_(separator) {
    if (separator == ',') file_.write(std::string_view("x,y,z\n"));
  }

  void write(std::span<const Vector3> points) override {
    for (const Vector3& p : points) {
      append(p.x(), separator_);
      append(p.y(), separator_);
      append(p.z(), '\n');
      if (buffer_.size() >= kBufferBytes) flush();
    }
  }

  void finish() override {
    flush();
    file_.commit();
  }

 private:
  void append(double value, char end) {
    char digits[32];  // the longest shortest double has 24 characters
    const auto result = std::to_chars(digits, digits + sizeof(digits), value);
    buffer_.append(digits, result.ptr);
    buffer_ += end;
  }

  void flush() {
    file_.write(std::string_view(buffer_));
    buffer_.clear();
  }

  AtomicFile file_;
  char separator_;
  std::string buffer_;
};

}  // namespace

std::unique_ptr<PointWriter> create_xyz(const std::filesystem::path& path, char separator) {
  return std::make_unique<XyzWriter>(path, separator);
}

}  // namespace gdfmap::io
