#pragma once

#include <cstddef>
#include <functional>

namespace gdfmap {

/// Calls body(i) once for every i in [0, count), on up to num_threads OpenMP threads, in no order.
/// The first exception thrown by a body ends the loop early and is thrown to the caller.
void parallel_for(std::size_t count, int num_threads, const std::function<void(std::size_t)>& body);

}  // namespace gdfmap
