#include "server/core/engine/config_hash.h"

#include "server/base/hash.h"

namespace pheromone::engine {

uint64_t HashConfig(const EngineConfig& config) {
  return fields::HashInto(HashStep(0, 'C'), config);
}

uint16_t TypeMaskOf(const field::FieldConfig& config) {
  uint16_t mask = 0;
  for (const field::PheromoneLaw& law : config.pheromones) {
    mask = static_cast<uint16_t>(mask | (1u << law.type));
  }
  return mask;
}

bool SameHello(const EngineConfig& a, const EngineConfig& b) {
  return a.pose_unit_10um == b.pose_unit_10um &&
         a.field.antennas.distance_um == b.field.antennas.distance_um &&
         TypeMaskOf(a.field) == TypeMaskOf(b.field) && a.links == b.links;
}

}  // namespace pheromone::engine
