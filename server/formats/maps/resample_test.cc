#include "server/formats/maps/resample.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::maps {
namespace {

using field::FieldConfig;
using field::PheromoneLaw;

// 0.4 m x 0.3 m, two types of at most 8 quanta of 64 levels.
FieldConfig ConfigWithCells(int64_t cell_um) {
  FieldConfig config;
  config.map = {{-1'000'000, 2'000'000}, 400'000, 300'000, cell_um};
  config.memory_bytes = 1 << 20;
  PheromoneLaw trail;
  trail.type = 1;
  trail.name = "trail";
  trail.tau_ms = 30'000;
  trail.quantum_micro = 125'000;
  trail.max_count = 8;
  PheromoneLaw path = trail;
  path.type = 2;
  path.name = "path";
  path.tau_ms = 0;
  config.pheromones = {trail, path};
  return config;
}

SavedField Saved(std::string_view map, std::string_view nodes, std::string_view end) {
  const std::string text = "# pheromone-field 1\n# map " + std::string(map) +
                           "\n# type 1 quantum_micro 125000 law counter:30000ms name \"trail\"\n"
                           "# type 2 quantum_micro 125000 law permanent name \"path\"\n"
                           "# nodes type,column,row,level\n" +
                           std::string(nodes) + "# end " + std::string(end) + "\n";
  Result<SavedField> saved = ParseField(text, "test");
  EXPECT_TRUE(saved.ok()) << saved.ErrorOr("");
  return saved.ok() ? saved.value() : SavedField();
}

// At (0, 0), (0.2, 0.3) and (0.3, 0.1) m from the corner; and the path at (0.4, 0.3) m.
SavedField Small() {
  return Saved("origin_um -1000000 2000000 size_um 400000 300000 cell_um 100000",
               "1,0,0,64\n1,2,3,128\n1,3,1,512\n2,4,3,64\n", "nodes 4 levels 768");
}

TEST(Resample, FinerCellsKeepEachNodeWhereItIs) {
  const Result<Resampled> moved = Resample(Small(), ConfigWithCells(50'000));
  ASSERT_TRUE(moved.ok()) << moved.error();
  EXPECT_EQ(moved.value().field,
            Saved("origin_um -1000000 2000000 size_um 400000 300000 cell_um 50000",
                  "1,0,0,64\n1,4,6,128\n1,6,2,512\n2,8,6,64\n", "nodes 4 levels 768"));
  EXPECT_EQ(moved.value().nodes_outside, 0u);
  EXPECT_EQ(moved.value().levels_cut_off, 0u);
}

TEST(Resample, CoarserCellsAddUpWhatMeetsToTheMaximum) {
  const Result<Resampled> moved = Resample(Small(), ConfigWithCells(400'000));
  ASSERT_TRUE(moved.ok()) << moved.error();
  EXPECT_EQ(moved.value().field,
            Saved("origin_um -1000000 2000000 size_um 400000 300000 cell_um 400000",
                  "1,0,0,64\n1,1,0,512\n2,1,0,64\n", "nodes 3 levels 640"));
  EXPECT_EQ(moved.value().levels_cut_off, 128u);
}

TEST(Resample, WhatLiesOutsideIsLeftOutAndCounted) {
  FieldConfig config = ConfigWithCells(100'000);
  config.map.origin.x += 200'000;
  config.map.width_um = 100'000;
  const Result<Resampled> moved = Resample(Small(), config);
  ASSERT_TRUE(moved.ok()) << moved.error();
  EXPECT_EQ(moved.value().field,
            Saved("origin_um -800000 2000000 size_um 100000 300000 cell_um 100000",
                  "1,0,3,128\n1,1,1,512\n", "nodes 2 levels 640"));
  EXPECT_EQ(moved.value().nodes_outside, 2u);
}

TEST(Resample, ATypeThatIsMissingIsNamed) {
  FieldConfig config = ConfigWithCells(50'000);
  config.pheromones.pop_back();
  const Result<Resampled> moved = Resample(Small(), config);
  ASSERT_FALSE(moved.ok());
  EXPECT_NE(moved.error().find("path"), std::string::npos) << moved.error();
}

}  // namespace
}  // namespace pheromone::maps
