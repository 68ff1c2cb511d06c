// Obstacles drawn in the configuration and out of maps. What a shape blocks is server/core/field's
// matter, and tested there: here, each shape covers the squares of a few nodes.
#include <set>

#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

using Nodes = std::set<std::pair<int32_t, int32_t>>;  // (column, row)

class ObstacleTest : public FolderTest {
 protected:
  Nodes Blocked(std::string_view keys) const {
    const field::FieldConfig field = Field("[obstacles]\n" + std::string(keys));
    Nodes nodes;
    if (field.obstacles) {
      field.obstacles->ForEach(
          [&](field::NodeIndex node) { nodes.emplace(node.column, node.row); });
    }
    return nodes;
  }

  // Two pixels of 0.1 m over the nodes (10, 20) and (11, 20): occupied, and unknown.
  void WriteArena() const {
    Write("arena.pgm", "P2 2 1 255\n0 205\n");
    Write("arena.yaml",
          "image: arena.pgm\nresolution: 0.1\norigin: [0.95, 1.95, 0]\nnegate: 0\n"
          "occupied_thresh: 0.65\nfree_thresh: 0.1\n");
  }
};

TEST_F(ObstacleTest, WithoutATableTheMapIsAnOpenPlane) {
  EXPECT_FALSE(Field("").obstacles);
  EXPECT_FALSE(Field("[obstacles]\n").obstacles);
}

TEST_F(ObstacleTest, RectanglesDiscsAndWalls) {
  EXPECT_EQ(Blocked("rectangles_m = [[1.12, 2.01, 0.99, 1.96], [5, 5, 5.01, 5.01]]\n"),
            (Nodes{{10, 20}, {11, 20}, {50, 50}}));
  EXPECT_EQ(Blocked("discs_m = [[3, 2, 0.04]]\n"), (Nodes{{30, 20}}));
  EXPECT_EQ(Blocked("walls = [{points_m = [[1, 1], [1.2, 1]], thickness_m = 0.02}]\n"),
            (Nodes{{10, 10}, {11, 10}, {12, 10}}));
}

TEST_F(ObstacleTest, AMapOfRos) {
  WriteArena();
  EXPECT_EQ(Blocked("map = \"arena.yaml\"\n"), (Nodes{{10, 20}}));
  EXPECT_EQ(Blocked("map = \"arena.yaml\"\nunknown = \"free\"\n"), (Nodes{{10, 20}}));
  EXPECT_EQ(Blocked("map = \"arena.yaml\"\nunknown = \"blocked\"\ndiscs_m = [[3, 2, 0.04]]\n"),
            (Nodes{{10, 20}, {11, 20}, {30, 20}}));
}

