#include "new_map_guard.hpp"

#include <exception>
#include <filesystem>

namespace gdfmap::cli {

NewMapGuard::~NewMapGuard() {
  if (!armed_) return;
  try {
    if (map_.points().sources().empty()) std::filesystem::remove_all(map_.path());
  } catch (const std::exception&) {
    // An empty map that stays is no harm, and the first error is the one to tell.
  }
}

}  // namespace gdfmap::cli
