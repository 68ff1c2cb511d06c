// Each way to get a configuration wrong, with the message that it gets: line, column, key, what was
// found, what was expected.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/config/testing/config_text.h"

namespace pheromone::config {
namespace {

class ConfigErrorTest : public ErrorsTest {};

TEST(ConfigErrorsTest, TheTextToDamageIsGood) {
  EXPECT_EQ(ErrorOf(kGood), "");
}

TEST_P(ConfigErrorTest, NamesPlaceKeyAndExpectation) {
  ExpectError();
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
             "7:1: antennas.xyzzyxyzzy: unknown key, expected one of bias_m, forward_m, "
             "angle_deg"},
        Case{19, "sigma_m = 0.4\nsigma = 1",
             "20:1: pheromone[2].sigma: unknown key, expected sigma_m?"},
        Case{5, "[antenna]\n[antennas]", "5:2: antenna: unknown key, expected antennas?"},
        Case{29, "path = \"a.pty\"\nsilence_s = 9600",
             "30:1: link[1].silence_s: unknown key, expected one of name, kind, required, clients, "
             "security, keys, on, path, baud, medium_access, slot_ms, response_window_ms, "
             "turnaround_ms, "
             "adapter_latency_ms, server_delay_ms, gap_timeout_ms"},
        Case{2, "", "1:1: map.width_m: missing, expected a number from 0.000001 to 1000000"},
        Case{6, "", "5:1: antennas.bias_m: missing, expected a number from 0 to 65"},
        Case{16, "", "15:1: pheromone[2].type: missing, expected a whole number from 1 to 15"},
        Case{24, "", "23:1: path[1].pheromone: missing, expected 1 or \"trail\", 2 or \"path\""},
        Case{25, "",
             "23:1: path[1].points_m: missing, expected at least 2 points [x, y] in metres"},
        Case{
            28, "",
            "26:1: link[1].kind: missing, expected one of \"pty\", \"serial\", \"tcp\", \"udp\""}));

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
             "1:1: map.wide: the map extends to 32.768 m, which is more than "
             "32767 pose units of 1 mm, expected wide = true, a larger "
             "pose_unit_mm or another origin"},
        Case{6, "bias_m = 0.3301",
             "6:10: antennas.bias_m: found 0.3301, expected a multiple of 0.001"},
        Case{6, "bias_m = 65.001",
             "6:10: antennas.bias_m: found 65.001, expected a number from 0 to 65"},
        Case{6, "bias_m = -0.1",
             "6:10: antennas.bias_m: found -0.1, expected a number from 0 to 65"},
        Case{6, "bias_m = 1\nforward_m = 32.5",
             "7:13: antennas.forward_m: found 32.5, expected a number from -32 to 32"},
        Case{6, "bias_m = 1\nangle_deg = 181",
             "7:13: antennas.angle_deg: found 181, expected a number from 0 to 180"},
        Case{4, "cell_m = 0.1\ndatum = 3",
             "5:9: map.datum: found 3, expected {latitude_deg = ..., longitude_deg = ..., "
             "height_m = 0}"},
        Case{4, "cell_m = 0.1\ndatum = {latitude_deg = 91, longitude_deg = 0}",
             "5:25: map.datum.latitude_deg: found 91, expected a number from -90 to 90"},
        Case{4, "cell_m = 0.1\ndatum = {latitude_deg = 1, longitude_deg = \"8E\"}",
             "5:44: map.datum.longitude_deg: found the string \"8E\", expected a number from -180 "
             "to 180"},
        Case{4, "cell_m = 0.1\ndatum = {latitude_deg = nan, longitude_deg = 0}",
             "5:25: map.datum.latitude_deg: found nan, expected a number from -90 to 90"},
        Case{4, "cell_m = 0.1\ndatum = {latitude_deg = 1}",
             "5:9: map.datum.longitude_deg: missing, expected a number from -180 to 180"},
        Case{4, "cell_m = 0.1\ndatum = {latitude_deg = 1, longitude_deg = 2, height_m = 1e6}",
             "5:58: map.datum.height_m: found 1000000, expected a number from -100000 to 100000"},
        Case{4, "cell_m = 0.1\ndatum = {lat = 1, latitude_deg = 1, longitude_deg = 2}",
             "5:10: map.datum.lat: unknown key, expected latitude_deg?"},
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
             "16:8: pheromone[2].type: found 1 again, expected a number not used by \"trail\""},
        Case{17, "name = \"trail\"",
             "17:8: pheromone[2].name: found \"trail\" again, expected another name"}));

