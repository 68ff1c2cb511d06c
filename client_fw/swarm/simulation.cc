#include "client_fw/swarm/simulation.h"

#include <cassert>

namespace pheromone::swarm {
namespace {

constexpr uint16_t kEpoch = 1;

}  // namespace

Simulation::Simulation(const SimulationConfig& config)
    : service_(&log_, [this] {
        const auto now_ms = static_cast<uint64_t>(swarm_ ? this->now_ms() : 0);
        return engine::ClockReading{now_ms, static_cast<int64_t>(now_ms)};
      }) {
  assert(config.engine.links.size() >= config.channels);
  const auto configured = service_.Configure(config.engine, kEpoch);
  assert(configured.ok());
  (void)configured;
  swarm_.emplace(config, [&](size_t channel, sim::RadioMedium* medium) {
    stations_.emplace_back(&service_, static_cast<engine::LinkIndex>(channel),
                           config.engine.links[channel], medium, config.server);
  });
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
