// Robots that follow a pheromone as the firmware does: its own Behaviour (client_fw/core/steering)
// decides, by the answers that there are. So this is the law of the core, whole: slowing down,
// repellents, a lost trail.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "client_fw/core/steering/settings.h"
#include "client_fw/lab/behaviour.h"

namespace pheromone::lab {

/// Follows slot 0 and deposits `quanta` of the group's pheromone in each step. Of `settings`, what
/// is not about steering has no effect.
std::shared_ptr<Behaviour> MakeFollow(const client::Settings& settings, uint16_t quanta,
                                      size_t robots);

}  // namespace pheromone::lab
