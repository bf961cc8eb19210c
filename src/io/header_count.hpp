#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include <gdfmap/core/atomic_file.hpp>

namespace gdfmap::io {

/// Stands in a text header for a count that is known when all else is written. Leading zeros,
/// unlike spaces, are understood by every reader.
inline constexpr std::string_view kCountPlaceholder = "00000000000000000000";

/// Where placeholders stand in a header, in order.
[[nodiscard]] std::vector<std::uint64_t> find_placeholders(std::string_view header);

/// Puts the count in the place of a placeholder.
void write_count(AtomicFile& file, std::uint64_t offset, std::uint64_t count);

}  // namespace gdfmap::io
