#pragma once

#include <functional>

namespace CLI {
class App;
}

namespace gdfmap::cli {

/// A subcommand. Its options are declared to the parser; `run` executes it once they are parsed,
/// prints its result on standard output and throws Error for every exit code but 0.
struct Command {
  CLI::App* app = nullptr;  ///< owned by the program
  std::function<void()> run;
};

Command add_ingest(CLI::App& program);
Command add_train(CLI::App& program);
Command add_query(CLI::App& program);
Command add_tile(CLI::App& program);
Command add_slice(CLI::App& program);
Command add_export(CLI::App& program);
Command add_import(CLI::App& program);
Command add_evaluate(CLI::App& program);
Command add_info(CLI::App& program);
Command add_sources(CLI::App& program);
Command add_remove(CLI::App& program);
Command add_verify(CLI::App& program);
Command add_compact(CLI::App& program);
Command add_build(CLI::App& program);
Command add_surface(CLI::App& program);
Command add_synth(CLI::App& program);
Command add_register(CLI::App& program);

}  // namespace gdfmap::cli
