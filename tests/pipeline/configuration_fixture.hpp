#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>

#include <gdfmap/core/error.hpp>

#include "support/temporary_directory.hpp"

namespace gdfmap::test {

/// Reads texts as configuration files with kLoad.
template <auto kLoad>
class ConfigurationFixture : public testing::Test {
 protected:
  auto load(const std::string& yaml) {
    const std::filesystem::path path = directory_ / "config.yaml";
    std::ofstream(path) << yaml;
    return kLoad(path);
  }
  std::string message_of(const std::string& yaml) {
    try {
      load(yaml);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kUsage);
      return error.what();
    }
    ADD_FAILURE() << "accepted: " << yaml;
    return {};
  }
  TemporaryDirectory directory_;
};

}  // namespace gdfmap::test
