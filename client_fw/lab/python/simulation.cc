#include "client_fw/lab/python/simulation.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server/config/document.h"

namespace pheromone::lab::python {
namespace {

template <typename T>
T OrThrow(Result<T> result) {
  if (!result.ok()) {
    throw LabError(result.error());
  }
  return std::move(result).value();
}

LabScenario Read(std::string_view text, const std::string& name,
                 const std::optional<std::filesystem::path>& folder, const KeyValues& settings) {
  config::Value tree = OrThrow(config::ParseDocument(text, name));
  for (const auto& [key, value] : settings) {
    OrThrow(SetValue(key, value, &tree));
  }
  return OrThrow(ReadLabScenario(tree, name, folder));
}

void Drive(const std::vector<std::string>& names, LabScenario* scenario) {
  const std::vector<RobotGroup>& groups = scenario->world.groups;
  for (const std::string& name : names) {
    const auto found = std::find_if(groups.begin(), groups.end(),
                                    [&](const RobotGroup& group) { return group.name == name; });
    if (found == groups.end()) {
      std::string list;
      for (const RobotGroup& group : groups) {
        list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", group.name);
      }
      throw LabError(fmt::format("drive: found \"{}\", expected one of {}", name, list));
    }
    scenario->plans[static_cast<size_t>(found - groups.begin())].outside = true;
  }
}

}  // namespace

Simulation::Simulation(std::string_view text, const std::string& name,
                       const std::optional<std::filesystem::path>& folder,
                       const KeyValues& settings, const std::vector<std::string>& drive,
                       int threads) {
  if (threads < 1 || threads > 256) {
    throw LabError(fmt::format("threads: found {}, expected 1 to 256", threads));
  }
  LabScenario scenario = Read(text, name, folder, settings);
  Drive(drive, &scenario);
  scenario_ = std::make_unique<const LabScenario>(std::move(scenario));
  world_ = OrThrow(MakeWorld(*scenario_, threads));
  events_ = std::make_unique<ScenarioEvents>(*scenario_, world_.get());
  size_t first = 0;
  for (size_t i = 0; i < world_->groups().size(); ++i) {
    const size_t count = world_->groups()[i].starts.size();
    places_.push_back({first, count, scenario_->plans[i].outside});
    first += count;
  }
  ResetAll();
  Sense();
}

void Simulation::Sense() {
  Status status = events_->MakeDue();
  if (status.ok()) {
    status = world_->Sense();
  }
  if (!status.ok()) {
    ended_ = status.error();
    throw LabError(ended_);
  }
}

void Simulation::Step() {
  const uint64_t step = world_->time().step;
  const Status status = world_->Act();
  ResetAll();
  if (!status.ok()) {
    if (world_->time().step != step) {  // something was moved
      ended_ = status.error();
    }
    throw LabError(status.error());
  }
  if (!result_ && static_cast<int64_t>(world_->time().now_ms()) >= scenario_->duration_ms) {
    result_ = Measured();
  }
  Sense();
}

LabResult Simulation::Measured() const {
  return ResultOf(*world_);
}

void Simulation::ResetAll() {
  for (size_t group = 0; group < places_.size(); ++group) {
    if (places_[group].driven) {
      ResetActions(group);
    }
  }
}

void Simulation::ResetActions(size_t group) {
  const GroupPlace& place = places_[group];
  world_->ResetActions({&world_->groups()[group], place.first, place.first, place.count});
}

Simulation::Turn::Turn(Simulation* simulation) : simulation_(simulation) {
  if (simulation->busy_) {
    throw LabError("another thread is using this world, expected one at a time");
  }
  if (!simulation->ended_.empty()) {
    throw LabError("the world has ended, make another one: " + simulation->ended_);
  }
  simulation->busy_ = true;
}

}  // namespace pheromone::lab::python
