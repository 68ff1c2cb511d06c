#include "server/engine/components.h"

#include <memory>

namespace pheromone::engine {

ComponentList StandardComponents() {
  ComponentList components;
  components.emplace_back(std::make_unique<RobotsComponent>());
  components.emplace_back(std::make_unique<FieldComponent>());
  components.emplace_back(std::make_unique<NetsComponent>());
  components.emplace_back(std::make_unique<TagsComponent>());
  return components;
}

}  // namespace pheromone::engine
