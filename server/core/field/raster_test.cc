// Runs of nodes against the plain definition: every node of the map, every segment, in integers.

#include "server/core/field/raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "server/core/field/testing/random_field.h"
#include "server/core/field/wide_integer.h"

namespace pheromone::field {
namespace {

using Shape = FieldEdit::Shape;
using testing::Between;
using testing::OneIn;
using testing::Random;

constexpr int64_t kFarUm = int64_t{1} << 50;

// Whether `p` is within `radius` of the straight line from `a` to `b`.
bool IsNear(PointUm p, PointUm a, PointUm b, int64_t radius) {
  const Int128 dx = b.x - a.x;
  const Int128 dy = b.y - a.y;
  const Int128 px = p.x - a.x;
  const Int128 py = p.y - a.y;
  const Int128 along = px * dx + py * dy;
  const Int128 length2 = dx * dx + dy * dy;
  const Int128 radius2 = Int128{radius} * radius;
  if (along <= 0 || length2 == 0) {
    return px * px + py * py <= radius2;
  }
  if (along >= length2) {
    const Int128 qx = p.x - b.x;
    const Int128 qy = p.y - b.y;
    return qx * qx + qy * qy <= radius2;
  }
  const Int128 across = px * dy - py * dx;  // distance * length
  return CompareToRoot(across, radius2, length2) <= 0;
}

bool IsIn(const FieldEdit& edit, PointUm at) {
  if (edit.shape == Shape::kAll) {
    return true;
  }
  if (edit.shape == Shape::kRectangle) {
    const auto between = [](int64_t value, int64_t a, int64_t b) {
      return std::min(a, b) <= value && value <= std::max(a, b);
    };
    return between(at.x, edit.points[0].x, edit.points[1].x) &&
           between(at.y, edit.points[0].y, edit.points[1].y);
  }
  bool is_near =
      edit.points.size() == 1 && IsNear(at, edit.points[0], edit.points[0], edit.radius_um);
  for (size_t i = 1; i < edit.points.size() && !is_near; ++i) {
    is_near = IsNear(at, edit.points[i - 1], edit.points[i], edit.radius_um);
  }
  return is_near;
}

Raster NaiveRaster(const FieldEdit& edit, const MapGeometry& map) {
  Raster raster;
  std::set<std::tuple<int32_t, int32_t, int32_t, int32_t>> tiles;  // leaf of 16 x 16 tiles, tile
  for (int32_t row = 0; row < map.rows(); ++row) {
    bool is_open = false;
    for (int32_t column = 0; column < map.columns(); ++column) {
      const bool is_in = IsIn(edit, map.PositionOf({column, row}));
      if (is_in && !is_open) {
        raster.runs.push_back({row, column, column});
      }
      if (is_in) {
        raster.runs.back().last = column;
        tiles.insert({row / 128, column / 128, row / 8, column / 8});
        ++raster.node_count;
      }
      is_open = is_in;
    }
  }
  for (const auto& [leaf_row, leaf_column, row, column] : tiles) {
    raster.tiles.push_back({column, row});
  }
  return raster;
}

std::string TextOf(const FieldEdit& edit, const MapGeometry& map) {
  std::string text = "cell " + std::to_string(map.cell_um) + " origin " +
                     std::to_string(map.origin.x) + "," + std::to_string(map.origin.y) + " size " +
                     std::to_string(map.width_um) + "," + std::to_string(map.height_um) +
                     " radius " + std::to_string(edit.radius_um) + " points";
  for (const PointUm point : edit.points) {
    text += " " + std::to_string(point.x) + "," + std::to_string(point.y);
  }
  return text;
}

// Compares with the plain definition; returns how many nodes there were.
int64_t Check(const FieldEdit& edit, const MapGeometry& map) {
  const Result<Raster> raster = RasterOf(edit, map);
  EXPECT_TRUE(raster.ok());
  const Raster expected = NaiveRaster(edit, map);
  EXPECT_EQ(raster.value().runs, expected.runs) << TextOf(edit, map);
  EXPECT_EQ(raster.value().tiles, expected.tiles) << TextOf(edit, map);
  EXPECT_EQ(raster.value().node_count, expected.node_count) << TextOf(edit, map);
  return expected.node_count;
}

MapGeometry RandomMap(Random& random, int64_t most_cells) {
  MapGeometry map;
  map.cell_um = OneIn(random, 3) ? Between(random, 1, 20) : Between(random, 10, 300'000);
  map.origin = {Between(random, -5'000'000, 5'000'000), Between(random, -5'000'000, 5'000'000)};
  map.width_um = Between(random, 0, most_cells * map.cell_um);
  map.height_um = Between(random, 0, most_cells * map.cell_um);
  return map;
}

PointUm PointNear(Random& random, const MapGeometry& map, int64_t beyond_um) {
  const PointUm point{map.origin.x + Between(random, -beyond_um, map.width_um + beyond_um),
                      map.origin.y + Between(random, -beyond_um, map.height_um + beyond_um)};
  if (OneIn(random, 2)) {
    return point;
  }
  return {point.x - (point.x - map.origin.x) % map.cell_um,  // on a node
          point.y - (point.y - map.origin.y) % map.cell_um};
}

int64_t RandomRadius(Random& random, const MapGeometry& map) {
  switch (Between(random, 0, 4)) {
    case 0:
      return 0;
    case 1:
      return Between(random, 0, map.cell_um);
    case 2:
      return Between(random, 0, 8) * map.cell_um;
    case 3:
      return Between(random, 0, 40 * map.cell_um);
    default:
      return Between(random, 0, 4 * map.cell_um);
  }
}

bool Failed() {
  return ::testing::Test::HasFailure();
}

TEST(RasterOf, RandomStrokesAreThePlainDefinition) {
  Random random(1);
  int64_t nodes = 0;
  for (int i = 0; i < 6'000 && !Failed(); ++i) {
    const MapGeometry map = RandomMap(random, 25);
    FieldEdit edit;
    edit.shape = Shape::kStroke;
    edit.radius_um = RandomRadius(random, map);
    const auto points = static_cast<size_t>(Between(random, 1, OneIn(random, 8) ? 60 : 5));
    while (edit.points.size() < points) {
      edit.points.push_back(!edit.points.empty() && OneIn(random, 6)
                                ? edit.points.back()  // a segment without a length
                                : PointNear(random, map, 8 * map.cell_um));
      if (edit.points.size() > 1 && OneIn(random, 4)) {  // along an axis
        const PointUm before = edit.points[edit.points.size() - 2];
        (OneIn(random, 2) ? edit.points.back().x : edit.points.back().y) =
            OneIn(random, 2) ? before.x : before.y;
      }
    }
    nodes += Check(edit, map);
  }
  EXPECT_GE(nodes, 200'000);
}

// Lines through nodes, which are in by equality alone, and rows where a line passes between two.
TEST(RasterOf, StrokesWithoutAWidthHaveTheNodesThatTheyGoThrough) {
  Random random(2);
  int64_t nodes = 0;
  for (int i = 0; i < 4'000 && !Failed(); ++i) {
    const MapGeometry map = RandomMap(random, 40);
    FieldEdit edit;
    edit.shape = Shape::kStroke;
    edit.points = {{map.origin.x + Between(random, -5, 30) * map.cell_um,
                    map.origin.y + Between(random, -5, 30) * map.cell_um}};
    for (int segment = 0; segment < 3; ++segment) {  // through several nodes each
      const int64_t steps = Between(random, 0, 10) * map.cell_um;
      const PointUm last = edit.points.back();
      edit.points.push_back(
          {last.x + Between(random, -4, 4) * steps, last.y + Between(random, -4, 4) * steps});
    }
    nodes += Check(edit, map);
  }
  EXPECT_GE(nodes, 10'000);
}

TEST(RasterOf, AStraightLineThroughNodesHasOnlyThose) {
  const MapGeometry map{{-3'000, -1'000}, 20'000, 20'000, 1'000};
  FieldEdit edit;
  edit.shape = Shape::kStroke;
  edit.points = {{-3'000, -1'000}, {12'000, 9'000}};  // three columns for two rows
  EXPECT_EQ(RasterOf(edit, map).value().runs,
            (std::vector<NodeRun>{
                {0, 0, 0}, {2, 3, 3}, {4, 6, 6}, {6, 9, 9}, {8, 12, 12}, {10, 15, 15}}));
  edit.points[1].x += 1;
  EXPECT_EQ(RasterOf(edit, map).value().runs, (std::vector<NodeRun>{{0, 0, 0}}));
}

// From one point to the next across the map, as the strokes of someone who fills an area are.
TEST(RasterOf, ZigzagsAreThePlainDefinition) {
  Random random(3);
  for (int i = 0; i < 300 && !Failed(); ++i) {
    const MapGeometry map = RandomMap(random, 30);
    FieldEdit edit;
    edit.shape = Shape::kStroke;
    edit.radius_um = RandomRadius(random, map);
    const int64_t points = Between(random, 2, 100);
    for (int64_t p = 0; p < points; ++p) {
      edit.points.push_back({map.origin.x + map.width_um * p / points,
                             map.origin.y + (p % 2 == 0 ? 0 : map.height_um)});
      if (i % 2 == 0) {
        std::swap(edit.points.back().x, edit.points.back().y);
      }
    }
    Check(edit, map);
  }
}

TEST(RasterOf, RingsAreThePlainDefinition) {
  Random random(4);
  for (int i = 0; i < 200 && !Failed(); ++i) {
    const MapGeometry map = RandomMap(random, 40);
    FieldEdit edit;
    edit.shape = Shape::kStroke;
    edit.radius_um = RandomRadius(random, map);
    const PointUm centre = PointNear(random, map, 10 * map.cell_um);
    const auto ring_um = static_cast<double>(Between(random, 0, 25 * map.cell_um));
    const int64_t points = Between(random, 2, 100);
    for (int64_t p = 0; p <= points; ++p) {
      const double angle =
          2 * std::numbers::pi * static_cast<double>(p) / static_cast<double>(points);
      edit.points.push_back({centre.x + std::llround(ring_um * std::cos(angle)),
                             centre.y + std::llround(ring_um * std::sin(angle))});
    }
    Check(edit, map);
  }
}

TEST(RasterOf, RectanglesAndTheWholeMapAreThePlainDefinition) {
  Random random(5);
  for (int i = 0; i < 2'000 && !Failed(); ++i) {
    const MapGeometry map = RandomMap(random, 25);
    FieldEdit edit;
    edit.shape = OneIn(random, 10) ? Shape::kAll : Shape::kRectangle;
    edit.points = {PointNear(random, map, 8 * map.cell_um),
                   PointNear(random, map, 8 * map.cell_um)};
    if (OneIn(random, 10)) {
      edit.points[0] = {-kFarUm, Between(random, -kFarUm, kFarUm)};
      edit.points[1].x = Between(random, -kFarUm, kFarUm);
    }
    Check(edit, map);
  }
}

// A segment whose ends are as far from the map as points may be, and pass it at all angles; its
// radius reaches as far as a point near the map.
TEST(RasterOf, IsExactForPointsAndRadiiAsLargeAsTheyMayBe) {
  Random random(6);
  int64_t nodes = 0;
  int some = 0;
  for (int i = 0; i < 3'000 && !Failed(); ++i) {
    const MapGeometry map = RandomMap(random, 12);
    FieldEdit edit;
    edit.shape = Shape::kStroke;
    const int64_t far = kFarUm >> Between(random, 0, 20);
    const auto far_point = [&] {
      return PointUm{Between(random, -far, far), Between(random, -far, far)};
    };
    const PointUm near = PointNear(random, map, map.cell_um);
    edit.points.push_back(far_point());
    if (OneIn(random, 3)) {  // through a point near the map, on the other side of it
      edit.points.push_back({2 * near.x - edit.points[0].x, 2 * near.y - edit.points[0].y});
      edit.radius_um = RandomRadius(random, map);
    } else {
      if (OneIn(random, 2)) {
        edit.points.push_back(far_point());
      }
      // The radius whose border passes near the map: the distance from that point.
      long double least = std::numeric_limits<long double>::infinity();
      for (size_t p = 0; p < edit.points.size(); ++p) {
        const PointUm a = edit.points[p == 0 ? 0 : p - 1];
        const PointUm b = edit.points[p];
        const auto dx = static_cast<long double>(b.x - a.x);
        const auto dy = static_cast<long double>(b.y - a.y);
        const auto px = static_cast<long double>(near.x - a.x);
        const auto py = static_cast<long double>(near.y - a.y);
        const long double length2 = dx * dx + dy * dy;
        const long double w =
            length2 == 0 ? 0 : std::clamp((px * dx + py * dy) / length2, 0.0L, 1.0L);
        least = std::min(least, std::hypot(px - w * dx, py - w * dy));
      }
      edit.radius_um = std::min<int64_t>(kFarUm, std::llround(least));
    }
    const int64_t found = Check(edit, map);
    nodes += found;
    some += found > 0 && found < int64_t{map.columns()} * map.rows() ? 1 : 0;
  }
  EXPECT_GE(nodes, 20'000);
  EXPECT_GE(some, 800);  // neither none nor all of the map
}

TEST(RasterOf, TellsHowManyNodesAreTooMany) {
  const MapGeometry map{{0, 0}, 5'000'000, 5'000'000, 1'000};  // 5001 x 5001
  const std::string expected =
      "the edit touches 25010001 nodes, expected at most 16777216: make it in parts";
  FieldEdit edit;
  edit.shape = Shape::kAll;
  EXPECT_EQ(RasterOf(edit, map).error(), expected);
  edit.shape = Shape::kRectangle;
  edit.points = {{-1, -1}, {5'000'000, 5'000'000}};
  EXPECT_EQ(RasterOf(edit, map).error(), expected);
  edit.shape = Shape::kStroke;
  edit.radius_um = 5'000'000;
  EXPECT_EQ(RasterOf(edit, map).error(), expected);
}

// The cost is counted, not timed.
struct Width {
  const char* name;
  int64_t radius_um;
};

class Zigzag : public ::testing::TestWithParam<Width> {};

TEST_P(Zigzag, CostsTheRowsThatItsSegmentsCross) {
  const MapGeometry map{{0, 0}, 3'999 * 50'000, 3'999 * 50'000, 50'000};  // 4000 x 4000
  for (const bool is_upright : {true, false}) {
    FieldEdit edit;
    edit.shape = Shape::kStroke;
    edit.radius_um = GetParam().radius_um;
    for (int64_t p = 0; p < 1024; ++p) {
      const PointUm point{map.width_um * p / 1023, p % 2 == 0 ? 0 : map.height_um};
      edit.points.push_back(is_upright ? point : PointUm{point.y, point.x});
    }
    const Result<Raster> raster = RasterOf(edit, map);
    ASSERT_TRUE(raster.ok()) << raster.error();
    const int64_t crossed = is_upright ? 1023 * 4000 : 4000 * (3 + 2 * edit.radius_um / 195'000);
    EXPECT_LE(raster.value().steps, 8 * std::min<int64_t>(crossed, 1023 * 4000) + 8 * 4000);
    for (size_t i = 1; i < raster.value().runs.size(); ++i) {
      const NodeRun before = raster.value().runs[i - 1];
      const NodeRun run = raster.value().runs[i];
      ASSERT_TRUE(run.row > before.row || run.first > before.last + 1);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(RasterOf, Zigzag,
                         ::testing::Values(Width{"NoWidth", 0}, Width{"HalfACell", 25'000},
                                           Width{"OneMetre", 1'000'000},
                                           Width{"TenMetres", 10'000'000},
                                           Width{"AKilometre", 1'000'000'000}),
                         [](const auto& tested) { return std::string(tested.param.name); });

TEST(RasterOf, ARingOfSmallCellsCostsItsNodes) {
  const MapGeometry map{{0, 0}, 20'000'000, 20'000'000, 5'000};  // 4001 x 4001
  FieldEdit edit;
  edit.shape = Shape::kStroke;
  edit.radius_um = 20'000;
  for (int p = 0; p <= 1000; ++p) {
    const double angle = 2 * std::numbers::pi * p / 1000;
    edit.points.push_back({10'000'000 + std::llround(9e6 * std::cos(angle)),
                           10'000'000 + std::llround(9e6 * std::sin(angle))});
  }
  const Result<Raster> raster = RasterOf(edit, map);
  ASSERT_TRUE(raster.ok());
  EXPECT_GE(raster.value().node_count, 80'000);
  EXPECT_LE(raster.value().steps, raster.value().node_count * 2);
}

}  // namespace
}  // namespace pheromone::field
