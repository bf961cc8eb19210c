#pragma once

#include <string>

#include <gtest/gtest.h>

#include "e2e/program.hpp"

namespace gdfmap::test {

/// Whether the program ended with this exit code; the failure shows what it said.
inline ::testing::AssertionResult exits_with(int exit_code, const Result& result) {
  if (result.exit_code == exit_code) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "exit code " << result.exit_code << ", signal "
                                       << result.signal << ", not " << exit_code << "; it said:\n"
                                       << result.out << result.err;
}

/// Whether it refused with this exit code and one line on standard error that begins with the name
/// of the subcommand and contains `fragment`.
inline ::testing::AssertionResult refuses(int exit_code, const std::string& subcommand,
                                          const std::string& fragment, const Result& result) {
  if (const auto ended = exits_with(exit_code, result); !ended) return ended;
  const bool one_line = !result.err.empty() && result.err.find('\n') == result.err.size() - 1;
  const std::string start = "gdfmap " + subcommand + ": error: ";
  if (one_line && result.err.starts_with(start) && result.err.find(fragment) != std::string::npos) {
    return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure()
         << "expected one line '" << start << "... " << fragment << " ...', not:\n"
         << result.err;
}

}  // namespace gdfmap::test
