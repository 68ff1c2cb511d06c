#include "client_fw/swarm/simulation.h"

#include <algorithm>
#include <cassert>
#include <cstdint>

namespace pheromone::swarm {
namespace {

constexpr uint16_t kEpoch = 1;

}  // namespace

Simulation::Simulation(const SimulationConfig& config)
    : service_(&log_,
               [this] {
                 const auto now_ms = static_cast<uint64_t>(swarm_ ? this->now_ms() : 0);
                 return engine::ClockReading{now_ms, static_cast<int64_t>(now_ms)};
               }),
      keys_(config.keys) {
  assert(config.engine.links.size() >= config.channels);
  const auto configured = service_.Configure(config.engine, kEpoch);
  assert(configured.ok());
  (void)configured;
  swarm_.emplace(Signed(config), [&](size_t channel, sim::RadioMedium* medium) {
    if (!keys_.empty()) {
      signing_.emplace_back(signing::Security::kRequire, keys_, SeededRandom(1 + channel));
    }
    stations_.emplace_back(&service_, static_cast<engine::LinkIndex>(channel),
                           config.engine.links[channel], medium, config.server,
                           keys_.empty() ? nullptr : &signing_.back());
  });
}

SwarmConfig Simulation::Signed(const SimulationConfig& config) {
  SwarmConfig swarm = static_cast<const SwarmConfig&>(config);
  const auto sign = [this](RobotConfig* robot) {
    const auto key = keys_.find(robot->client.id);
    if (key != keys_.end()) {
      robot->client.key = key->second.data();
    }
  };
  sign(&swarm.robot);
  std::for_each(swarm.robots.begin(), swarm.robots.end(), [&](RobotConfig& it) { sign(&it); });
  return swarm;
}

void Simulation::RunTo(int64_t ms) {
  while (now_ms() < ms) {
    swarm_->Step([this](size_t channel, int64_t time_ns) {
      stations_[channel].AdvanceTo(time_ns);
      if (channel == 0) {  // the clock
        AdvanceEngine();
      }
    });
  }
}

void Simulation::AdvanceEngine() {
  std::vector<engine::Outgoing> due;
  service_.AdvanceIfDue(&due);
  Distribute(due);
}

Status Simulation::Issue(const engine::CommandIssued& command) {
  std::vector<engine::Outgoing> out;
  Status issued = service_.Issue(command, &out);
  Distribute(out);
  return issued;
}

void Simulation::Distribute(const std::vector<engine::Outgoing>& out) {
  for (const engine::Outgoing& outgoing : out) {
    stations_[outgoing.link].Queue(outgoing);
  }
}

}  // namespace pheromone::swarm
