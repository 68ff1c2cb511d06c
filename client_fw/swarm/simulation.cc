#include "client_fw/swarm/simulation.h"

#include <cassert>

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr uint16_t kEpoch = 1;

sim::RadioConfig RadioOf(const SimulationConfig& config, size_t channel) {
  sim::RadioConfig radio = config.radio;
  radio.seed += channel;
  return radio;
}

}  // namespace

Simulation::Channel::Channel(const SimulationConfig& config, size_t index, engine::Service* service)
    : medium(RadioOf(config, index)),
      station(service, static_cast<engine::LinkIndex>(index), &medium, config.server) {}

Simulation::Simulation(const SimulationConfig& config)
    : service_(&log_, [this] {
        // Of several channels the first is the clock: the others lag by less than a millisecond.
        const auto now_ms = static_cast<uint64_t>(channels_.empty() ? 0 : this->now_ms());
        return engine::ClockReading{now_ms, static_cast<int64_t>(now_ms)};
      }) {
  assert(config.channels > 0 && config.engine.links.size() >= config.channels);
  const Status configured = service_.Configure(config.engine, kEpoch);
  assert(configured.ok());
  (void)configured;
  for (size_t i = 0; i < config.channels; ++i) {
    channels_.emplace_back(config, i, &service_);
  }
  if (config.robots.empty()) {
    robots_.emplace_back(config.robot, &channels_.front().medium);
  }
  for (const sim::SimulatedRobotConfig& robot : config.robots) {
    robots_.emplace_back(robot, &channels_[robots_.size() % channels_.size()].medium);
  }
  for (const auto& [a, b] : config.hidden_pairs) {
    assert(a != b && a < robots_.size() && b < robots_.size());
    if (a % channels_.size() == b % channels_.size()) {
      channels_[a % channels_.size()].medium.Hide(robots_[a].station(), robots_[b].station());
    }
  }
}

void Simulation::RunTo(int64_t ms) {
  for (int64_t at = now_ms() + 1; at <= ms; ++at) {
    for (Channel& channel : channels_) {
      channel.medium.AdvanceTo(at * kNsPerMs);
    }
    std::vector<engine::Outgoing> due;
    service_.AdvanceIfDue(&due);
    Distribute(due);
    for (Channel& channel : channels_) {
      channel.station.Step();
    }
    for (sim::SimulatedRobot& robot : robots_) {
      robot.Step();
    }
  }
}

Status Simulation::Issue(const engine::CommandIssued& command) {
  std::vector<engine::Outgoing> out;
  Status issued = service_.Issue(command, &out);
  Distribute(out);
  return issued;
}

void Simulation::Distribute(const std::vector<engine::Outgoing>& out) {
  for (const engine::Outgoing& outgoing : out) {
    channels_[outgoing.link].station.Queue(outgoing);
  }
}

}  // namespace pheromone::swarm
