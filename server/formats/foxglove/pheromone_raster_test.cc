// The picture that viewers get equals the field's levels, however it changed, within what a byte
// can hold.

#include "server/formats/foxglove/pheromone_raster.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "server/formats/foxglove/testing/tiles_viewer.h"

namespace pheromone::web {
namespace {

using testing::TilesViewer;

field::FieldConfig ConfigOf(int32_t columns, int32_t rows) {
  field::FieldConfig config;
  config.map = {.origin = {-1'000'000, 500'000},
                .width_um = (columns - 1) * int64_t{50'000},
                .height_um = (rows - 1) * int64_t{50'000},
                .cell_um = 50'000};
  config.antennas.distance_um = 300'000;
  field::PheromoneLaw law;
  law.type = 1;
  law.name = "counter";
  law.core_um = 100'000;
  law.sigma_um = 400'000;
  law.tau_ms = 4'000;
  law.quantum_micro = 250'000;
  law.max_count = 40;
  config.pheromones.push_back(law);
  law.type = 2;
  law.name = "exponential";
  law.evaporation = field::Evaporation::kExponential;
  config.pheromones.push_back(law);
  law.type = 3;
  law.name = "diffusing";
  law.diffusion = {
      .exchange_q16 = 3000, .step_ms = 100, .keep_q32 = 4'200'000'000, .cutoff_q16 = 64};
  config.pheromones.push_back(law);
  field::ObstacleMask wall(config.map.columns(), config.map.rows());
  for (int32_t row = 10; row < rows / 2; ++row) {
    wall.BlockRow(row, columns / 3, columns / 3 + 1);
  }
  config.obstacles = field::Shared<field::ObstacleMask>(std::move(wall));
  config.memory_bytes = 64 << 20;
  return config;
}

// What the picture should be, node by node.
std::vector<uint8_t> NaivePicture(const field::Field& field, uint8_t type, uint64_t now_ms,
                                  const TilesViewer& viewer, double* peak) {
  const field::FieldConfig& config = field.config();
  const int32_t nodes = static_cast<int32_t>(viewer.cell_um / config.map.cell_um);
  const double unit = static_cast<double>(config.FindLaw(type)->quantum_micro) / 64e6;
  std::vector<uint32_t> levels(viewer.bytes.size());
  std::vector<bool> blocked(viewer.bytes.size());
  for (int32_t row = 0; row < config.map.rows(); ++row) {
    for (int32_t column = 0; column < config.map.columns(); ++column) {
      const size_t cell =
          static_cast<size_t>(row / nodes) * viewer.columns + static_cast<size_t>(column / nodes);
      if (config.obstacles->Blocked({column, row})) {
        blocked[cell] = true;
      } else {
        levels[cell] = std::max(levels[cell], field.LevelOf(type, {column, row}, now_ms));
      }
    }
  }
  std::vector<uint8_t> bytes(levels.size());
  *peak = 0;
  for (size_t i = 0; i < levels.size(); ++i) {
    const double value = levels[i] * unit;
    *peak = std::max(*peak, value);
    bytes[i] =
        levels[i] == 0
            ? (blocked[i] ? 255 : 0)
            : static_cast<uint8_t>(std::max(1.0, std::round(value / double{viewer.scale} * 254)));
  }
  return bytes;
}

// Bytes may differ by one where a rounding is at a tie, since the scale in a message is a float.
void ExpectSame(const std::vector<uint8_t>& found, const std::vector<uint8_t>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  size_t wrong = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const bool is_special = expected[i] == 0 || expected[i] == 255 || found[i] == 0;
    const int difference = std::abs(int{found[i]} - int{expected[i]});
    wrong += difference > (is_special ? 0 : 1) ? 1 : 0;
  }
  EXPECT_EQ(wrong, 0u);
}

// Paints, deposits, erases and lets time pass; two viewers follow, one of which skips messages.
void FollowRandomChanges(int32_t columns, int32_t rows, uint8_t type, int steps) {
  SCOPED_TRACE(::testing::Message() << columns << " x " << rows << ", type " << int{type});
  std::mt19937 random(static_cast<uint32_t>(columns * 100 + type));
  const field::FieldConfig config = ConfigOf(columns, rows);
  field::Field field(config);
  const field::FieldReader reader(field);
  ASSERT_TRUE(reader.ok());
  PheromoneRaster raster(config, type, 7);
  const auto pick = [&](int64_t least, int64_t most) {
    return std::uniform_int_distribution<int64_t>(least, most)(random);
  };
  const auto place = [&] {
    return field::PointUm{config.map.origin.x + pick(0, config.map.width_um),
                          config.map.origin.y + pick(0, config.map.height_um)};
  };
  struct Follower {
    TilesViewer picture;
    uint64_t since = 0;
  };
  Follower each;
  Follower some;
  uint64_t now_ms = 1000;
  for (int step = 0; step < steps; ++step) {
    for (int i = 0; i < 5; ++i) {
      field.Deposit(type, place(), static_cast<uint16_t>(pick(1, 3)), now_ms);
    }
    if (step % 4 == 1) {
      field::FieldEdit edit;
      edit.type = type;
      edit.shape = field::FieldEdit::Shape::kStroke;
      edit.action =
          pick(0, 3) == 0 ? field::FieldEdit::Action::kErase : field::FieldEdit::Action::kSet;
      edit.level = edit.action == field::FieldEdit::Action::kSet
                       ? static_cast<uint32_t>(pick(1, 40 * 64))
                       : 0;
      edit.points = {place(), place()};
      edit.radius_um = pick(0, 300'000);
      ASSERT_TRUE(field.Edit(edit, now_ms).ok());
    }
    if (step == steps / 2) {
      field::FieldEdit all;
      all.type = type;
      all.shape = field::FieldEdit::Shape::kAll;
      all.action = field::FieldEdit::Action::kErase;
      ASSERT_TRUE(field.Edit(all, now_ms).ok());
    }
    now_ms += static_cast<uint64_t>(pick(1, 1500));
    field.Advance(now_ms);
    raster.Update(reader, now_ms, true);
    for (Follower* follower : {&each, &some}) {
      if (follower == &some && step % 3 != 2 && step != steps - 1) {
        continue;
      }
      ASSERT_TRUE(follower->picture.Take(raster.Encode(follower->since)));
      follower->since = raster.version();
      double peak = 0;
      ExpectSame(follower->picture.bytes,
                 NaivePicture(field, type, now_ms, follower->picture, &peak));
      EXPECT_LE(peak, double{follower->picture.scale} * 1.000001);
      EXPECT_EQ(follower->picture.field_time_ms, now_ms);
    }
    if (::testing::Test::HasFailure()) {
      return;
    }
  }
}

TEST(PheromoneRasterTest, EqualsTheLevelsOfASmallMapWhateverHappens) {
  for (const uint8_t type : {uint8_t{1}, uint8_t{2}, uint8_t{3}}) {
    FollowRandomChanges(101, 70, type, 60);
  }
}

TEST(PheromoneRasterTest, EqualsTheHighestLevelsOfALargeMap) {
  FollowRandomChanges(1100, 300, 1, 12);  // cells of 3 x 3 nodes
  FollowRandomChanges(3100, 200, 1, 5);   // of 7 x 7: each tile is read in several pieces
}

TEST(PheromoneRasterTest, LetsItsThreadPauseBetweenPiecesOfATile) {
  const field::FieldConfig config = ConfigOf(3100, 200);
  field::Field field(config);
  const field::FieldReader reader(field);
  PheromoneRaster raster(config, 1);
  int calls = 0;
  raster.Update(reader, 1000, true, [&calls] { ++calls; });
  EXPECT_GE(calls, 14 * 3);  // 443 x 29 cells: 14 tiles, each of 29 * 32 * 49 nodes
  calls = 0;
  raster.Update(reader, 1100, true, [&calls] { ++calls; });
  EXPECT_EQ(calls, 0);  // nothing to do
}

TEST(PheromoneRasterTest, PutsItsCellsWhereTheNodesAre) {
  const field::FieldConfig config = ConfigOf(1100, 300);
  TilesViewer viewer;
  ASSERT_TRUE(viewer.Take(PheromoneRaster(config, 1).Encode(0)));
  EXPECT_EQ(viewer.columns, 367);  // 1100 nodes, three a cell
  EXPECT_EQ(viewer.rows, 100);
  EXPECT_EQ(viewer.cell_um, 150'000u);
  EXPECT_EQ(viewer.x_um, -1'000'000 + 50'000);  // the middle one of three
  EXPECT_EQ(viewer.y_um, 500'000 + 50'000);
  const PheromoneRaster raster(config, 1);
  EXPECT_EQ(raster.twice_corner_um(), (field::PointUm{2 * -1'025'000, 2 * 475'000}));
}

TEST(PheromoneRasterTest, SendsOnlyTilesThatChanged) {
  const field::FieldConfig config = ConfigOf(101, 70);
  field::Field field(config);
  const field::FieldReader reader(field);
  PheromoneRaster raster(config, 1);
  TilesViewer viewer;
  ASSERT_TRUE(raster.Update(reader, 1000, true));
  ASSERT_TRUE(viewer.Take(raster.Encode(0)));
  EXPECT_TRUE(viewer.full);
  const uint64_t version = raster.version();
  EXPECT_FALSE(raster.Update(reader, 1100, true));
  EXPECT_EQ(raster.version(), version);
  field.Deposit(1, {-1'000'000, 500'000}, 1, 1200);
  ASSERT_TRUE(raster.Update(reader, 1200, false));
  ASSERT_TRUE(viewer.Take(raster.Encode(version)));
  EXPECT_FALSE(viewer.full);
  EXPECT_EQ(viewer.tiles, 1);
  EXPECT_NE(viewer.bytes[0], 0);
}

TEST(PheromoneRasterTest, ReadsWhatOnlyEvaporatesWhenItIsTold) {
  const field::FieldConfig config = ConfigOf(101, 70);
  field::Field field(config);
  const field::FieldReader reader(field);
  PheromoneRaster raster(config, 1);
  field.Deposit(1, {-1'000'000, 500'000}, 1, 1000);
  raster.Update(reader, 1000, true);
  EXPECT_FALSE(raster.Update(reader, 9000, false));
  EXPECT_TRUE(raster.Update(reader, 9000, true));
  EXPECT_EQ(raster.bytes()[0], '\0');
}

TEST(PheromoneRasterTest, ChangesTheScaleReluctantly) {
  EXPECT_DOUBLE_EQ(RoundScale(0.2), 0.2);
  EXPECT_DOUBLE_EQ(RoundScale(0.21), 0.5);
  EXPECT_DOUBLE_EQ(RoundScale(1), 1);
  EXPECT_DOUBLE_EQ(RoundScale(7), 10);
  const field::FieldConfig config = ConfigOf(101, 70);
  field::Field field(config);
  const field::FieldReader reader(field);
  PheromoneRaster raster(config, 1);
  const field::PointUm here{-1'000'000, 500'000};
  const auto set = [&](double units, uint64_t now_ms) {
    field::FieldEdit edit;
    edit.type = 1;
    edit.shape = field::FieldEdit::Shape::kStroke;
    edit.action = field::FieldEdit::Action::kSet;
    edit.level = static_cast<uint32_t>(units / 0.25 * 64);
    edit.points = {here};
    ASSERT_TRUE(field.Edit(edit, now_ms).ok());
    raster.Update(reader, now_ms, true);
  };
  set(5, 1000);
  EXPECT_DOUBLE_EQ(raster.scale(), 5);
  set(1.9, 1100);  // not well below 2
  EXPECT_DOUBLE_EQ(raster.scale(), 5);
  set(1.5, 1200);
  EXPECT_DOUBLE_EQ(raster.scale(), 2);
  set(2.25, 1300);
  EXPECT_DOUBLE_EQ(raster.scale(), 5);
}

}  // namespace
}  // namespace pheromone::web
