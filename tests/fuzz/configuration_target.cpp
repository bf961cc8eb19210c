#include <gdfmap/pipeline/configuration.hpp>

#include "harness.hpp"

namespace gdfmap::fuzz {

bool fuzz_yaml(Input bytes) {
  static MemoryFile file(".yaml");
  const std::filesystem::path& path = file.hold(bytes);
  return accepts({ErrorCode::kUsage}, [&] {
    const FitConfig config = load_configuration(path).fit_config(1.0);
    require(FitConfig::from_canonical(config.canonical()) == config,
            "a configuration that is accepted can be stored");
  });
}

}  // namespace gdfmap::fuzz
