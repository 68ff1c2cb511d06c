// Each way to get a path wrong that is written in the configuration itself.

#include "server/config/testing/config_text.h"

namespace pheromone::config {
namespace {

class PathErrorsTest : public ErrorsTest {};

TEST_P(PathErrorsTest, NamesPlaceKeyAndExpectation) {
  ExpectError();
}

INSTANTIATE_TEST_SUITE_P(
    Written, PathErrorsTest,
    ::testing::Values(
        Case{24, "pheromone = \"food\"",
             "24:13: path[1].pheromone: found the string \"food\", "
             "expected 1 or \"trail\", 2 or \"path\""},
        Case{24, "pheromone = 7",
             "24:13: path[1].pheromone: found 7, expected 1 or \"trail\", 2 or \"path\""},
        Case{25, "points_m = [[1, 1], [10.5, 2]]",
             "25:21: path[1].points_m[2]: found [10.5, 2], expected a point on the map, from (0, "
             "0) to (10, 8)"},
        Case{25, "points_m = [[1, 1], [2]]",
             "25:21: path[1].points_m[2]: found [2], "
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
             "27:12: path[1].radius_m: found 2.5, expected a circle within the map"},
        Case{25, "shape = \"circle\"\ncenter_m = [2, 2]\nradius_m = 1\nclosed = true",
             "28:1: path[1].closed: unknown key, expected one of name, pheromone, shape, center_m, "
             "radius_m, intensity"}));

// The spline through the corners of a rectangle bulges between them.
TEST(PathsTest, ACurveMayNotLeaveTheMapBetweenItsPoints) {
  const std::string error = ErrorOf(Replaced(
      25, "shape = \"spline\"\nclosed = true\npoints_m = [[0, 2], [0, 6], [4, 6], [4, 2]]"));
  EXPECT_EQ(error.substr(0, error.find(" (")),
            "f.toml:27:12: path[1].points_m: the curve leaves the map at");
}

TEST(PathsTest, PathsLongerThanAMillionCellsAreRefused) {
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

TEST(PathsTest, PathsThatDoNotFitTheMemoryAreRefused) {
  // 20 001 nodes in a row, eight to a tile: 2501 tiles of more than half a kilobyte.
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
  constexpr std::string_view kError =
      "f:23:20: limits.field_memory_mib: is not enough for the paths and initial rasters, expected "
      "at "
      "least ";
  ASSERT_EQ(little.error().substr(0, kError.size()), kError);
  // What is said to be enough is, and one less is not.
  const int enough = std::stoi(little.error().substr(kError.size()));
  ASSERT_GT(enough, 1);
  EXPECT_FALSE(ParseConfig(std::string(kLong) + std::to_string(enough - 1), "f").ok());
  EXPECT_TRUE(ParseConfig(std::string(kLong) + std::to_string(enough), "f").ok());
}

}  // namespace
}  // namespace pheromone::config
