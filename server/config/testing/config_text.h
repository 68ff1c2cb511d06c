// A configuration without mistakes, for tests to damage line by line.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "server/config/config.h"

namespace pheromone::config {

// Tests name its lines by their numbers: keep them.
inline constexpr std::string_view kGood = R"([map]
width_m = 10.0
height_m = 8.0
cell_m = 0.1
[antennas]
bias_m = 0.33
[[pheromone]]
type = 1
name = "trail"
core_m = 0.1
sigma_m = 0.4
tau_s = 30.0
quantum = 0.125
maximum = 0.25
[[pheromone]]
type = 2
name = "path"
core_m = 0.1
sigma_m = 0.4
tau_s = 0
quantum = 0.125
maximum = 0.25
[[path]]
pheromone = "path"
points_m = [[1, 1], [2, 2], [3, 1.5]]
[[link]]
name = "radio-a"
kind = "pty"
path = "a.pty"
[[link]]
name = "radio-b"
kind = "serial"
port = "/dev/ttyS0"
[[link]]
name = "net"
kind = "tcp"
listen = "127.0.0.1:4950"
)";

struct Case {
  int line;               // to be replaced by
  std::string_view with;  // this
  std::string_view error;
};

inline std::string Replaced(int line, std::string_view with) {
  std::string text;
  size_t begin = 0;
  for (int number = 1; begin < kGood.size(); ++number) {
    const size_t end = kGood.find('\n', begin) + 1;
    text +=
        number == line ? std::string(with) + '\n' : std::string(kGood.substr(begin, end - begin));
    begin = end;
  }
  return text;
}

inline std::string ErrorOf(std::string_view text) {
  const Result<Config> parsed = ParseConfig(text, "f.toml");
  return parsed.ErrorOr("");
}

/// Mistakes and their messages; each file of tests has a suite of its own.
class ErrorsTest : public ::testing::TestWithParam<Case> {
 protected:
  void ExpectError() const {
    EXPECT_EQ(ErrorOf(Replaced(GetParam().line, GetParam().with)),
              "f.toml:" + std::string(GetParam().error));
  }
};

}  // namespace pheromone::config
