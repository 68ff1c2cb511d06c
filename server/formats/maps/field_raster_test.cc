#include "server/formats/maps/field_raster.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include "server/core/field/testing/random_field.h"
#include "server/formats/maps/csv_grid.h"
#include "server/formats/maps/ros_map.h"

namespace pheromone::maps {
namespace {

using field::Field;
using field::FieldConfig;
using field::NodeIndex;
using field::testing::Between;
using field::testing::Random;

FieldConfig RandomConfigWithWalls(Random& random) {
  FieldConfig config = field::testing::RandomConfig(random, {1, 2}, field::testing::Laws::kRounded);
  field::ObstacleMask mask(config.map.columns(), config.map.rows());
  mask.BlockRow(static_cast<int32_t>(Between(random, 0, 12)), 0, 7);
  for (int i = 0; i < 30; ++i) {
    mask.Set({static_cast<int32_t>(Between(random, 0, 40)),
              static_cast<int32_t>(Between(random, 0, 40))});
  }
  config.obstacles = field::Shared<field::ObstacleMask>(std::move(mask));
  return config;
}

// What the header says a cell is, worked out node by node.
double NaiveCell(const Field& field, uint64_t now_ms, NodeIndex first, int32_t side,
                 NodeIndex last) {
  double strongest = 0;
  bool blocked = false;
  for (int32_t row = first.row; row < first.row + side && row <= last.row; ++row) {
    for (int32_t column = first.column; column < first.column + side && column <= last.column;
         ++column) {
      const field::PheromoneLaw& law = *field.FindLaw(1);
      const double units = field.LevelOf(1, {column, row}, now_ms) / 64.0 *
                           static_cast<double>(law.quantum_micro) / 1e6;
      if (field.config().obstacles->Blocked({column, row})) {
        blocked = true;
      } else {
        strongest = std::max(strongest, units);
      }
    }
  }
  return strongest == 0 && blocked ? std::nan("") : strongest;
}

TEST(FieldRasterTest, EachCellIsTheStrongestOfItsNodesInUnits) {
  int unknown = 0;
  int something = 0;
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const FieldConfig config = RandomConfigWithWalls(random);
    Field field(config);
    for (uint64_t i = 0; i < 150; ++i) {
      field.Deposit(1, field::testing::RandomPoint(random, config.map), 3, 10 * i);
    }
    RasterExtent extent;
    extent.nodes_per_cell = static_cast<int32_t>(Between(random, 1, 5));
    NodeArea area{{0, 0}, {config.map.columns() - 1, config.map.rows() - 1}};
    if (seed % 2 == 0) {
      area = {{2, 3}, {static_cast<int32_t>(Between(random, 2, area.last.column)), 10}};
      extent.area = area;
    }
    const Result<Raster> made = RasterOf(field, 1, 1700, extent);
    ASSERT_TRUE(made.ok()) << made.error();
    const Raster& raster = made.value();
    const field::FieldReader reader(field);
    const Result<Raster> beside = RasterOf(reader, config, 1, 1700, extent);
    ASSERT_TRUE(beside.ok()) << beside.error();
    EXPECT_EQ(EncodeCsvGrid(beside.value()), EncodeCsvGrid(raster));
    const int32_t side = extent.nodes_per_cell;
    ASSERT_EQ(raster.columns, (area.last.column - area.first.column + side) / side);
    ASSERT_EQ(raster.rows, (area.last.row - area.first.row + side) / side);
    for (int32_t row = 0; row < raster.rows; ++row) {
      for (int32_t column = 0; column < raster.columns; ++column) {
        const NodeIndex first{area.first.column + column * side, area.first.row + row * side};
        const double expected = NaiveCell(field, 1700, first, side, area.last);
        const double found = raster.At(column, row);
        unknown += std::isnan(expected) ? 1 : 0;
        something += expected > 0 ? 1 : 0;
        EXPECT_TRUE(std::isnan(expected) ? std::isnan(found) : std::abs(found - expected) < 1e-12)
            << found << " instead of " << expected << " at " << column << ", " << row;
      }
    }
  }
  EXPECT_GT(unknown, 100);
  EXPECT_GT(something, 1000);
}

TEST(FieldRasterTest, ItsCellsLieAroundTheirNodes) {
  FieldConfig config;
  config.map = {{1'000'000, -500'000}, 1'000'000, 600'000, 100'000};
  config.memory_bytes = 1 << 20;
  config.pheromones.emplace_back();
  config.pheromones[0].max_count = 9;
  config.pheromones[0].quantum_micro = 500'000;
  Field field(config);
  field.Deposit(1, {1'300'000, -300'000}, 3, 0);
  for (const int32_t side : {1, 3}) {
    const Raster raster = RasterOf(field, 1, 0, {.area = {}, .nodes_per_cell = side}).value();
    EXPECT_EQ(raster.cell_um, side * 100'000);
    EXPECT_EQ(ValueAt(raster, {1'300'000, -300'000}), 1.5);
    EXPECT_EQ(ValueAt(raster, {1'250'000, -350'000}), 1.5);
    EXPECT_EQ(ValueAt(raster, {1'249'999, -300'000}), 0);
    EXPECT_EQ(ValueAt(raster, {949'999, -300'000}), std::nullopt);
    EXPECT_EQ(ValueAt(raster, {950'000, -550'000}), 0);
  }
}

TEST(FieldRasterTest, AnAreaIsTheNodesBetweenItsCorners) {
  const field::MapGeometry map{{1'000'000, -500'000}, 1'000'000, 600'000, 100'000};
  const auto area = NodesBetween(map, {1'500'000, 99'999}, {1'100'001, -300'000});
  ASSERT_TRUE(area.has_value());
  EXPECT_EQ(area->first, (NodeIndex{2, 2}));
  EXPECT_EQ(area->last, (NodeIndex{5, 5}));
  const auto all = NodesBetween(map, {-9'000'000, -9'000'000}, {9'000'000, 9'000'000});
  ASSERT_TRUE(all.has_value());
  EXPECT_EQ(all->first, (NodeIndex{0, 0}));
  EXPECT_EQ(all->last, (NodeIndex{10, 6}));
  EXPECT_FALSE(NodesBetween(map, {1'010'000, 0}, {1'090'000, 0}).has_value());
  EXPECT_FALSE(NodesBetween(map, {0, 0}, {999'999, 0}).has_value());
  EXPECT_FALSE(NodesBetween(map, {2'000'001, 0}, {3'000'000, 0}).has_value());
}

TEST(FieldRasterTest, ObstaclesReadAgainBlockTheSameNodes) {
  Random random(3);
  FieldConfig config = RandomConfigWithWalls(random);
  config.map.cell_um += config.map.cell_um % 2;
  const field::ObstacleMask& mask = *config.obstacles;
  const Result<Raster> occupancy = ObstaclesOf(config);
  ASSERT_TRUE(occupancy.ok()) << occupancy.error();
  field::ObstacleMask again(mask.columns(), mask.rows());
  ASSERT_TRUE(ForEachBlockedRun(occupancy.value(), config.map, {},
                                [&](int32_t row, int32_t first, int32_t last) {
                                  again.BlockRow(row, first, last);
                                })
                  .ok());
  EXPECT_GT(again.count(), 20u);
  EXPECT_EQ(again, mask);
}

TEST(FieldRasterTest, WhatCannotBeDrawnIsRefusedWithWords) {
  FieldConfig config;
  config.map = {{0, 0}, 40'000'000, 40'000'000, 1'000};
  config.memory_bytes = 1 << 30;
  config.pheromones.resize(2);
  config.pheromones[1].type = 2;
  config.pheromones[1].blend = {{1, 1000}};
  const Field field(config);
  EXPECT_EQ(RasterOf(field, 9, 0).error(), "pheromone type 9 is not configured");
  EXPECT_EQ(RasterOf(field, 2, 0).error(),
            "pheromone type 2 is a blend, which has no content of its own");
  EXPECT_NE(RasterOf(field, 1, 0).error().find("found 40001 columns and 40001 rows, expected"),
            std::string::npos);
  EXPECT_EQ(RasterOf(field, 1, 0, {.area = {}, .nodes_per_cell = 40}).value().columns, 1001);
  EXPECT_FALSE(RasterOf(field, 1, 0, {.area = {}, .nodes_per_cell = 0}).ok());
  EXPECT_FALSE(RasterOf(field, 1, 0, {.area = NodeArea{{0, 0}, {40'001, 0}}}).ok());
  EXPECT_FALSE(ObstaclesOf(config, {.area = NodeArea{{5, 0}, {4, 0}}}).ok());
}

}  // namespace
}  // namespace pheromone::maps
