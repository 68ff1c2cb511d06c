// What a simulated robot does: it follows pheromones, or it cleans. The Task of
// client_fw/core/robot.h in simulations, where that is a matter of configuration, not of the image.
#pragma once

#include <cstdint>
#include <optional>

#include "client_fw/core/cleaner.h"
#include "client_fw/core/robot.h"

namespace pheromone::sim {

class SimulatedTask {
 public:
  /// Cleans if `cleaner` is given.
  SimulatedTask(const std::optional<client::CleanerParameters>& cleaner,
                const client::Parameters& parameters) {
    if (cleaner) {
      cleaner_.emplace(*cleaner, parameters.id, parameters.boot_counter);
    }
  }

  void Step(uint32_t now_ms, const client::Odometry* odometry, client::Conversation* conversation) {
    if (cleaner_) {
      cleaner_->Step(now_ms, odometry, conversation);
    }
  }
  client::WheelSpeeds Wheels(const client::Conversation& conversation) const {
    return cleaner_ ? cleaner_->Wheels(conversation) : conversation.wheels();
  }
  bool HoldsLoad() const { return cleaner_ && cleaner_->HoldsLoad(); }

  /// Null if it does not clean.
  const client::Cleaner* cleaner() const { return cleaner_ ? &*cleaner_ : nullptr; }

 private:
  std::optional<client::Cleaner> cleaner_;
};

}  // namespace pheromone::sim
