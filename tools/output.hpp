#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace gdfmap::cli {

/// Thrown when nobody reads standard output any more: the program then ends quietly.
struct ClosedPipe {};

/// Writes to standard output, unbuffered. @throws ClosedPipe, Error kIo
void write_output(std::string_view text);

/// The text of a JSON value as every `--json` prints it: indented, not-a-number as null, bytes that
/// are not UTF-8 replaced.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& json);

/// Writes to standard error; what cannot be written is dropped, as there is nowhere to say so.
void write_message(std::string_view text) noexcept;

}  // namespace gdfmap::cli
