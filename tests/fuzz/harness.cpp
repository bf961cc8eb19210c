#include "harness.hpp"

#include <string>
#include <system_error>

#include <sys/mman.h>
#include <unistd.h>

namespace gdfmap::fuzz {

MemoryFile::MemoryFile(const char* extension) : descriptor_(::memfd_create("input", MFD_CLOEXEC)) {
  std::string name = (std::filesystem::temp_directory_path() / "gdfmap-fuzz-XXXXXX").string();
  require(descriptor_ >= 0 && ::mkdtemp(name.data()) != nullptr, "a file can be made");
  directory_ = name;
  path_ = directory_ / (std::string("input") + extension);
  std::filesystem::create_symlink("/proc/self/fd/" + std::to_string(descriptor_), path_);
}

MemoryFile::~MemoryFile() {
  ::close(descriptor_);
  std::error_code ignored;
  std::filesystem::remove_all(directory_, ignored);
}

const std::filesystem::path& MemoryFile::hold(Input bytes) {
  const bool held =
      ::ftruncate(descriptor_, 0) == 0 &&
      ::pwrite(descriptor_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
  require(held, "a file in memory can be written");
  return path_;
}

}  // namespace gdfmap::fuzz
