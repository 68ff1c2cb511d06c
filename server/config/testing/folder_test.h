// A folder for one test, with the files that a configuration names.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "server/base/testing/temporary_folder.h"
#include "server/config/config.h"

namespace pheromone::config {

class FolderTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, std::string_view bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }

  /// A map of 10 m x 8 m; type 1 "trail" is the paper's counter, type 2 "path"
  /// permanent; quantum 0.25, maximum 1. `more` begins on line 29.
  Result<Config> Parse(std::string_view more, std::string_view map_keys = "",
                       std::string_view cell_m = "0.1") const {
    const std::string text =
        "[map]\nwidth_m = 10\nheight_m = 8\ncell_m = " + std::string(cell_m) + "\n" +
        std::string(map_keys) +
        "\n[antennas]\nbias_m = 0.33\n"
        "[[pheromone]]\ntype = 1\nname = \"trail\"\nprofile = \"cone\"\nradius_m = 0.2\n"
        "tau_s = 30\nquantum = 0.25\nmaximum = 1\n"
        "[[pheromone]]\ntype = 2\nname = \"path\"\nprofile = \"cone\"\nradius_m = 0.2\n"
        "tau_s = 0\nquantum = 0.25\nmaximum = 1\n"
        "[[link]]\nname = \"a\"\nkind = \"pty\"\npath = \"a\"\n\n" +
        std::string(more);
    return ParseConfig(text, "f.toml", folder_);
  }

  field::FieldConfig Field(std::string_view more, std::string_view map_keys = "") const {
    const Result<Config> parsed = Parse(more, map_keys);
    EXPECT_TRUE(parsed.ok()) << parsed.error();
    return parsed.ok() ? parsed.value().engine.field : field::FieldConfig{};
  }

  /// The message for a mistake, its folder left out.
  std::string ErrorOf(std::string_view more, std::string_view map_keys = "",
                      std::string_view cell_m = "0.1") const {
    const Result<Config> parsed = Parse(more, map_keys, cell_m);
    std::string error = parsed.ErrorOr("");
    const std::string folder = folder_.string() + "/";
    for (size_t at = error.find(folder); at != std::string::npos; at = error.find(folder)) {
      error.erase(at, folder.size());
    }
    return error;
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
};

}  // namespace pheromone::config
