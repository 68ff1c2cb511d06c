#include "client_fw/swarm/live.h"

#include <poll.h>

#include <cassert>
#include <set>
#include <span>

#include "client_fw/boards/host/real_time.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;

}  // namespace

Result<keys::RobotsKeys> SignWith(const std::string& keys_file, SwarmConfig* config) {
  if (keys_file.empty()) {
    return keys::RobotsKeys{};
  }
  const std::span<RobotConfig> robots =
      config->robots.empty() ? std::span(&config->robot, 1) : std::span(config->robots);
  std::set<uint8_t> ids;
  for (const RobotConfig& robot : robots) {
    const bool is_new = ids.insert(robot.client.id).second;
    assert(is_new);
    static_cast<void>(is_new);
  }
  Result<keys::RobotsKeys> taken = keys::TakeKeys(keys_file, ids);
  if (!taken.ok()) {
    return Error{"--keys: " + taken.error()};
  }
  for (RobotConfig& robot : robots) {
    robot.client.key = taken.value().keys.at(robot.client.id).data();
    // An image counts this start itself.
    robot.client.boot_counter =
        static_cast<uint16_t>(taken.value().first_start - (robot.image.empty() ? 0 : 1));
  }
  return taken;  // where the keys are does not change when it is moved
}

LiveSwarm::LiveSwarm(const SwarmConfig& config, const std::vector<std::string>& ports,
                     int64_t adapter_ns)
    : swarm_(config, [&](size_t channel, sim::RadioMedium* medium) {
        assert(ports.size() == config.channels);
        modems_.emplace_back(ports[channel], medium, adapter_ns);
      }) {}

Status LiveSwarm::Open() {
  for (PortModem& modem : modems_) {
    PHEROMONE_TRY_STATUS(modem.Open());
  }
  return Ok();
}

void LiveSwarm::Run(int64_t duration_ms, const volatile std::sig_atomic_t* stop,
                    const std::function<void()>& each_ms) {
  const auto goes_on = [&] {
    return *stop == 0 && (duration_ms == 0 || swarm_.now_ms() < duration_ms);
  };
  const int64_t start_ns = MonotonicNs() - swarm_.now_ms() * kNsPerMs;
  each_ms();
  while (goes_on()) {
    for (const int64_t due_ms = (MonotonicNs() - start_ns) / kNsPerMs;
         swarm_.now_ms() < due_ms && goes_on();) {
      swarm_.Step([this](size_t channel, int64_t time_ns) { modems_[channel].AdvanceTo(time_ns); });
      each_ms();
    }
    Wait();
  }
}

// Until the next millisecond, or until a byte comes.
void LiveSwarm::Wait() const {
  std::vector<pollfd> ports;
  for (const PortModem& modem : modems_) {
    ports.push_back({modem.descriptor(), POLLIN, 0});  // poll leaves -1 alone
  }
  poll(ports.data(), ports.size(), 1);
}

}  // namespace pheromone::swarm
