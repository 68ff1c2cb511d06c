// A robot behind a USB adapter that holds back what it received for 16 ms, such as
// pheromone-robot's, among robots in rounds: it contends, and is served. In virtual time.
#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <utility>

#include "client_fw/core/conversation.h"
#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"
#include "client_fw/swarm/testing/standing_robots.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kHoldsBackMs = 16;
constexpr int64_t kWarmMs = 10'000;
constexpr int64_t kFiveMinutesMs = 300'000;

// An FTDI looks every 16 ms whether it has something; others, 16 ms after the first byte.
enum class Adapter : uint8_t { kLooks, kWaits };

class AdapterRobot final : public sim::Station {
 public:
  AdapterRobot(const client::Parameters& parameters, Adapter adapter, sim::RadioMedium* medium)
      : medium_(medium), adapter_(adapter), conversation_(parameters, &memory_) {
    station_ = medium->AddStation(this);
  }

  void OnByte(uint8_t byte, int64_t time_ns) override {
    if (held_.empty()) {
      const int64_t ms = time_ns / 1'000'000 + 1;
      give_ms_ = adapter_ == Adapter::kWaits
                     ? ms + kHoldsBackMs
                     : (ms + kHoldsBackMs - 1) / kHoldsBackMs * kHoldsBackMs;
    }
    held_.push_back(byte);
  }
  void OnTransmitted(int64_t /*time_ns*/) override { sent_ = true; }

  void Step(int64_t ms) {
    const auto now_ms = static_cast<uint32_t>(ms);
    if (std::exchange(sent_, false)) {
      conversation_.OnSent(now_ms);
    }
    for (; ms >= give_ms_ && !held_.empty(); held_.pop_front()) {
      conversation_.OnByte(held_.front(), now_ms);
    }
    const client::Odometry odometry{2000, 2500, 0};
    conversation_.Poll(now_ms, &odometry, false);
    if (conversation_.tx_size() != 0 && !medium_->Sending(station_) && !sent_) {
      medium_->Transmit(station_, {conversation_.tx(), conversation_.tx_size()});
    }
  }

  client::Counters counters() const { return conversation_.counters(); }

 private:
  sim::RadioMedium* medium_;
  const Adapter adapter_;
  client::RequestMemory memory_ = client::RequestMemory();
  client::Conversation conversation_;
  std::deque<uint8_t> held_;
  int64_t give_ms_ = 0;
  int station_ = 0;
  bool sent_ = false;
};

struct Served {
  double answers_per_s = 0;
  uint32_t stops = 0;
  uint32_t stops_of_others = 0;
};

Served Serve(int others, Adapter adapter, uint8_t adapter_ms, int64_t servers_adapter_ms) {
  ChannelTiming timing;
  timing.adapter_ns = servers_adapter_ms * 1'000'000;
  SimulationConfig config;
  config.engine = EngineConfigOf(PathExperiment{});
  config.engine.links = {timing.Link("radio-a")};
  config.server.delay_ns = timing.server_delay_ns;
  config.server.adapter_ns = timing.adapter_ns;
  for (int i = 0; i < others; ++i) {
    RobotConfig robot = StandingRobot(i);
    robot.power_on_ms = int64_t{61} * i;
    robot.client.lay_trail = true;
    config.robots.push_back(robot);
  }
  client::Parameters parameters;
  parameters.id = 200;
  parameters.boot_counter = 11;
  parameters.type = 2;
  parameters.start_released = true;
  parameters.buffered_link = true;
  parameters.rounds = false;
  parameters.lay_trail = true;
  parameters.gap_timeout_ms = 50;
  parameters.adapter_ms = adapter_ms;
  std::unique_ptr<AdapterRobot> robot;
  config.add_listener = [&](size_t, sim::RadioMedium* medium) {
    robot = std::make_unique<AdapterRobot>(parameters, adapter, medium);
  };
  Simulation simulation(config);
  client::Counters before{};
  uint32_t others_before = 0;
  for (int64_t ms = 1; ms <= kWarmMs + kFiveMinutesMs; ++ms) {
    simulation.RunTo(ms);
    robot->Step(ms);
    if (ms == kWarmMs) {
      before = robot->counters();
      others_before = FailSafeStops(simulation);
    }
  }
  const client::Counters after = robot->counters();
  return {(after.answers - before.answers) * 1000.0 / kFiveMinutesMs,
          after.fail_safe_stops - before.fail_safe_stops,
          FailSafeStops(simulation) - others_before};
}

// It asks for five answers per second, as they do.
TEST(AdapterRobot, IsServedAmongThreeInRounds) {
  for (const Adapter adapter : {Adapter::kLooks, Adapter::kWaits}) {
    for (const int64_t servers_adapter_ms : {0, 1, 16}) {
      const Served served = Serve(3, adapter, kHoldsBackMs, servers_adapter_ms);
      EXPECT_GE(served.answers_per_s, 4.9) << servers_adapter_ms;
      EXPECT_EQ(served.stops, 0u) << servers_adapter_ms;
      EXPECT_EQ(served.stops_of_others, 0u) << servers_adapter_ms;
    }
  }
}

// What it misses if it does not wait for its adapter: the server's window does not contain it.
TEST(AdapterRobot, HasToWaitForItsAdapter) {
  EXPECT_LT(Serve(3, Adapter::kLooks, 0, 0).answers_per_s,
            0.8 * Serve(3, Adapter::kLooks, kHoldsBackMs, 0).answers_per_s);
}

}  // namespace
}  // namespace pheromone::swarm
