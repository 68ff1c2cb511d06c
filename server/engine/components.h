// The list of a server's components.
#pragma once

#include "server/engine/component.h"
#include "server/engine/field_component.h"
#include "server/engine/robots_component.h"

namespace pheromone::engine {

/// In the order in which they advance and are saved. The robots and the field come first, at the
/// indices below; a new component is added at the end.
ComponentList StandardComponents();
inline constexpr size_t kRobotsPlace = 0;
inline constexpr size_t kFieldPlace = 1;

inline const RobotsComponent& OfRobots(const ComponentList& components) {
  return static_cast<const RobotsComponent&>(*components[kRobotsPlace]);
}
inline RobotsComponent& OfRobots(ComponentList& components) {
  return static_cast<RobotsComponent&>(*components[kRobotsPlace]);
}
inline const FieldComponent& OfField(const ComponentList& components) {
  return static_cast<const FieldComponent&>(*components[kFieldPlace]);
}
inline FieldComponent& OfField(ComponentList& components) {
  return static_cast<FieldComponent&>(*components[kFieldPlace]);
}

/// `components` and one more, for tests.
ComponentList With(ComponentList components, Polymorphic<Component> another);

}  // namespace pheromone::engine
