#pragma once

namespace gdfmap {

/// Called at the named places around every commit, so that tests can end the process there.
using FailpointHandler = void (*)(const char* name);

/// Installs a handler for the whole process; null (the default) removes it. Thread-safe.
void set_failpoint_handler(FailpointHandler handler);

/// A place where a crash must lose nothing. Costs one atomic load when no handler is installed.
void failpoint(const char* name);

}  // namespace gdfmap
