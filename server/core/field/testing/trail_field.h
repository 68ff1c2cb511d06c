// A map of 10 m x 10 m in cells of 0.1 m with one evaporating trail: what most tests of the field
// begin with. 101 x 101 nodes: 13 x 13 tiles in one leaf.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>

#include "server/core/field/field.h"

namespace pheromone::field::testing {

inline PheromoneLaw TrailLaw() {
  PheromoneLaw law;
  law.type = 1;
  law.name = "trail";
  law.core_um = 100'000;
  law.sigma_um = 400'000;
  law.tau_ms = 30'000;
  law.quantum_micro = 125'000;
  law.max_count = 8;
  return law;
}

inline FieldConfig TrailConfig() {
  FieldConfig config;
  config.map = {
      .origin = {0, 0}, .width_um = 10'000'000, .height_um = 10'000'000, .cell_um = 100'000};
  config.antennas.distance_um = 330'000;
  config.pheromones = {TrailLaw()};
  config.memory_bytes = 64 << 20;
  return config;
}

/// A field of the bytes that this one is written as; null, and a failure of the test, if it cannot
/// be.
inline std::unique_ptr<Field> Restored(const Field& field) {
  ByteWriter writer;
  field.Save(&writer);
  ByteReader reader(writer.bytes());
  auto restored = Field::Restore(std::make_shared<const FieldConfig>(field.config()), &reader);
  EXPECT_NE(restored, nullptr) << reader.error();
  return restored;
}

/// P of type 1; -1 where it cannot be sensed.
inline Intensities At(const Field& field, const PoseUm& pose, uint64_t now_ms) {
  return field.Sense(1, pose, now_ms).value_or(Intensities{-1, -1});
}

/// The memory of so many tiles and leaves of one type, which has its top table.
inline uint64_t BytesOf(const MapGeometry& map, size_t tiles, size_t leaves) {
  return tiles * CellMap::kTileBytes + leaves * CellMap::kLeafBytes +
         CellMap::TopBytes(map.columns(), map.rows());
}

}  // namespace pheromone::field::testing
