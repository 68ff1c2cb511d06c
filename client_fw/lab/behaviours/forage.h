// Ants that look for food and carry it to their nest.
//
// Searching, a robot follows slot 0, the trail that robots with loads leave, away from the nest, by
// the differential law of the core (steering.h); without a trail it wanders. At food it picks up a
// load, leaves a trail of its group's pheromone on its way home, and drops it at the nest.
//
// Two antennas see across a trail, not along it, so a robot needs to know where home is:
//   bearing     it knows where the nest is (odometry, a compass, a beacon): straight home
//   pheromone   it follows slot 1, of which searching robots leave the less, the longer they are
//               away from a nest, and wanders where there is none; it finds home somewhat more
//               often than by wandering alone
#pragma once

#include <cstdint>
#include <memory>

#include "client_fw/lab/behaviour.h"

namespace pheromone::lab {

enum class Homing : uint8_t { kBearing, kPheromone };

struct ForageSettings {
  double speed_m_s = 0.2;
  double wander_rad = 0.35;
  uint16_t quanta = 1;     ///< of the trail in each step; 0: none
  double faintest = 0.01;  ///< pheromone units; less is no trail
  Homing homing = Homing::kBearing;
  double fade_s = 60;    ///< for so long after a nest, a searching robot leaves slot 1
  double ignore_s = 20;  ///< at food that is gone: no trail is followed for so long
};

std::shared_ptr<Behaviour> MakeForage(const ForageSettings& settings);

}  // namespace pheromone::lab
