#include <cerrno>
#include <cstring>
#include <system_error>

#include <unistd.h>

#include <gdfmap/core/atomic_file.hpp>
#include <gdfmap/core/error.hpp>

namespace gdfmap {

AtomicFile::AtomicFile(std::filesystem::path path)
    : path_(std::move(path)),
      temporary_(path_.string() + ".tmp-" + std::to_string(::getpid())),
      file_(std::fopen(temporary_.c_str(), "wb")) {
  if (file_ == nullptr) fail("cannot create");
}

AtomicFile::~AtomicFile() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail("cannot write");
}

void AtomicFile::write(std::string_view text) { write(std::as_bytes(std::span(text))); }

void AtomicFile::write_at(std::uint64_t offset, std::span<const std::byte> bytes) {
  if (::fseeko(file_, static_cast<off_t>(offset), SEEK_SET) != 0) fail("cannot write");
  write(bytes);
  if (::fseeko(file_, 0, SEEK_END) != 0) fail("cannot write");
}

void AtomicFile::commit() {
  if (std::fflush(file_) != 0 || ::fsync(::fileno(file_)) != 0) fail("cannot write");
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot replace");
  std::fclose(file_);
  file_ = nullptr;
}

void AtomicFile::fail(const char* action) const {
  throw Error(ErrorCode::kIo, std::string(action) + " " + path_.string() + ": " +
                                  std::generic_category().message(errno));
}

}  // namespace gdfmap
