#include "client_fw/verify/cleaning_starts.h"

namespace pheromone::verify {

void StartStates::Each(const std::function<bool(const CleaningState&)>& visit) const {
  if (starts_->empty()) {
    world_->EachStart([&](const std::vector<uint8_t>& start) { return visit(StateOf(start)); });
    return;
  }
  for (const std::vector<uint8_t>& start : *starts_) {
    if (!visit(StateOf(start))) {
      return;
    }
  }
}

CleaningState StartStates::StateOf(const std::vector<uint8_t>& start) const {
  CleaningState state = world_->Start(start);
  if (soil_percent_) {
    state.tick = static_cast<uint8_t>(world_->limits().soiling_step);
    for (size_t zone = 0; zone < world_->zones(); ++zone) {
      state.level[zone] = static_cast<uint8_t>(world_->IsClosed(zone) ? 0 : *soil_percent_);
    }
  }
  return state;
}

}  // namespace pheromone::verify
