#pragma once

#include <memory>

namespace CLI {
class FormatterBase;
}

namespace gdfmap::cli {

/// Help that fits a terminal of 80 columns: wrapped text, one line for each subcommand.
[[nodiscard]] std::shared_ptr<CLI::FormatterBase> make_help_formatter();

}  // namespace gdfmap::cli
