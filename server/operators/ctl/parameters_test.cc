#include "server/operators/ctl/parameters.h"

#include <gtest/gtest.h>

#include <fstream>
#include <regex>
#include <string>

namespace pheromone::ctl {
namespace {

TEST(ParametersTest, ValuesAreToldWithTheirUnitsAndWords) {
  EXPECT_EQ(DescribeParameter(7, 200), "speed_mm_s: 200 mm/s");
  EXPECT_EQ(DescribeParameter(136, 125), "battery: 12.5 V");
  EXPECT_EQ(DescribeParameter(15, 9), "low_battery_100mv: 0.9 V");
  EXPECT_EQ(DescribeParameter(2, 3), "law: 3 (careful)");
  EXPECT_EQ(DescribeParameter(2, 4), "law: 4");
  EXPECT_EQ(DescribeParameter(133, 0), "why it stands: 0");
  EXPECT_EQ(DescribeParameter(133, 6), "why it stands: 6 (fail-safe, halted)");
  EXPECT_EQ(DescribeParameter(128, 9), "last reset: 9 (power-on, watchdog)");
  EXPECT_EQ(DescribeParameter(138, 32'767), "requests sent: 32767");
  EXPECT_EQ(DescribeParameter(200, -7), "parameter 200: -7");
}

// The firmware's manual has a table of them: | 7 | `speed_mm_s` | 200 | ... |
TEST(ParametersTest, SettingsHaveTheNamesOfTheFirmwaresManual) {
  std::ifstream manual(CLIENT_README);
  const std::regex row(R"(\| (\d+) \| `(\w+)` \|.*)");
  std::smatch found;
  int settings = 0;
  for (std::string line; std::getline(manual, line);) {
    if (std::regex_match(line, found, row)) {
      ++settings;
      const std::string text = DescribeParameter(std::stoi(found[1]), 0);
      EXPECT_EQ(text.substr(0, text.find(':')), found[2].str());
    }
  }
  EXPECT_EQ(settings, 17);
}

// | 134 | alarms, sum of 1 stall, 2 bumper, ... |
TEST(ParametersTest, SetsHaveTheWordsOfTheFirmwaresManual) {
  std::ifstream manual(CLIENT_README);
  const std::regex row(R"(\| (\d+) \| [^|]*sum of (.*) \|)");
  const std::regex word(R"((\d+) ([^,]+))");
  std::smatch found;
  int words = 0;
  for (std::string line; std::getline(manual, line);) {
    if (!std::regex_match(line, found, row)) {
      continue;
    }
    const int number = std::stoi(found[1]);
    const std::string list = found[2];
    for (std::sregex_iterator it(list.begin(), list.end(), word), end; it != end; ++it, ++words) {
      const std::string text = DescribeParameter(number, std::stoi((*it)[1]));
      EXPECT_TRUE(text.ends_with(": " + (*it)[1].str() + " (" + (*it)[2].str() + ")")) << text;
    }
  }
  EXPECT_EQ(words, 4 + 8 + 5);
}

}  // namespace
}  // namespace pheromone::ctl
