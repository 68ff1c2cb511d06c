#include "server/formats/maps/ros_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <random>

#include "server/base/file.h"
#include "server/base/testing/temporary_folder.h"
#include "server/formats/maps/png_picture.h"
#include "server/formats/maps/testing/rasters.h"

namespace pheromone::maps {
namespace {

using field::NodeIndex;
using testing::ErrorOf;
using testing::kNaN;
using testing::RasterOf;
using testing::Rows;
using testing::RowsOf;

constexpr const char* kLab = R"(# made by map_saver
image: lab.pgm
resolution: 0.050000
origin: [-51.224998, -100.0, 0.000000]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
)";

// The lab's file with one line replaced.
std::string With(const std::string& key, const std::string& line) {
  std::string text = kLab;
  const size_t begin = text.find(key + ":");
  return text.replace(begin, text.find('\n', begin) + 1 - begin, line.empty() ? "" : line + "\n");
}

std::string InfoError(const std::string& yaml) {
  return ErrorOf(ParseRosMapInfo(yaml, "lab.yaml"));
}

RosMapInfo Info(const std::string& yaml) {
  const auto info = ParseRosMapInfo(yaml, "lab.yaml");
  EXPECT_TRUE(info.ok()) << ErrorOf(info);
  return info.ok() ? info.value() : RosMapInfo();
}

// Checks what one row of levels means.
void ExpectOccupancy(const RosMapInfo& info, uint16_t maximum, const std::vector<double>& levels,
                     const std::vector<double>& expected) {
  const Raster occupancy = OccupancyOf(info, {RasterOf({levels}), maximum});
  EXPECT_TRUE(testing::Same(occupancy, RasterOf({expected})))
      << ::testing::PrintToString(RowsOf(occupancy));
}

TEST(RosMapInfo, IsReadFromWhatMapSaverWrites) {
  const RosMapInfo info = Info(kLab);
  EXPECT_EQ(info.image, "lab.pgm");
  EXPECT_EQ(info.resolution_um, 50'000);
  EXPECT_EQ(info.origin, (field::PointUm{-51'224'998, -100'000'000}));
  EXPECT_FALSE(info.negate);
  EXPECT_EQ(info.occupied_thresh, 0.65);
  EXPECT_EQ(info.free_thresh, 0.196);
  EXPECT_EQ(info.mode, RosMapMode::kTrinary);
}

TEST(RosMapInfo, ModesAndWaysToNegateAreUnderstood) {
  EXPECT_EQ(Info(With("negate", "mode: scale\nnegate: 1")).mode, RosMapMode::kScale);
  EXPECT_EQ(Info(With("negate", "mode: raw\nnegate: 1")).mode, RosMapMode::kRaw);
  EXPECT_EQ(Info(With("negate", "mode: trinary\nnegate: 1")).mode, RosMapMode::kTrinary);
  EXPECT_TRUE(Info(With("negate", "negate: 1")).negate);
  EXPECT_TRUE(Info(With("negate", "negate: true")).negate);
  EXPECT_FALSE(Info(With("negate", "negate: false")).negate);
}

TEST(RosMapInfo, AResolutionThatWentThroughFloat32IsTheOneThatWasMeant) {
  EXPECT_EQ(Info(With("resolution", "resolution: 0.05000000074505806")).resolution_um, 50'000);
  EXPECT_EQ(Info(With("resolution", "resolution: 0.025")).resolution_um, 25'000);
  EXPECT_EQ(Info(With("resolution", "resolution: 1e-6")).resolution_um, 1);
}

TEST(RosMapInfo, ErrorsSayWhereAndWhat) {
  EXPECT_EQ(
      InfoError(With("resolution", "resolution: 0.0333333")),
      "lab.yaml:3:13: resolution: expected a whole number of micrometres, 0.000001 m or more");
  EXPECT_EQ(
      InfoError(With("resolution", "resolution: 0")),
      "lab.yaml:3:13: resolution: expected a whole number of micrometres, 0.000001 m or more");
  EXPECT_EQ(InfoError(With("resolution", "resolution: 5 cm")),
            "lab.yaml:3:13: resolution: found \"5 cm\", expected a number from 0 to 1000");
  EXPECT_EQ(InfoError(With("resolution", "resolution: .nan")),
            "lab.yaml:3:13: resolution: found \".nan\", expected a number from 0 to 1000");
  EXPECT_EQ(InfoError(With("origin", "origin: [0, 0, 1.57]")),
            "lab.yaml:4:9: origin: found a yaw, expected 0: rotate the image instead");
  EXPECT_EQ(InfoError(With("origin", "origin: [0, 0]")),
            "lab.yaml:4:9: origin: expected [x, y, yaw]");
  EXPECT_EQ(InfoError(With("origin", "origin: [0, 1e7, 0]")),
            "lab.yaml:4:13: origin: found \"1e7\", expected a number from -1e+06 to 1e+06");
  EXPECT_EQ(InfoError(With("negate", "negate: maybe")),
            "lab.yaml:5:9: negate: found \"maybe\", expected 0 or 1");
  EXPECT_EQ(InfoError(With("free_thresh", "free_thresh: 0.65")),
            "lab.yaml:7:14: free_thresh: expected less than occupied_thresh");
  EXPECT_EQ(InfoError(With("negate", "negate: 0\nmode: ternary")),
            "lab.yaml:6:7: mode: found \"ternary\", expected trinary, scale or raw");
  EXPECT_EQ(InfoError(With("image", "image: [a, b]")), "lab.yaml:2:8: image: expected a word");
  EXPECT_EQ(InfoError("- a\n"), "lab.yaml:1:1: expected keys and values: image: lab.pgm");
  EXPECT_EQ(InfoError(""), "lab.yaml:1:1: expected keys and values: image: lab.pgm");
  EXPECT_EQ(InfoError("a: b\n\tc").substr(0, 11), "lab.yaml:2:");
}

TEST(RosMapInfo, EachRequiredKeyIsMissed) {
  for (const std::string key :
       {"image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"}) {
    EXPECT_EQ(InfoError(With(key, "")), "lab.yaml:2:1: the key \"" + key + "\" is missing");
  }
}

TEST(RosMapInfo, AKeyGivenTwiceIsRefused) {
  EXPECT_EQ(InfoError(With("negate", "negate: 0\nnegate: 1")),
            "lab.yaml:6:1: negate: found again, expected it once");
}

TEST(RosMapInfo, HostileYamlIsRefused) {
  EXPECT_EQ(InfoError(std::string(65'537, ' ')),
            "lab.yaml: too long, expected at most 65536 bytes");
  EXPECT_EQ(InfoError("\n" + std::string(60'000, '[')),
            "lab.yaml:2:1: nested too deeply, expected keys and values");
  EXPECT_FALSE(ParseRosMapInfo(std::string(60'000, '{'), "a").ok());
  std::string laughs = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 60; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    laughs += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before;
    for (int n = 0; n < 8; ++n) {
      laughs += ", " + before;
    }
    laughs += "]\n";
  }
  EXPECT_EQ(Info(laughs + kLab).resolution_um, 50'000);
  EXPECT_FALSE(ParseRosMapInfo(laughs + With("image", "image: *a59"), "a").ok());
}

TEST(Occupancy, TrinaryComparesWithBothThresholds) {
  RosMapInfo info;
  // p = (255 - x) / 255: 0.65 is between x = 89 and 90, 0.196 between 205 and 206.
  ExpectOccupancy(info, 255, {0, 89, 90, 205, 206, 254, 255, kNaN},
                  {100, 100, kNaN, kNaN, 0, 0, 0, kNaN});
  info.negate = true;
  // p = x / 255: 0.196 is between x = 49 and 50, 0.65 between 165 and 166.
  ExpectOccupancy(info, 255, {0, 49, 50, 165, 166, 255}, {0, 0, kNaN, kNaN, 100, 100});
}

TEST(Occupancy, OnAThresholdIsUnknown) {
  RosMapInfo info;
  info.occupied_thresh = 0.75;
  info.free_thresh = 0.25;
  ExpectOccupancy(info, 4, {0, 1, 2, 3, 4}, {100, kNaN, kNaN, kNaN, 0});
}

TEST(Occupancy, ScaleGradesWhatIsBetween) {
  RosMapInfo info;
  info.mode = RosMapMode::kScale;
  info.occupied_thresh = 0.75;
  info.free_thresh = 0.25;
  // 99 (p - 0.25) / 0.5 for p = 3/4, 5/8, 1/2, 3/8, 1/4.
  ExpectOccupancy(info, 8, {0, 1, 2, 3, 4, 5, 6, 7, 8, kNaN},
                  {100, 100, 99, 74, 49, 24, 0, 0, 0, kNaN});
}

TEST(Occupancy, RawIsTheLevelItself) {
  RosMapInfo info;
  info.mode = RosMapMode::kRaw;
  ExpectOccupancy(info, 255, {0, 1, 99, 100, 101, 255}, {0, 1, 99, 100, kNaN, kNaN});
  ExpectOccupancy(info, 65535, {257 * 42, 65535}, {42, kNaN});
  info.negate = true;
  ExpectOccupancy(info, 255, {7}, {7});
}

TEST(Occupancy, LiesWhereTheMapSays) {
  const Raster occupancy = OccupancyOf(Info(kLab), {RasterOf({{0}}), 255});
  EXPECT_EQ(occupancy.origin, (field::PointUm{-51'224'998, -100'000'000}));
  EXPECT_EQ(occupancy.cell_um, 50'000);
}

// The nodes of the runs, and that they are whole runs, in their order.
std::vector<NodeIndex> Blocked(const Raster& raster, const field::MapGeometry& map,
                               const ObstacleOptions& options) {
  std::vector<NodeIndex> nodes;
  const Status status =
      ForEachBlockedRun(raster, map, options, [&nodes](int32_t row, int32_t first, int32_t last) {
        EXPECT_LE(first, last);
        EXPECT_TRUE(nodes.empty() || nodes.back().row < row ||
                    (nodes.back().row == row && nodes.back().column < first - 1));
        for (int32_t column = first; column <= last; ++column) {
          nodes.push_back({column, row});
        }
      });
  EXPECT_TRUE(status.ok()) << ErrorOf(status);
  return nodes;
}

// Straight from the definition: each node against each cell, the squares' corners doubled.
std::vector<NodeIndex> NaiveBlocked(const Raster& raster, const field::MapGeometry& map,
                                    const ObstacleOptions& options) {
  std::vector<NodeIndex> nodes;
  for (int32_t row = 0; row < map.rows(); ++row) {
    for (int32_t column = 0; column < map.columns(); ++column) {
      const field::PointUm node = map.PositionOf({column, row});
      bool blocked = false;
      for (int32_t i = 0; i < raster.rows; ++i) {
        for (int32_t j = 0; j < raster.columns; ++j) {
          const double value = raster.At(j, i);
          const int64_t left = 2 * (raster.origin.x + j * raster.cell_um);
          const int64_t bottom = 2 * (raster.origin.y + i * raster.cell_um);
          const int64_t side = 2 * raster.cell_um;
          const bool overlaps =
              left < 2 * node.x + map.cell_um && left + side > 2 * node.x - map.cell_um &&
              bottom < 2 * node.y + map.cell_um && bottom + side > 2 * node.y - map.cell_um;
          blocked |= overlaps &&
                     (std::isnan(value) ? options.unknown_blocks : value >= options.occupied_from);
        }
      }
      if (blocked) {
        nodes.push_back({column, row});
      }
    }
  }
  return nodes;
}

TEST(BlockedNodes, AreThoseWhoseSquareAnOccupiedCellOverlaps) {
  std::mt19937 random(2);
  const auto from_to = [&random](int low, int high) {
    return low + static_cast<int>(random() % static_cast<unsigned>(high - low + 1));
  };
  for (int round = 0; round < 1000; ++round) {
    Raster raster = MakeRaster(from_to(1, 8), from_to(1, 8));
    raster.cell_um = from_to(1, 12);
    raster.origin = {from_to(-40, 40), from_to(-40, 40)};
    for (double& value : raster.values) {
      value = std::array<double, 6>{0, 0, 0, 50, 100, kNaN}[static_cast<size_t>(from_to(0, 5))];
    }
    const field::MapGeometry map = {.origin = {from_to(-30, 30), from_to(-30, 30)},
                                    .width_um = from_to(12, 60),
                                    .height_um = from_to(12, 60),
                                    .cell_um = from_to(1, 12)};
    const ObstacleOptions options = {.unknown_blocks = from_to(0, 1) == 1,
                                     .occupied_from = from_to(0, 1) == 1 ? 50.0 : 100.0};
    ASSERT_EQ(Blocked(raster, map, options), NaiveBlocked(raster, map, options)) << round;
  }
}

TEST(BlockedNodes, TouchingIsNotOverlapping) {
  Raster wall = RasterOf({{100}});
  wall.cell_um = 100;
  const field::MapGeometry map = {
      .origin = {0, 0}, .width_um = 1000, .height_um = 1000, .cell_um = 100};
  wall.origin = {150, 150};  // exactly the square of node (2, 2)
  EXPECT_EQ(Blocked(wall, map, {}), (std::vector<NodeIndex>{{2, 2}}));
  wall.origin = {151, 150};  // a micrometre of node (3, 2) as well
  EXPECT_EQ(Blocked(wall, map, {}), (std::vector<NodeIndex>{{2, 2}, {3, 2}}));
}

TEST(BlockedNodes, AWallThinnerThanACellIsNotLost) {
  Raster wall = MakeRaster(1, 1000);
  std::fill(wall.values.begin(), wall.values.end(), kOccupied);
  wall.cell_um = 1'000;
  wall.origin = {437'000, 0};
  const field::MapGeometry map = {
      .origin = {0, 0}, .width_um = 1'000'000, .height_um = 1'000'000, .cell_um = 100'000};
  const std::vector<NodeIndex> blocked = Blocked(wall, map, {});
  ASSERT_EQ(blocked.size(), 11U);
  for (int32_t row = 0; row < 11; ++row) {
    EXPECT_EQ(blocked[static_cast<size_t>(row)], (NodeIndex{4, row}));
  }
}

TEST(BlockedNodes, ARasterOfNoKnownSizeIsRefused) {
  const field::MapGeometry map = {
      .origin = {0, 0}, .width_um = 900, .height_um = 900, .cell_um = 100};
  EXPECT_EQ(ErrorOf(ForEachBlockedRun(RasterOf({{100}}), map, {}, nullptr)),
            "obstacles: the size of a cell of the raster is not known");
}

TEST(RosMap, OfThreeValuesIsWrittenAsMapSaverDoes) {
  Raster raster = RasterOf({{0, 100, kNaN}});
  raster.cell_um = 50'000;
  raster.origin = {-1'500'000, 1};
  const RosMapFiles files = EncodeRosMap(raster, "lab.pgm");
  EXPECT_EQ(files.yaml,
            "image: lab.pgm\nresolution: 0.05\norigin: [-1.5, 0.000001, 0]\nnegate: 0\n"
            "occupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n");
  EXPECT_EQ(files.pgm, std::string("P5\n3 1\n255\n\xFE\x00\xCD", 14));
}

TEST(RosMap, OfMoreValuesIsRaw) {
  Raster raster = RasterOf({{0, 41.6, kNaN, -1}});
  raster.cell_um = 1;
  const RosMapFiles files = EncodeRosMap(raster, "a.pgm");
  EXPECT_NE(files.yaml.find("mode: raw\n"), std::string::npos);
  EXPECT_EQ(files.pgm, std::string("P5\n4 1\n255\n\x00\x2A\xFF\xFF", 15));
}

class RosMapFilesTest : public ::testing::Test {
 protected:
  std::string In(const std::string& name) const { return (folder_ / name).string(); }

  const TemporaryFolder folder_;
};

TEST_F(RosMapFilesTest, ComesBackAsItWasWritten) {
  for (const Rows& rows : {Rows{{0, 100}, {kNaN, 0}, {100, 100}}, Rows{{0, 33}, {kNaN, 100}}}) {
    Raster raster = RasterOf(rows);
    raster.cell_um = 33'333;
    raster.origin = {-123'456'789'012, 7};
    const std::string path = In("a map, \"quoted\": #1.yaml");
    ASSERT_TRUE(SaveRosMap(path, raster).ok());
    const auto back = LoadRosMap(path);
    ASSERT_TRUE(back.ok()) << back.error();
    EXPECT_TRUE(testing::Same(back.value(), raster));
    EXPECT_EQ(back.value().origin, raster.origin);
    EXPECT_EQ(back.value().cell_um, raster.cell_um);
  }
}

TEST_F(RosMapFilesTest, ThePictureIsFoundBesideTheYamlAndMayBePng) {
  std::filesystem::create_directory(In("pictures"));
  ASSERT_TRUE(SaveGrayPng(In("pictures/lab.png"), {RasterOf({{0, 205, 254}}), 255}).ok());
  ASSERT_TRUE(WriteFile(In("lab.yaml"), With("image", "image: pictures/lab.png")).ok());
  const auto map = LoadRosMap(In("lab.yaml"));
  ASSERT_TRUE(map.ok()) << map.error();
  EXPECT_TRUE(testing::Same(map.value(), RasterOf({{100, kNaN, 0}})));
}

TEST_F(RosMapFilesTest, ErrorsNameTheFileThatIsWrong) {
  EXPECT_EQ(ErrorOf(LoadRosMap(In("lab.yaml"))),
            In("lab.yaml") + ": cannot be opened: No such file or directory");
  ASSERT_TRUE(WriteFile(In("lab.yaml"), kLab).ok());
  EXPECT_EQ(ErrorOf(LoadRosMap(In("lab.yaml"))),
            In("lab.pgm") + ": cannot be opened: No such file or directory");
  ASSERT_TRUE(WriteFile(In("lab.pgm"), "P5 1").ok());
  EXPECT_EQ(ErrorOf(LoadRosMap(In("lab.yaml"))),
            In("lab.pgm") + ":1:5: found the end, expected the height, 1 to 30000");
  EXPECT_EQ(ErrorOf(SaveRosMap(In("b.yaml"), RasterOf({{0}}))),
            In("b.yaml") + ": cannot be written: the size of a cell is not known");
}

}  // namespace
}  // namespace pheromone::maps