// The map of these tests has 81 rows: 24 691 obstacles over all of them are too many.
TEST_F(ObstacleTest, CrossAtMostTwoMillionRowsTogether) {
  const auto many = [](int n) {
    std::string keys = "[obstacles]\nrectangles_m = [\n";
    for (int i = 0; i < n; ++i) {
      keys += "[5, -1, 5, 9],\n";
    }
    return keys +
           "]\ndiscs_m = [[3, 2, 0.04]]\nwalls = [{points_m = [[1, 1], [1.2, 1]], "
           "thickness_m = 0.02}]\n";
  };
  EXPECT_EQ(ErrorOf(many(24'000)), "");
  const std::string error = ErrorOf(many(25'000));
  EXPECT_NE(error.find("expected shapes that together cross at most 2000000 rows of nodes"),
            std::string::npos)
      << error;
  EXPECT_EQ(error.find('\n'), std::string::npos) << error;
}

TEST_F(ObstacleTest, DisabledObstaclesAreReadAllTheSame) {
  EXPECT_FALSE(Field("[obstacles]\nenabled = false\ndiscs_m = [[3, 2, 1]]\n").obstacles);
  EXPECT_EQ(ErrorOf("[obstacles]\nenabled = false\ndiscs_m = [[3, 2]]\n"),
            "f.toml:31:12: obstacles.discs_m[1]: found [3, 2], expected a centre and a "
            "non-negative radius, [x, y, r] in metres");
}

TEST_F(ObstacleTest, MistakesAreTold) {
  const auto error = [this](std::string_view keys) {
    return ErrorOf("[obstacles]\n" + std::string(keys));
  };
  EXPECT_EQ(error("rectangles_m = [[1, 2, 3]]\n"),
            "f.toml:30:17: obstacles.rectangles_m[1]: found [1, 2, 3], expected two opposite "
            "corners [x0, y0, x1, y1] in metres");
  EXPECT_EQ(error("rectangles_m = 1\n"),
            "f.toml:30:16: obstacles.rectangles_m: found 1, expected an array of rectangles [x0, "
            "y0, x1, y1] in metres");
  EXPECT_EQ(error("rectangles_m = [[1, 2, 3, true]]\n"),
            "f.toml:30:27: obstacles.rectangles_m[1]: found true, expected a number from -1000000 "
            "to 1000000");
  EXPECT_EQ(error("discs_m = [[1, 2, -3]]\n"),
            "f.toml:30:12: obstacles.discs_m[1]: found [1, 2, -3], expected a centre and a "
            "non-negative radius, [x, y, r] in metres");
  EXPECT_EQ(error("walls = [[[1, 1], [2, 2]]]\n"),
            "f.toml:30:10: obstacles.walls[1]: found an array of 2, expected a wall {points_m = "
            "[...], thickness_m = ...}");
  EXPECT_EQ(error("walls = [{points_m = [[1, 1]], thickness_m = 0.1}]\n"),
            "f.toml:30:22: obstacles.walls[1].points_m: found an array of 1, expected at least 2 "
            "points [x, y] in metres");
  EXPECT_EQ(error("walls = [{points_m = [[1, 1], [2, 2]]}]\n"),
            "f.toml:30:10: obstacles.walls[1].thickness_m: missing, expected a number from 0 to "
            "1000000");
  EXPECT_EQ(error("walls = [{points_m = [[1, 1], [2, 2]], thickness_m = 0, width_m = 1}]\n"),
            "f.toml:30:57: obstacles.walls[1].width_m: unknown key, expected one of points_m, "
            "thickness_m");
  EXPECT_EQ(error("enabled = 1\n"),
            "f.toml:30:11: obstacles.enabled: found 1, expected true or false");
  EXPECT_EQ(error("disc_m = []\n"),
            "f.toml:30:1: obstacles.disc_m: unknown key, expected discs_m?");
  EXPECT_EQ(ErrorOf("obstacles = 3\n").substr(0, 11), "f.toml:29:1");
}

TEST_F(ObstacleTest, MistakesWithMapsAreTold) {
  const auto error = [this](std::string_view keys) {
    return ErrorOf("[obstacles]\n" + std::string(keys));
  };
  WriteArena();
  Write("bad.yaml",
        "image: none.pgm\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.1\n");
  EXPECT_EQ(error("map = \"arena.pgm\"\n"),
            "f.toml:30:7: obstacles.map: found the string \"arena.pgm\", expected a file whose "
            "name ends in one of .yaml, .yml");
  EXPECT_EQ(error("map = \"arena.yaml\"\nunknown = \"full\"\n"),
            "f.toml:31:11: obstacles.unknown: found the string \"full\", expected one of \"free\", "
            "\"blocked\"");
  EXPECT_EQ(error("unknown = \"free\"\n"),
            "f.toml:30:11: obstacles.unknown: found without map, expected only together with map");
  EXPECT_EQ(error("map = \"bad.yaml\"\n").substr(0, 38), "f.toml:30:7: obstacles.map: none.pgm: ");
}

}  // namespace
}  // namespace pheromone::config
