#include "client_fw/swarm/swarm.h"

#include <cassert>

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;

}  // namespace

Swarm::Swarm(const SwarmConfig& config,
             const std::function<void(size_t, sim::RadioMedium*)>& add_server) {
  assert(config.channels > 0);
  for (size_t i = 0; i < config.channels; ++i) {
    sim::RadioConfig radio = config.radio;
    radio.seed += i;
    add_server(i, &media_.emplace_back(radio));
    if (config.add_listener) {
      config.add_listener(i, &media_.back());
    }
  }
  if (config.robots.empty()) {
    robots_.push_back(MakeRobot(config.robot, &media_.front()));
  }
  for (const RobotConfig& robot : config.robots) {
    robots_.push_back(MakeRobot(robot, &media_[robots_.size() % media_.size()]));
  }
  for (const auto& [a, b] : config.hidden_pairs) {
    assert(a != b && a < robots_.size() && b < robots_.size());
    if (a % media_.size() == b % media_.size()) {
      media_[a % media_.size()].Hide(robots_[a]->station(), robots_[b]->station());
    }
  }
}

void Swarm::Step(const std::function<void(size_t, int64_t)>& advance) {
  const int64_t next_ns = (now_ms() + 1) * kNsPerMs;
  for (size_t i = 0; i < media_.size(); ++i) {
    advance(i, next_ns);
  }
  for (const std::unique_ptr<sim::MobileRobot>& robot : robots_) {
    robot->Step();
  }
}

}  // namespace pheromone::swarm
