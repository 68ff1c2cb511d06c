// What a simulated robot does: it follows pheromones, or it cleans, or it carries a net from tag to
// tag. The Task of client_fw/core/robot.h in simulations, where that is a matter of configuration,
// not of the image.
#pragma once

#include <cstdint>
#include <optional>

#include "client_fw/core/base/moment.h"
#include "client_fw/core/robot.h"
#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/core/tasks/forager.h"
#include "client_fw/core/tasks/robot_net.h"

namespace pheromone::sim {

/// At most one of them.
struct SimulatedTaskConfig {
  std::optional<client::CleanerParameters> cleaner = {};
  /// With the net kRobotNet. Its client's parameters are those of PrepareForForaging.
  std::optional<client::NetRobotParameters> forager = {};
};

class SimulatedTask {
 public:
  /// `memory` is that of a forager, and outlives it.
  SimulatedTask(const SimulatedTaskConfig& config, const client::Parameters& parameters,
                client::NetMemory* memory) {
    if (config.cleaner) {
      cleaner_.emplace(*config.cleaner, parameters.id, parameters.boot_counter);
    } else if (config.forager) {
      forager_.emplace(client::kRobotNet, *config.forager, parameters.id, parameters.boot_counter,
                       memory);
    }
  }

  void Step(client::Moment now_ms, const client::Odometry* odometry,
            client::Conversation* conversation) {
    if (cleaner_) {
      cleaner_->Step(now_ms, odometry, conversation);
    } else if (forager_) {
      forager_->Step(now_ms, odometry, conversation);
    }
  }
  client::WheelSpeeds Wheels(const client::Conversation& conversation) const {
    return cleaner_   ? cleaner_->Wheels(conversation)
           : forager_ ? forager_->Wheels(conversation)
                      : conversation.state().wheels;
  }
  bool HoldsLoad() const {
    return (cleaner_ && cleaner_->HoldsLoad()) || (forager_ && forager_->HoldsLoad());
  }

  /// Null if it does not clean.
  const client::Cleaner* cleaner() const { return cleaner_ ? &*cleaner_ : nullptr; }
  /// Null if it does not carry a net.
  const client::Forager* forager() const { return forager_ ? &*forager_ : nullptr; }

 private:
  std::optional<client::Cleaner> cleaner_;
  std::optional<client::Forager> forager_;
};

}  // namespace pheromone::sim
