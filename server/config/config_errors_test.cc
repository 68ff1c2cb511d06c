// Each way to get a configuration wrong, with the message that it gets: line, column, key, what was
// found, what was expected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "server/config/config.h"

namespace pheromone::config {
namespace {

// Line numbers matter below: keep them.
constexpr std::string_view kGood = R"([map]
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

std::string Replaced(int line, std::string_view with) {
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

std::string ErrorOf(std::string_view text) {
  const Result<Config> parsed = ParseConfig(text, "f.toml");
  return parsed.ok() ? "" : parsed.error();
}

class ConfigErrorTest : public ::testing::TestWithParam<Case> {};

TEST(ConfigErrorsTest, TheTextToDamageIsGood) {
  EXPECT_EQ(ErrorOf(kGood), "");
}

TEST_P(ConfigErrorTest, NamesPlaceKeyAndExpectation) {
  EXPECT_EQ(ErrorOf(Replaced(GetParam().line, GetParam().with)),
            "f.toml:" + std::string(GetParam().error));
}

INSTANTIATE_TEST_SUITE_P(
    Syntax, ConfigErrorTest,
    ::testing::Values(
        Case{1, "[map", "1:5: syntax: Error while parsing table header: expected ']', saw '\\n'"},
        Case{2, "width_m = ",
             "2:11: syntax: Error while parsing key-value pair: expected value, "
             "saw '\\n'"},
        Case{3, "width_m = 1",
             "3:11: syntax: Error while parsing key-value pair: cannot redefine "
             "existing floating-point 'width_m'"},
        Case{2, "width_m = 1e999",
             "2:16: syntax: Error while parsing floating-point: '1e999' "
             "could not be interpreted as a value"}));

INSTANTIATE_TEST_SUITE_P(
    Keys, ConfigErrorTest,
    ::testing::Values(
        Case{2, "widht_m = 10.0\nwidth_m = 10.0",
             "2:1: map.widht_m: unknown key, expected width_m?"},
        Case{2, "width_m = 10.0\nwidth = 3", "3:1: map.width: unknown key, expected width_m?"},
        Case{6, "bias_m = 0.1\nxyzzyxyzzy = 1",
             "7:1: antennas.xyzzyxyzzy: unknown key, expected one of bias_m"},
        Case{19, "sigma_m = 0.4\nsigma = 1",
             "20:1: pheromone[2].sigma: unknown key, expected sigma_m?"},
        Case{5, "[antenna]\n[antennas]", "5:2: antenna: unknown key, expected antennas?"},
        Case{29, "path = \"a.pty\"\nbaud = 9600",
             "30:1: link[1].baud: unknown key, expected one of name, kind, required, path, "
             "slot_ms, response_window_ms, gap_timeout_ms"},
        Case{2, "", "1:1: map.width_m: missing, expected a number from 0.000001 to 1000000"},
        Case{6, "", "5:1: antennas.bias_m: missing, expected a number from 0 to 65"},
        Case{16, "", "15:1: pheromone[2].type: missing, expected a whole number from 1 to 15"},
        Case{24, "", "23:1: path[1].pheromone: missing, expected 1 or \"trail\", 2 or \"path\""},
        Case{25, "",
             "23:1: path[1].points_m: missing, expected at least 2 points [x, y] in metres"},
        Case{28, "", "26:1: link[1].kind: missing, expected one of \"pty\", \"serial\", \"tcp\""}));

INSTANTIATE_TEST_SUITE_P(
    Kinds, ConfigErrorTest,
    ::testing::Values(
        Case{2, "width_m = \"10\"",
             "2:11: map.width_m: found the string \"10\", expected a number "
             "from 0.000001 to 1000000"},
        Case{2, "width_m = nan",
             "2:11: map.width_m: found nan, expected a number from 0.000001 to 1000000"},
        Case{2, "width_m = -inf",
             "2:11: map.width_m: found -inf, expected a number from 0.000001 to 1000000"},
        Case{2, "width_m = 2020-01-01",
             "2:11: map.width_m: found a date or time, expected a number "
             "from 0.000001 to 1000000"},
        Case{16, "type = 2.0",
             "16:8: pheromone[2].type: found 2, expected a whole number from 1 to 15"},
        Case{17, "name = 3",
             "17:8: pheromone[2].name: found 3, expected a string that is not empty"},
        Case{17, "name = \"\"",
             "17:8: pheromone[2].name: found the string \"\", expected a string "
             "that is not empty"},
        Case{9, "name = \"t\"\ndirectional = 1",
             "10:15: pheromone[1].directional: found 1, expected true or false"},
        Case{34, "[link2]\na = 1\n[[link]]", "34:2: link2: unknown key, expected link?"},
        Case{5, "[limits]\n[daemon]\nio_threads = 0\n[antennas]",
             "7:14: daemon.io_threads: found 0, expected a whole number from 1 to 64"},
        Case{5, "[limits]\nrobots_per_link = 255\n[antennas]",
             "6:19: limits.robots_per_link: found 255, expected a whole number from 1 to 254"},
        Case{5, "[daemon]\nlog_level = \"loud\"\n[antennas]",
             "6:13: daemon.log_level: found the string \"loud\", expected one of \"trace\", "
             "\"debug\", \"info\", \"warn\", \"error\", \"critical\", \"off\""}));

INSTANTIATE_TEST_SUITE_P(
    Ranges, ConfigErrorTest,
    ::testing::Values(
        Case{4, "cell_m = 0.0000001",
             "4:10: map.cell_m: found 0.0000001, expected a number from 0.000001 to 1000000"},
        Case{4, "cell_m = 0.1000005",
             "4:10: map.cell_m: found 0.1000005, expected a multiple of 0.000001"},
        Case{4, "cell_m = 0",
             "4:10: map.cell_m: found 0, expected a number from 0.000001 to 1000000"},
        Case{4, "cell_m = 9",
             "4:10: map.cell_m: found 9, expected no more than width_m and height_m"},
        Case{4, "cell_m = 0.0003",
             "4:10: map.cell_m: found 0.0003, which makes 33333 cells along "
             "an axis, expected at most 30000"},
        Case{4, "cell_m = 0.1\npose_unit_mm = 0.015",
             "5:16: map.pose_unit_mm: found 0.015, expected a multiple of 0.01"},
        Case{2, "width_m = 32.768",
             "1:1: map.wide: the map reaches to 32.768 m, which is more than "
             "32767 pose units of 1 mm, expected wide = true, a larger "
             "pose_unit_mm or another origin"},
        Case{6, "bias_m = 0.3301",
             "6:10: antennas.bias_m: found 0.3301, expected a multiple of 0.001"},
        Case{6, "bias_m = 65.001",
             "6:10: antennas.bias_m: found 65.001, expected a number from 0 to 65"},
        Case{6, "bias_m = -0.1",
             "6:10: antennas.bias_m: found -0.1, expected a number from 0 to 65"},
        Case{11, "sigma_m = 0",
             "11:11: pheromone[1].sigma_m: found 0, expected a number from 0.000001 to 50"},
        Case{11, "sigma_m = 49.95",
             "11:11: pheromone[1].sigma_m: core_m + sigma_m is 50.05 m, "
             "expected at most 50 m"},
        Case{12, "tau_s = -1",
             "12:9: pheromone[1].tau_s: found -1, expected a number from 0 to 1000000000"},
        Case{12, "tau_s = 0.0005",
             "12:9: pheromone[1].tau_s: found 0.0005, expected a multiple of 0.001"},
        Case{13, "quantum = 0.0000001",
             "13:11: pheromone[1].quantum: found 0.0000001, expected a number from 0.000001 to "
             "1000"},
        Case{14, "maximum = 1.1",
             "14:11: pheromone[1].maximum: found 1.1, expected a multiple of "
             "the quantum 0.125, such as 1 or 1.125"},
        Case{14, "maximum = 0.1",
             "14:11: pheromone[1].maximum: found 0.1, expected a multiple of "
             "the quantum 0.125, such as 0.125"},
        Case{14, "maximum = 8192",
             "14:11: pheromone[1].maximum: found 8192, expected at most 65535 "
             "quanta of 0.125"},
        Case{16, "type = 1",
             "16:8: pheromone[2].type: found 1 again, expected a number that "
             "\"trail\" does not have"},
        Case{17, "name = \"trail\"",
             "17:8: pheromone[2].name: found \"trail\" again, expected another name"}));

INSTANTIATE_TEST_SUITE_P(
    Paths, ConfigErrorTest,
    ::testing::Values(
        Case{24, "pheromone = \"food\"",
             "24:13: path[1].pheromone: found the string \"food\", "
             "expected 1 or \"trail\", 2 or \"path\""},
        Case{24, "pheromone = 7",
             "24:13: path[1].pheromone: found 7, expected 1 or \"trail\", 2 or \"path\""},
        Case{25, "points_m = [[1, 1], [10.5, 2]]",
             "25:21: path[1].points_m[2]: found an array of 2, expected a point on the map, which "
             "reaches from (0, 0) to (10, 8)"},
        Case{25, "points_m = [[1, 1], [2]]",
             "25:21: path[1].points_m[2]: found an array of 1, "
             "expected a point [x, y] in metres"},
        Case{25, "points_m = [[1, 1]]",
             "25:12: path[1].points_m: found an array of 1, expected at "
             "least 2 points [x, y] in metres"},
        Case{25, "points_m = [[1, 1], [2, 2]]\nclosed = true",
             "25:12: path[1].points_m: found an array of 2, expected at least 3 points [x, y] in "
             "metres"},
        Case{25, "points_m = [[1, 1], [2, 2]]\nintensity = 0.2",
             "26:13: path[1].intensity: found 0.2, expected a multiple of the quantum 0.125 of "
             "\"path\""},
        Case{25, "points_m = [[1, 1], [2, 2]]\nintensity = 0.375",
             "26:13: path[1].intensity: found 0.375, expected a number from 0.125 to 0.25"},
        Case{25, "points_m = [[1, 1], [2, 2]]\nshape = \"oval\"",
             "26:9: path[1].shape: found the string \"oval\", expected one of \"polyline\", "
             "\"circle\", \"spline\""},
        Case{25, "shape = \"circle\"\ncenter_m = [2, 2]\nradius_m = 2.5",
             "27:12: path[1].radius_m: found 2.5, with which the circle leaves the map"},
        Case{25, "shape = \"circle\"\ncenter_m = [2, 2]\nradius_m = 1\nclosed = true",
             "28:1: path[1].closed: unknown key, expected one of name, pheromone, shape, center_m, "
             "radius_m, intensity"}));

INSTANTIATE_TEST_SUITE_P(
    Links, ConfigErrorTest,
    ::testing::Values(
        Case{28, "kind = \"udp\"",
             "28:8: link[1].kind: found the string \"udp\", expected one of "
             "\"pty\", \"serial\", \"tcp\""},
        Case{31, "name = \"radio-a\"",
             "31:8: link[2].name: found the string \"radio-a\" again, "
             "expected what link \"radio-a\" does not have"},
        Case{27, "name = \"a b\"",
             "27:8: link[1].name: found the string \"a b\", expected at most "
             "32 letters, digits, hyphens, underscores and dots"},
        Case{29, "path = \"/dev/ttyS0\"",
             "33:8: link[2].port: found the string \"/dev/ttyS0\" "
             "again, expected what link \"radio-a\" does not have"},
        Case{33, "port = \"/dev/ttyS0\"\nbaud = 9600.5",
             "34:8: link[2].baud: found 9600.5, expected a whole number from 50 to 4000000"},
        Case{33, "port = \"/dev/ttyS0\"\nturnaround_ms = 30\nresponse_window_ms = 32",
             "35:22: link[2].response_window_ms: found 32, expected more than turnaround_ms and "
             "the time of a byte, which the server waits before it answers"},
        Case{29,
             "path = \"./x/../b.pty\"\n[[link]]\nname = \"b\"\nkind = \"pty\"\npath = \"b.pty\"",
             "33:8: link[2].path: found the string \"b.pty\" again, expected what link \"radio-a\" "
             "does not have"},
        Case{33, "port = \"/dev/ttyS0\"\nbaud = 300\ngap_timeout_ms = 66",
             "35:18: link[2].gap_timeout_ms: found 66, expected more than the time of two bytes, "
             "which is 66.666 ms at 300 baud, or 0 for no limit"},
        Case{33, "port = \"/dev/ttyS0\"\nbaud = 75",
             "30:1: link[2].response_window_ms: missing, and 289, which follows from baud and "
             "turnaround_ms, is more than 255; expected a faster line or a whole number from 1 to "
             "255"},
        Case{37, "listen = \"localhost:4950\"",
             "37:10: link[3].listen: found the string \"localhost:4950\", expected a numeric "
             "address and a port such as \"127.0.0.1:4950\" or \"[::1]:4950\""},
        Case{37,
             "listen = \"127.0.0.1:4950\"\n[[link]]\nname = \"n\"\nkind = \"tcp\"\n"
             "listen = \"127.0.0.1:4950\"",
             "41:10: link[4].listen: found the string \"127.0.0.1:4950\" again, expected what link "
             "\"net\" does not have"}));

TEST(ConfigErrorsTest, AnAddressIsFourNumbersOrBracketedAndAPort) {
  for (const std::string_view bad :
       {"", ":1", "1.2.3:5", "1.2.3.4", "1.2.3.4:", "1.2.3.4:65536", "1.2.3.256:1", "1.2.3.4.5:1",
        "1.2.3.4:1 ", "127.0.0.01:4951", "[::::]:4950", "[:::1]:1", "[1:2:3:4:5:6:7]:1", "::1:4950",
        "[::1]", "[]:4", "[1.2.3.4]:5", "1..2.3:4", "-1.2.3.4:5"}) {
    EXPECT_NE(ErrorOf(Replaced(37, "listen = \"" + std::string(bad) + "\"")), "") << bad;
  }
  for (const std::string_view good : {"0.0.0.0:0", "[::]:65535", "[fe80::1:2]:80"}) {
    EXPECT_EQ(ErrorOf(Replaced(37, "listen = \"" + std::string(good) + "\"")), "") << good;
  }
}

TEST(ConfigErrorsTest, AllMistakesAreFoundAtOnceInTheOrderOfTheFile) {
  EXPECT_EQ(ErrorOf("[map]\nwidth_m = 0\nheight_m = 1\ncell_m = -1\nx = 1\n[antennas]\nbias_m = 1\n"
                    "[[link]]\nname = 1\nkind = \"pty\"\npath = \"p\"\n"),
            "f.toml:1:1: pheromone: missing, expected at least one table [[pheromone]]\n"
            "f.toml:2:11: map.width_m: found 0, expected a number from 0.000001 to 1000000\n"
            "f.toml:4:10: map.cell_m: found -1, expected a number from 0.000001 to 1000000\n"
            "f.toml:5:1: map.x: unknown key, expected one of width_m, height_m, cell_m, "
            "origin_x_m, origin_y_m, pose_unit_mm, wide\n"
            "f.toml:9:8: link[1].name: found 1, expected a string that is not empty");
}

TEST(ConfigErrorsTest, AnEmptyFileIsToldWhatItNeeds) {
  EXPECT_EQ(ErrorOf(""),
            "f.toml:1:1: map.width_m: missing, expected a number from 0.000001 to 1000000\n"
            "f.toml:1:1: map.height_m: missing, expected a number from 0.000001 to 1000000\n"
            "f.toml:1:1: map.cell_m: missing, expected a number from 0.000001 to 1000000\n"
            "f.toml:1:1: antennas.bias_m: missing, expected a number from 0 to 65\n"
            "f.toml:1:1: pheromone: missing, expected at least one table [[pheromone]]");
}

TEST(ConfigErrorsTest, ATableInThePlaceOfTablesAndTheReverseAreTold) {
  EXPECT_NE(ErrorOf("map = 3\n").find("f.toml:1:7: map: found 3, expected a table [map]"),
            std::string::npos);
  EXPECT_NE(ErrorOf("[link]\nname = \"a\"\n")
                .find("f.toml:1:1: link: found a table, expected tables [[link]]"),
            std::string::npos);
  EXPECT_NE(ErrorOf("pheromone = [1]\n")
                .find("f.toml:1:14: pheromone: found 1, expected tables [[pheromone]]"),
            std::string::npos);
}

TEST(ConfigErrorsTest, HugeFilesLongLinesAndDeepNestsAreRefused) {
  EXPECT_EQ(ErrorOf(std::string((1 << 20) + 1, '\n')),
            "f.toml:1:1: syntax: the file is larger than 1 MiB");
  EXPECT_EQ(ErrorOf("\n#" + std::string(20'000, 'x')),
            "f.toml:2:1: syntax: the line is longer than 16384 bytes");
  std::string keys = "a";
  for (int i = 0; i < 8'000; ++i) {
    keys += ".a";
  }
  EXPECT_EQ(ErrorOf(keys + "=1"), "f.toml:1:1: syntax: tables and arrays are nested too deeply");
  EXPECT_NE(ErrorOf("a = " + std::string(10'000, '[')), "");
}

// The spline through the corners of a rectangle bulges between them.
TEST(ConfigErrorsTest, ACurveMayNotLeaveTheMapBetweenItsPoints) {
  const std::string error = ErrorOf(Replaced(
      25, "shape = \"spline\"\nclosed = true\npoints_m = [[0, 2], [0, 6], [4, 6], [4, 2]]"));
  EXPECT_EQ(error.substr(0, error.find(" (")),
            "f.toml:27:12: path[1].points_m: the curve leaves the map at");
}

TEST(ConfigErrorsTest, PathsLongerThanAMillionCellsAreRefused) {
  std::string text = Replaced(4, "cell_m = 0.001");
  text.replace(text.find("sigma_m = 0.4"), 13, "sigma_m = 0.1");
  text.replace(text.find("sigma_m = 0.4"), 13, "sigma_m = 0.1");
  std::string points = "points_m = [";
  for (int i = 0; i < 200; ++i) {
    points += i % 2 == 0 ? "[0, 0], " : "[10, 8], ";
  }
  const size_t at = text.find("points_m");
  text.replace(at, text.find('\n', at) - at, points + "]");
  EXPECT_EQ(ErrorOf(text),
            "f.toml:25:12: path[1].points_m: the paths are more than 1000000 cells long, expected "
            "shorter paths");
}

TEST(ConfigErrorsTest, TheReachOfAPheromoneIsAtMostAThousandCells) {
  EXPECT_EQ(ErrorOf(Replaced(4, "cell_m = 0.0004")),
            "f.toml:11:11: pheromone[1].sigma_m: core_m + sigma_m is 0.5 m or 1250 cells, expected "
            "at most 1000 cells\n"
            "f.toml:19:11: pheromone[2].sigma_m: core_m + sigma_m is 0.5 m or 1250 cells, expected "
            "at most 1000 cells");
}

// 42 m / 2 + 0.5 m are 2150 cells of 0.01 m, 19 m / 2 + 0.5 m just 1000.
TEST(ConfigErrorsTest, TheAntennasAreNoFartherApartThanAnAnswerMayCost) {
  std::string text = Replaced(4, "cell_m = 0.01");
  text.replace(text.find("bias_m = 0.33"), 13, "bias_m = 42");
  EXPECT_EQ(ErrorOf(text),
            "f.toml:6:10: antennas.bias_m: half of it and the farthest core_m + sigma_m are 21.5 m "
            "or 2150 cells, expected at most 1000 cells");
  text.replace(text.find("bias_m = 42"), 11, "bias_m = 19");
  EXPECT_EQ(ErrorOf(text), "");
}

TEST(ConfigErrorsTest, ALargeMapIsFineWithWideMessagesOrAnotherUnit) {
  EXPECT_EQ(ErrorOf(Replaced(2, "width_m = 100\nwide = true")), "");
  EXPECT_EQ(ErrorOf(Replaced(2, "width_m = 65.534\norigin_x_m = -32.767")), "");
  EXPECT_EQ(ErrorOf(Replaced(2, "width_m = 100\npose_unit_mm = 5")), "");
}

// The pheromone of the text: c = 0.1 m, sigma = 0.4 m, cells of 0.1 m, directional. Naively: each
// node ahead of an antenna that stands on a node, at the maximum times mu of eq. (1).
TEST(ConfigErrorsTest, SaturationIsAWarningWithTheStrengthThatCanBeReached) {
  double sum = 0;
  for (int x = 0; x <= 5; ++x) {
    for (int y = -5; y <= 5; ++y) {
      sum += std::clamp((0.5 - std::hypot(x, y) / 10) / 0.4, 0.0, 1.0);
    }
  }
  EXPECT_LT(0.375 * sum, 7.99);
  EXPECT_TRUE(ParseConfig(Replaced(14, "maximum = 0.375"), "f").value().warnings.empty());
  EXPECT_GT(0.5 * sum, 8);
  const auto warnings = ParseConfig(Replaced(14, "maximum = 0.5"), "f").value().warnings;
  ASSERT_EQ(warnings.size(), 1u);
  std::ostringstream expected;
  expected << "f:7:1: pheromone[1]: where every node is at its maximum, an antenna smells "
           << std::floor(0.5 * sum * 10) / 10
           << " units and a message holds 7.99: both sides are then scaled down by the same factor";
  EXPECT_EQ(warnings[0], expected.str());
}

TEST(ConfigErrorsTest, AConfigurationWithoutLinksIsAWarning) {
  std::string text(kGood);
  text.resize(text.find("[[link]]"));
  const Result<Config> parsed = ParseConfig(text, "f");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  EXPECT_EQ(parsed.value().warnings,
            std::vector<std::string>{
                "f:1:1: link: there is no [[link]], so no robot can reach the server"});
}

TEST(ConfigErrors, PathsThatDoNotFitTheMemoryAreRefused) {
  // 20 001 nodes in a row, eight to a tile: 2501 tiles.
  constexpr std::string_view kLong = R"([map]
width_m = 2000
height_m = 2000
cell_m = 0.1
wide = true
[antennas]
bias_m = 0.33
[[pheromone]]
type = 1
core_m = 0.1
sigma_m = 0.4
tau_s = 0
quantum = 0.125
maximum = 0.25
[[path]]
pheromone = 1
points_m = [[0, 0], [2000, 0]]
[[link]]
name = "radio-a"
kind = "pty"
path = "a.pty"
[limits]
field_memory_mib = )";
  const Result<Config> little = ParseConfig(std::string(kLong) + "1", "f");
  ASSERT_FALSE(little.ok());
  EXPECT_EQ(little.error(),
            "f:23:20: limits.field_memory_mib: is not enough for the paths, expected at least 2");
  EXPECT_TRUE(ParseConfig(std::string(kLong) + "2", "f").ok());
}

}  // namespace
}  // namespace pheromone::config
