#include <atomic>

#include <gdfmap/core/failpoint.hpp>

namespace gdfmap {
namespace {

std::atomic<FailpointHandler> installed_handler = nullptr;

}  // namespace

void set_failpoint_handler(FailpointHandler handler) { installed_handler.store(handler); }

void failpoint(const char* name) {
  if (const FailpointHandler handler = installed_handler.load()) handler(name);
}

}  // namespace gdfmap
