#include "input_file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <gdfmap/core/error.hpp>

namespace gdfmap::io {
namespace {

/// Large enough for few system calls, small enough that hashing and decoding find it in the cache.
constexpr std::size_t kBufferBytes = std::size_t{1} << 20;
static_assert(InputFile::kMaxPeekBytes <= kBufferBytes);
constexpr std::uint64_t kLeastBufferBytes = 4096;

/// Room for a small file and for the read that finds its end.
std::size_t first_capacity(std::optional<std::uint64_t> size) {
  if (!size || *size >= kBufferBytes) return kBufferBytes;
  return static_cast<std::size_t>(std::max(*size + 1, kLeastBufferBytes));
}

}  // namespace

InputFile::InputFile(const std::filesystem::path& path)
    : name_(path == "-" ? "standard input" : path.string()), owned_(path != "-") {
  descriptor_ = owned_ ? ::open(path.c_str(), O_RDONLY | O_CLOEXEC) : STDIN_FILENO;
  if (descriptor_ < 0) fail_reading();
  struct stat status = {};
  const bool known = ::fstat(descriptor_, &status) == 0;
  const bool directory = known && S_ISDIR(status.st_mode);
  if (!known || directory) {
    const int error = directory ? EISDIR : errno;
    if (owned_) ::close(descriptor_);
    errno = error;
    fail_reading();
  }
  // Standard input stays a stream even where it is redirected from a file: its offset is not ours.
  if (owned_ && S_ISREG(status.st_mode)) size_ = static_cast<std::uint64_t>(status.st_size);
  capacity_ = first_capacity(size_);
  buffer_ = std::make_unique_for_overwrite<std::byte[]>(capacity_);
}

InputFile::~InputFile() {
  if (owned_) ::close(descriptor_);
}

std::optional<std::uint64_t> InputFile::bytes_left() const {
  if (!size_) return std::nullopt;
  return *size_ - std::min(*size_, position());
}

void InputFile::fill(std::size_t min_bytes) {
  std::memmove(buffer_.get(), buffer_.get() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  while (end_ < min_bytes) {
    if (end_ == capacity_) grow();
    const ssize_t count = ::read(descriptor_, buffer_.get() + end_, capacity_ - end_);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_reading();
    if (count == 0) return;
    const auto received = static_cast<std::size_t>(count);
    hasher_.update({buffer_.get() + end_, received});
    end_ += received;
    num_read_ += received;
  }
}

/// For a file that holds more than its size said, as those that the kernel makes up do.
void InputFile::grow() {
  auto larger = std::make_unique_for_overwrite<std::byte[]>(kBufferBytes);
  std::memcpy(larger.get(), buffer_.get(), end_);
  buffer_ = std::move(larger);
  capacity_ = kBufferBytes;
}

bool InputFile::skip(std::uint64_t count) {
  while (count > 0) {
    const std::size_t available = peek(1).size();
    if (available == 0) return false;
    const auto step = static_cast<std::size_t>(std::min<std::uint64_t>(count, available));
    consume(step);
    count -= step;
  }
  return true;
}

std::size_t InputFile::read_at(std::uint64_t offset, std::span<std::byte> to) const {
  std::size_t done = 0;
  while (done < to.size()) {
    const ssize_t count =
        ::pread(descriptor_, to.data() + done, to.size() - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_reading();
    if (count == 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

Digest InputFile::finish() {
  while (const std::size_t available = peek(1).size()) consume(available);
  return hasher_.digest();
}

void InputFile::fail(const std::string& what) const {
  throw Error(ErrorCode::kCorrupt, name_ + ": " + what);
}

void InputFile::fail_reading() const {
  throw Error(ErrorCode::kIo,
              "cannot read " + name_ + ": " + std::generic_category().message(errno));
}

void require_bytes(const InputFile& file, std::uint64_t count, std::uint64_t bytes_each,
                   const std::string& records) {
  const auto left = file.bytes_left();
  if (!left || bytes_each == 0 || count <= *left / bytes_each) return;
  file.fail("the header declares " + std::to_string(count) + " " + records + " of at least " +
            std::to_string(bytes_each) + " bytes, but only " + std::to_string(*left) +
            " bytes follow");
}

}  // namespace gdfmap::io
