// The built-in behaviours by name, with their parameters: one table for the scenario file and its
// messages. What they mean is in README.md.
//
//   const BehaviourKind& kind = BehaviourKinds()[0];
//   ParameterValues values = DefaultsOf(kind);
//   values["speed_m_per_s"] = 0.1;
//   group.behaviour = kind.make(values, group.starts.size());
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client_fw/core/steering/settings.h"
#include "client_fw/lab/behaviour.h"

namespace pheromone::lab {

/// Of a choice: the place of the word that was chosen.
using ParameterValues = std::map<std::string, double, std::less<>>;

struct ParameterSpec {
  std::string_view name;
  double least = 0;
  double most = 0;
  double fallback = 0;
  bool whole = false;                        ///< a whole number
  std::vector<std::string_view> words = {};  ///< a choice of these instead of a number
};

struct BehaviourKind {
  std::string_view name;
  size_t least_senses = 0;  ///< so many pheromones its group has to sense
  std::vector<ParameterSpec> parameters;
  /// Requires a value within its range for each parameter.
  std::shared_ptr<Behaviour> (*make)(const ParameterValues& values, size_t robots);
};

std::span<const BehaviourKind> BehaviourKinds();

/// How a robot is set that follows with these parameters, `lay_trail` if it deposits.
client::Settings FollowSettings(const ParameterValues& values);

ParameterValues DefaultsOf(const BehaviourKind& kind);

}  // namespace pheromone::lab
