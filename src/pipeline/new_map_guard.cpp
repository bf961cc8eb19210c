#include <exception>
#include <filesystem>

#include <gdfmap/pipeline/new_map_guard.hpp>

namespace gdfmap {

NewMapGuard::~NewMapGuard() {
  if (!armed_) return;
  try {
    if (map_.points().sources().empty()) std::filesystem::remove_all(map_.path());
  } catch (const std::exception&) {
    // An empty map that stays is no harm, and the first error is the one to tell.
  }
}

}  // namespace gdfmap
