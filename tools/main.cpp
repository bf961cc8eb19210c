#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

#include <exception>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>

#include <gdfmap/core/error.hpp>
#include <gdfmap/core/instruction_set.hpp>

#include "commands.hpp"
#include "help_formatter.hpp"
#include "output.hpp"
#include "signals.hpp"
#include "version.hpp"

namespace gdfmap::cli {
namespace {

std::string version_text() {
  return std::string("gdfmap ") + kVersion + "\ncommit " + kCommit + "\ninstruction set " +
         name_of(best_instruction_set()) + "\n";
}

std::vector<Command> add_commands(CLI::App& program) {
  return {add_ingest(program),   add_train(program),   add_query(program),   add_tile(program),
          add_slice(program),    add_surface(program), add_export(program),  add_import(program),
          add_evaluate(program), add_info(program),    add_sources(program), add_remove(program),
          add_verify(program),   add_compact(program), add_build(program),   add_synth(program),
          add_register(program)};
}

void describe(CLI::App& program) {
  program.formatter(make_help_formatter());
  program.set_help_flag("-h,--help", "Print this help");
  program.set_version_flag("--version", version_text(), "Print version, commit, instruction set");
  program.require_subcommand(1);
  program.footer(
      "`gdfmap SUBCOMMAND --help` explains each. A map is a directory NAME.gdfmap.\n\n"
      "Exit codes: 0 done, 1 internal error, 2 usage or configuration, 3 input/output\n"
      "or busy, 4 corrupt or incompatible, 5 interrupted (run again), 6 finished but a\n"
      "condition was not met.");
}

/// "gdfmap train", or "gdfmap" before a subcommand is known.
std::string full_name(const CLI::App& program) {
  const auto selected = program.get_subcommands();
  return selected.empty() ? "gdfmap" : "gdfmap " + selected.front()->get_name();
}

int fail(const std::string& name, ErrorCode code, const std::string& message) {
  write_message(name + ": error: " + message + "\n");
  return static_cast<int>(code);
}

bool is_subcommand(const CLI::App& program, const std::string& name) {
  return !program.get_subcommands([&](const CLI::App* app) { return app->get_name() == name; })
              .empty();
}

/// @throws CLI::ParseError for anything that the command line gets wrong.
void parse(CLI::App& program, int argc, char** argv) {
  if (argc > 1 && argv[1][0] != '-' && !is_subcommand(program, argv[1])) {
    throw CLI::ExtrasError("unknown subcommand '" + std::string(argv[1]) + "'",
                           CLI::ExitCodes::ExtrasError);
  }
  program.parse(argc, argv);
}

/// Parses and runs; returns the exit code, with every error said on standard error.
int run(CLI::App& program, int argc, char** argv) {
  const std::vector<Command> commands = add_commands(program);
  try {
    parse(program, argc, argv);
    for (const Command& command : commands) {
      if (command.app->parsed()) command.run();
    }
    return 0;
  } catch (const CLI::CallForHelp&) {
    write_output(program.help());
    return 0;
  } catch (const CLI::CallForVersion&) {
    write_output(version_text());
    return 0;
  } catch (const CLI::ParseError& error) {
    const std::string name = full_name(program);
    return fail(name, ErrorCode::kUsage,
                std::string(error.what()) + " (see `" + name + " --help`)");
  }
}

/// Gives large blocks back to the system when they are freed. By default glibc learns to keep ever
/// larger ones in the heaps of its threads, where they leave gaps: twice the memory that is in use.
void give_back_large_blocks() {
#if defined(__GLIBC__)
  constexpr int kLargeBlock = 1 << 18;
  mallopt(M_MMAP_THRESHOLD, kLargeBlock);
  mallopt(M_TRIM_THRESHOLD, 4 * kLargeBlock);
#endif
}

int run_guarded(CLI::App& program, int argc, char** argv) {
  try {
    return run(program, argc, argv);
  } catch (const ClosedPipe&) {
    return 0;
  } catch (const Error& error) {
    return fail(full_name(program), error.code(), error.what());
  } catch (const std::bad_alloc&) {
    return fail(full_name(program), ErrorCode::kIo,
                "the system refused memory; a smaller --memory may help");
  } catch (const std::system_error& error) {  // of std::filesystem, for one
    return fail(full_name(program), ErrorCode::kIo, error.what());
  } catch (const std::exception& error) {
    return fail(full_name(program), ErrorCode::kInternal, error.what());
  }
}

}  // namespace
}  // namespace gdfmap::cli

int main(int argc, char** argv) {
  gdfmap::cli::give_back_large_blocks();
  gdfmap::cli::install_signal_handlers();
  CLI::App program(
      "gdfmap: continuous distance fields from point clouds larger than memory\n\n"
      "Streams clouds into a map, fits a few Gaussians to the distance field of each cube of "
      "space, and answers distance and gradient anywhere, from disk.",
      "gdfmap");
  gdfmap::cli::describe(program);
  return gdfmap::cli::run_guarded(program, argc, argv);
}