TEST(ConfigErrorsTest, AllMistakesAreFoundAtOnceInTheOrderOfTheFile) {
  EXPECT_EQ(ErrorOf("[map]\nwidth_m = 0\nheight_m = 1\ncell_m = -1\nx = 1\n[antennas]\nbias_m = 1\n"
                    "[[link]]\nname = 1\nkind = \"pty\"\npath = \"p\"\n"),
            "f.toml:1:1: pheromone: missing, expected at least one table [[pheromone]]\n"
            "f.toml:2:11: map.width_m: found 0, expected a number from 0.000001 to 1000000\n"
            "f.toml:4:10: map.cell_m: found -1, expected a number from 0.000001 to 1000000\n"
            "f.toml:5:1: map.x: unknown key, expected one of width_m, height_m, cell_m, "
            "origin_x_m, origin_y_m, pose_unit_mm, wide, datum\n"
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

TEST(ConfigErrorsTest, AByteOrderMarkIsNoError) {
  EXPECT_EQ(ErrorOf("\xEF\xBB\xBF"
                    "map = 3\n"),
            ErrorOf("map = 3\n"));
  EXPECT_EQ(ErrorOf("\xFF\xFEm"),
            "f.toml:1:1: syntax: found the byte order mark of UTF-16 or UTF-32, expected UTF-8");
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
  EXPECT_EQ(ErrorOf(keys + "=1"), "f.toml:1:17: syntax: tables and arrays are nested too deeply");
  EXPECT_NE(ErrorOf("a = " + std::string(10'000, '[')), "");
}

// In micrometres, it is infinite.
TEST(ConfigErrorsTest, ANumberThatOverflowsWhenScaledIsOutOfRange) {
  EXPECT_EQ(ErrorOf(Replaced(4, "cell_m = 0.1\norigin_x_m = -1e308")),
            "f.toml:5:14: map.origin_x_m: found -1e+308, expected a number from -1000000 to "
            "1000000");
}

TEST(ConfigErrorsTest, NoMoreLinksThanCouldBeOpen) {
  std::string text(kGood);
  for (int i = 0; i < 254; ++i) {
    const std::string name = "l" + std::to_string(i);
    text.append("[[link]]\nname = \"").append(name).append("\"\nkind = \"pty\"\npath = \"");
    text.append(name).append("\"\n");
  }
  EXPECT_EQ(ErrorOf(text), "f.toml:1050:1: link: found 257 tables, expected at most 256");
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
  EXPECT_EQ(
      ErrorOf(text),
      "f.toml:6:10: antennas.bias_m: half of it and the largest core_m + sigma_m add up to 21.5 m "
      "or 2150 cells, expected at most 1000 cells");
  text.replace(text.find("bias_m = 42"), 11, "bias_m = 19");
  EXPECT_EQ(ErrorOf(text), "");
  // 19 m / 2 + 0.02 m + 0.5 m, to whichever side.
  text.replace(text.find("bias_m = 19"), 11, "bias_m = 19\nforward_m = -0.02");
  EXPECT_EQ(ErrorOf(text),
            "f.toml:6:10: antennas.bias_m: half of it, forward_m and the largest core_m + sigma_m "
            "add up to 10.02 m or 1002 cells, expected at most 1000 cells");
}

TEST(ConfigErrorsTest, ALargeMapIsFineWithWideMessagesOrAnotherUnit) {
  EXPECT_EQ(ErrorOf(Replaced(2, "width_m = 100\nwide = true")), "");
  EXPECT_EQ(ErrorOf(Replaced(2, "width_m = 65.534\norigin_x_m = -32.767")), "");
  EXPECT_EQ(ErrorOf(Replaced(2, "width_m = 100\npose_unit_mm = 5")), "");
}

TEST(ConfigErrorsTest, AConfigurationWithoutLinksIsAWarning) {
  std::string text(kGood);
  text.resize(text.find("[[link]]"));
  const Result<Config> parsed = ParseConfig(text, "f");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  ASSERT_EQ(parsed.value().warnings.size(), 1u);
  EXPECT_EQ(parsed.value().warnings[0].text,
            "f:1:1: link: there is no [[link]], so no robot can reach the server");
}

}  // namespace
}  // namespace pheromone::config
