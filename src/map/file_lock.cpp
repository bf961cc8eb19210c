#include "file_lock.hpp"

#include <array>
#include <cerrno>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <gdfmap/core/error.hpp>

namespace gdfmap {
namespace {

std::string system_message() { return std::generic_category().message(errno); }

/// What the holder wrote: "process 17 on host".
std::string read_holder(int descriptor) {
  std::array<char, 256> text;
  const ssize_t length = ::pread(descriptor, text.data(), text.size(), 0);
  return length > 0 ? std::string(text.data(), static_cast<std::size_t>(length))
                    : std::string("another process");
}

std::string this_process() {
  std::array<char, 200> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  return "process " + std::to_string(::getpid()) + " on " + host.data();
}

}  // namespace

FileLock::FileLock(const std::filesystem::path& path)
    : descriptor_(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  if (descriptor_ < 0) {
    throw Error(ErrorCode::kIo, "cannot write to " + path.string() + ": " + system_message());
  }
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const std::string reason = errno == EWOULDBLOCK
                                   ? "busy: " + read_holder(descriptor_) + " is writing to it"
                                   : system_message();
    ::close(descriptor_);
    throw Error(ErrorCode::kIo, path.parent_path().string() + ": " + reason);
  }
  // For people only, and therefore as well as it goes: the lock itself is the kernel's.
  const std::string holder = this_process();
  if (::ftruncate(descriptor_, 0) == 0) {
    [[maybe_unused]] const ssize_t ignored = ::pwrite(descriptor_, holder.data(), holder.size(), 0);
  }
}

FileLock::~FileLock() { ::close(descriptor_); }

}  // namespace gdfmap
