#include "server/engine/config_hash.h"

#include <initializer_list>

#include "server/base/hash.h"

namespace pheromone::engine {
namespace {

uint64_t U(int64_t value) {
  return static_cast<uint64_t>(value);
}

uint64_t U(const std::string& text) {
  return HashText(text);
}

// Lists begin with their length, so that nothing can move from one to the next unseen.
template <typename List, typename HashOne>
uint64_t HashList(const List& list, HashOne&& hash_one) {
  uint64_t hash = HashStep(0, list.size());
  for (const auto& one : list) {
    hash = HashStep(hash, hash_one(one));
  }
  return hash;
}

uint64_t HashLaw(const field::PheromoneLaw& law) {
  const uint64_t blend = HashList(law.blend, [](const field::BlendPart& part) {
    return Hash64({part.type, U(part.weight_milli)});
  });
  const field::DiffusionLaw& diffusion = law.diffusion;
  return Hash64({law.type, U(law.name), U(static_cast<int64_t>(law.profile)), U(law.core_um),
                 U(law.sigma_um), U(law.cutoff_um), U(static_cast<int64_t>(law.evaporation)),
                 U(law.tau_ms), U(law.quantum_micro), law.max_count, law.directional ? 1u : 0u,
                 U(law.weight_milli), diffusion.exchange_q16, diffusion.step_ms, diffusion.keep_q32,
                 diffusion.cutoff_q16, blend});
}

uint64_t HashPath(const field::Path& path) {
  return Hash64({path.type, path.count, path.closed ? 1u : 0u,
                 HashList(path.points, [](field::PointUm point) {
                   return Hash64({U(point.x), U(point.y)});
                 })});
}

uint64_t HashPrint(const field::Print& print) {
  const uint64_t nodes =
      print.nodes ? HashList(*print.nodes,
                             [](const field::PrintNode& it) {
                               return Hash64({U(it.node.column), U(it.node.row), it.level});
                             })
                  : 0;
  return Hash64({print.type, nodes});
}

uint64_t HashField(const field::FieldConfig& config) {
  const field::MapGeometry& map = config.map;
  const field::AntennaGeometry& antennas = config.antennas;
  const field::ObstacleMask* obstacles = config.obstacles ? &*config.obstacles : nullptr;
  return Hash64({U(map.origin.x), U(map.origin.y), U(map.width_um), U(map.height_um),
                 U(map.cell_um), U(antennas.distance_um), U(antennas.forward_um), antennas.angle,
                 HashList(config.pheromones, HashLaw), HashList(config.paths, HashPath),
                 HashList(config.prints, HashPrint),
                 obstacles == nullptr ? 0
                                      : Hash64({1, U(obstacles->columns()), U(obstacles->rows()),
                                                obstacles->Hash()}),
                 config.memory_bytes});
}

}  // namespace

uint64_t HashConfig(const EngineConfig& config) {
  const uint64_t links = HashList(config.links, [](const LinkSettings& link) {
    return Hash64({U(link.name), link.slot_ms, link.response_window_ms});
  });
  const uint64_t frames = HashList(config.frames, [](const RobotFrame& frame) {
    return Hash64({U(frame.link), frame.id, U(frame.x_um), U(frame.y_um), frame.heading,
                   U(frame.cos_q30), U(frame.sin_q30)});
  });
  return Hash64(
      {'C', HashField(config.field), config.pose_unit_10um, config.robots_per_link, links, frames});
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
