#include "client_fw/lab/scenario/level.h"

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "client_fw/sim/radio_medium.h"

namespace pheromone::lab {
namespace {

using config::Notes;
using config::TableReader;
using config::Value;

// Follows one pheromone, and deposits a quantum of it or nothing.
void CheckFollower(const TableReader& table, const std::string& level, const RobotGroup& group,
                   const BehaviourPlan& plan) {
  if (plan.kind == nullptr || plan.kind->name != "follow") {
    table.Report(plan.kind == nullptr ? "plugin" : "behaviour",
                 "not known to " + level + ", expected \"follow\"");
    return;
  }
  if (group.senses.size() != 1) {
    table.Report("senses", "not known to " + level + ", expected one pheromone");
    return;
  }
  const double quanta = plan.values.find("quanta")->second;
  if (quanta > 1) {
    table.Report("parameters.quanta",
                 fmt::format("found {}, expected 0 or 1: at {}, robots send TRACE", quanta, level));
  } else if (quanta > 0 && group.deposits != group.senses.front()) {
    table.Report("deposits", "not known to " + level + ", expected the pheromone that is sensed");
  }
}

void CheckRadioRobots(const TableReader& table, const std::string& level, const RobotGroup& group) {
  table.Without({"wheelbase_m", "max_speed_m_per_s", "acceleration_m_per_s2", "odometry_bias",
                 "odometry_noise", "slip", "fix_period_s", "fix_sigma_m", "range_m"},
                level, "the drive that the simulator has");
  if (group.radius_m > 0) {
    table.Report("radius_m", fmt::format("found {}, expected 0: at {}, robots do not collide",
                                         group.radius_m, level));
  }
}

}  // namespace

std::string LevelText(const LabScenario& scenario) {
  return fmt::format("level = \"{}\"", NameOf(scenario.level));
}

void CheckLevel(const Value& root, const LabScenario& scenario, Notes* notes) {
  if (scenario.level == Level::kField) {
    return;
  }
  const bool radio = scenario.level == Level::kRadio;
  const std::string level = LevelText(scenario);
  for (const std::string_view key : {"site", "wall", "event"}) {
    if (const Value* found = root.Find(key)) {
      notes->problems.Add(found->at, key, "not known to " + level + ", expected none");
    }
  }
  const std::vector<const Value*> tables = config::TablesOf(root, "robots", notes);
  for (size_t i = 0; i < scenario.world.groups.size(); ++i) {
    const TableReader table(*tables[i], config::PathOf("robots", i), &notes->problems);
    CheckFollower(table, level, scenario.world.groups[i], scenario.plans[i]);
    if (radio) {
      CheckRadioRobots(table, level, scenario.world.groups[i]);
    }
  }
  if (!radio) {
    return;
  }
  size_t robots = 0;
  for (const RobotGroup& group : scenario.world.groups) {
    robots += group.starts.size();
  }
  const size_t channels = ChannelsOf(robots, scenario.world.radio->robots_per_channel);
  if (robots > sim::kMaxRobots || channels > sim::kMaxChannels) {
    notes->problems.Add(
        root.at, "robots",
        fmt::format("found {} robots on {} channels, expected at most {} on {} at {}", robots,
                    channels, sim::kMaxRobots, sim::kMaxChannels, level));
  }
}

}  // namespace pheromone::lab
