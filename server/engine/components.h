// The list of a server's components.
#pragma once

#include "server/engine/component.h"
#include "server/engine/field_component.h"
#include "server/engine/nets_component.h"
#include "server/engine/robots_component.h"
#include "server/engine/tags_component.h"

namespace pheromone::engine {

/// In the order in which they advance and are saved. The robots and the field come first, at the
/// indices below; a new component is added at the end, unless another one has to wait for it: nets
/// read what robots have left on tags before the tags end leases.
ComponentList StandardComponents();
inline constexpr size_t kRobotsIndex = 0;
inline constexpr size_t kFieldIndex = 1;

inline const RobotsComponent& RobotsIn(const ComponentList& components) {
  return static_cast<const RobotsComponent&>(*components[kRobotsIndex]);
}
inline RobotsComponent& RobotsIn(ComponentList& components) {
  return static_cast<RobotsComponent&>(*components[kRobotsIndex]);
}
inline const FieldComponent& FieldIn(const ComponentList& components) {
  return static_cast<const FieldComponent&>(*components[kFieldIndex]);
}
inline FieldComponent& FieldIn(ComponentList& components) {
  return static_cast<FieldComponent&>(*components[kFieldIndex]);
}

}  // namespace pheromone::engine
