// What a behaviour of the swarm lab sees and does, as C structs: for behaviours that are built in,
// for plug-ins that are compiled elsewhere (plugin.h), and for other languages.
//
//   #include "client_fw/lab/behaviour_abi.h"
//   int pheromone_behaviour_v1(const struct PheromoneView* view,
//                              const struct PheromoneActions* actions, size_t first,
//                              size_t count) {
//     for (size_t i = first; i < first + count; ++i) {
//       actions->left_m_s[i] = actions->right_m_s[i] = 0.2;
//     }
//     return 0;
//   }
//
// An array has an element for each robot of the world, and robot i is element i of all of them; a
// call is for the robots `first` to `first + count - 1`, which are of one group. Arrays stay where
// they are as long as the world lives.
//
// Several threads call at once, for different robots. A behaviour reads and writes its own robots'
// elements only, keeps what it remembers in `memory`, and takes chance from PheromoneUniform: then
// a run has the same results for any number of threads.
//
// Units: metres, radians counter-clockwise from +x, m/s, milliseconds; intensities in 1/4096 of a
// pheromone unit, as robots receive them. C99 and C++; nothing is allocated or owned here.
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum {
  kPheromoneSlots = 4,   ///< of pheromones that a robot senses
  kPheromoneMemory = 8,  ///< numbers that a robot can remember
};

enum PheromoneContact {
  kPheromoneNoContact = 0,
  kPheromoneRobotContact = 1,  ///< another robot was in its way
  kPheromoneWallContact = 2,   ///< an obstacle, or the edge of the map
};

struct PheromoneSite {
  double x_m;
  double y_m;
  double radius_m;
  double amount;    ///< loads that are left at food; loads that were delivered to a nest
  double quality;   ///< as configured
  uint8_t is_food;  ///< 1: loads can be picked up here; 0: a nest, they are delivered here
};

struct PheromoneParameter {
  const char* name;
  double value;
};

struct PheromoneView {
  size_t bytes;  ///< sizeof(struct PheromoneView) of the lab, which may have more at its end
  uint64_t seed;
  uint64_t step;     ///< counted from 0
  uint64_t time_ms;  ///< of this step
  double step_s;

  size_t robots;       ///< in the world
  size_t group_first;  ///< the first robot of this group
  size_t group_count;
  double wheelbase_m;
  double max_speed_m_s;  ///< of a wheel

  /// Where the robot believes to be, and the heading with which it sensed, 65 536 a turn.
  const double* x_m;
  const double* y_m;
  const double* heading_rad;
  const uint16_t* heading;
  /// The present speeds of its wheels.
  const double* left_m_s;
  const double* right_m_s;
  /// P_L and P_R of each pheromone that its group senses; 0 of those it did not ask for.
  const int16_t* p_left[kPheromoneSlots];
  const int16_t* p_right[kPheromoneSlots];
  uint8_t types[kPheromoneSlots];  ///< which pheromones these are
  size_t slots;                    ///< how many of them
  const uint8_t* on_map;           ///< 0: not answered yet, or that its pose is off the map
  const uint8_t* contact;          ///< a PheromoneContact, of its last move
  const uint8_t* site;             ///< where it is: 1 is sites[0]; 0: at no site
  const uint8_t* load;             ///< what it carries: 1: a load of sites[0]; 0: nothing
  const struct PheromoneSite* sites;
  size_t site_count;

  const struct PheromoneParameter* parameters;  ///< of a plug-in only, in the order of their names
  size_t parameter_count;

  const uint8_t* answered;  ///< 0: nothing has come in this step; what it sensed is from before
};

/// Before each call they are: stand still, deposit nothing, keep the load, sense everything.
struct PheromoneActions {
  double* left_m_s;   ///< of the wheels, at most max_speed_m_s forwards or backwards
  double* right_m_s;  ///< (their acceleration is limited)
  uint16_t* quanta;   ///< to be deposited at the pose of its last request; dropped unless that was
                      ///< made in this step, as it is in each one with an ideal radio; 0: nothing
  uint8_t* type;      ///< of this pheromone; at first the one that its group deposits
  int8_t* load;       ///< 1: pick up a load, at food; -1: drop it, at a nest to deliver it
  uint8_t* sense;     ///< what is sensed in the next step: bit s is slot s
  double* memory;     ///< kPheromoneMemory numbers a robot, at first 0; they are kept
};

#ifdef __cplusplus
extern "C" {
#endif

/// What a plug-in defines. Not 0: a failure, which ends the run; the number is told.
int pheromone_behaviour_v1(const struct PheromoneView* view, const struct PheromoneActions* actions,
                           size_t first, size_t count);

#ifdef __cplusplus
}
#endif

/// A step of the hash below, as in server/base/hash.h.
static inline uint64_t PheromoneHashStep(uint64_t hash, uint64_t word) {
  uint64_t z = hash + word + 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

/// Chance as a hash of what it is for: the same whoever asks and how often. `use` tells apart what
/// one robot draws in one step; a behaviour's own are below 1000.
static inline uint64_t PheromoneHash(uint64_t seed, uint64_t robot, uint64_t step, uint64_t use) {
  const uint64_t of_robot = PheromoneHashStep(PheromoneHashStep(0, seed), robot);
  return PheromoneHashStep(PheromoneHashStep(of_robot, step), use);
}

/// The same as a number from 0 up to, but not including, 1, in steps of 2^-52.
static inline double PheromoneUniform(uint64_t seed, uint64_t robot, uint64_t step, uint64_t use) {
  const uint64_t bits = 0x3FF0000000000000u | (PheromoneHash(seed, robot, step, use) >> 12);
  double from_one = 0;
  memcpy(&from_one, &bits, sizeof from_one);
  return from_one - 1;
}
