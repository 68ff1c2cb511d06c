// On a channel without losses everything is answered: behind each kind of modem, at each baud rate
// and with each turnaround.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <tuple>

#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"
#include "client_fw/swarm/testing/standing_robots.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSettledMs = 5'000;
constexpr int64_t kEndMs = 215'000;  // 1000 requests at 5 Hz, and some

enum class Modem : uint8_t { kTransparent, kKeyed, kAdapterOf1Ms, kAdapterOf16Ms };

struct Case {
  Modem modem;
  int64_t turnaround_ms;
  int64_t baud;
};

std::string NameOf(const Case& it) {
  constexpr const char* kNames[] = {"Transparent", "Keyed", "AdapterOf1Ms", "AdapterOf16Ms"};
  return std::string(kNames[static_cast<size_t>(it.modem)]) + "At" + std::to_string(it.baud) +
         "AndTurnaroundOf" + std::to_string(it.turnaround_ms) + "Ms";
}

SimulationConfig ConfigOf(const Case& it, int robots) {
  ChannelTiming timing;
  timing.baud = it.baud;
  timing.turnaround_ns = it.turnaround_ms * kMs;
  timing.keyed = it.modem == Modem::kKeyed;
  timing.lead_ns = timing.keyed ? timing.turnaround_ns : 0;
  timing.adapter_ns = it.modem == Modem::kAdapterOf16Ms  ? 16 * kMs
                      : it.modem == Modem::kAdapterOf1Ms ? kMs
                                                         : 0;
  SimulationConfig config;
  config.engine = EngineConfigOf(PathExperiment{});
  config.engine.links = {timing.Link("radio-a")};
  config.radio.baud = timing.baud;
  config.radio.turnaround_ns = timing.turnaround_ns;
  config.server.delay_ns = timing.server_delay_ns;
  config.server.adapter_ns = timing.adapter_ns;
  config.server.keyed = timing.keyed;
  config.server.lead_ns = timing.lead_ns;
  for (int i = 0; i < robots; ++i) {
    RobotConfig robot = StandingRobot(i);
    robot.client.rounds = robots > 1;
    robot.power_on_ms = 130 * i;
    config.robots.push_back(robot);
  }
  return config;
}

class ChannelMatrix : public testing::TestWithParam<
                          std::tuple<Modem, int64_t /*turnaround_ms*/, int64_t /*baud*/>> {
 protected:
  static Case Param() {
    const auto& [modem, turnaround_ms, baud] = GetParam();
    return {modem, turnaround_ms, baud};
  }
};

TEST_P(ChannelMatrix, OneRobotIsAnswered) {
  Simulation simulation(ConfigOf(Param(), 1));
  simulation.RunTo(kSettledMs);
  const client::Counters before = simulation.robot().counters();
  simulation.RunTo(kEndMs);
  const client::Counters after = simulation.robot().counters();
  const uint32_t requests = after.requests - before.requests;
  EXPECT_GE(requests, 1000u);
  EXPECT_LE((after.timeouts - before.timeouts) * 1000, requests);
  EXPECT_GE((after.answers - before.answers + 1) * 1000, requests * 999);
  EXPECT_EQ(after.fail_safe_stops, before.fail_safe_stops);
}

TEST_P(ChannelMatrix, TwoRobotsAreAnsweredInEveryTurn) {
  Simulation simulation(ConfigOf(Param(), 2));
  simulation.RunTo(kSettledMs);
  const radio::RoundCounters before = simulation.server().counters().rounds;
  const uint32_t answers =
      simulation.robot(0).counters().answers + simulation.robot(1).counters().answers;
  simulation.RunTo(kEndMs);
  const radio::RoundCounters after = simulation.server().counters().rounds;
  const uint64_t turns = after.turns - before.turns;
  EXPECT_GE(turns, 1000u);
  EXPECT_LE((after.missed - before.missed) * 1000, turns);
  EXPECT_LE((after.unanswered - before.unanswered) * 1000, turns);
  EXPECT_GE((simulation.robot(0).counters().answers + simulation.robot(1).counters().answers -
             answers + 2) *
                1000,
            turns * 999);
}

INSTANTIATE_TEST_SUITE_P(
    Matrix, ChannelMatrix,
    testing::Combine(testing::Values(Modem::kTransparent, Modem::kKeyed, Modem::kAdapterOf1Ms,
                                     Modem::kAdapterOf16Ms),
                     testing::Values(0, 2, 5, 12, 20, 50),
                     testing::Values(9600, 19'200, 38'400, 57'600, 115'200)),
    [](const auto& it) {
      return NameOf({std::get<0>(it.param), std::get<1>(it.param), std::get<2>(it.param)});
    });

}  // namespace
}  // namespace pheromone::swarm
