#include "client_fw/swarm/simulation.h"

#include <gtest/gtest.h>

#include "client_fw/swarm/path_experiment.h"

namespace pheromone::swarm {
namespace {

SimulationConfig OnALine() {
  SimulationConfig config;
  config.engine = EngineConfigOf({});
  config.robot.client.type = 2;
  config.robot.start = {1.5, 2.25, 0.46};
  return config;
}

TEST(Simulation, ARobotGetsAnAnswerInEveryPeriod) {
  Simulation simulation(OnALine());
  simulation.RunTo(10'000);
  const client::Counters& counters = simulation.robot().conversation().counters();
  EXPECT_EQ(counters.hellos, 1u);
  EXPECT_EQ(counters.timeouts, 0u);
  EXPECT_EQ(counters.answers, counters.requests);
  EXPECT_GE(counters.answers, 49u);
  EXPECT_LE(counters.answers, 51u);
  EXPECT_EQ(simulation.server().late_answers(), 0u);
}

// 14 bytes there and 12 back, 5 times a second at 9600 baud, and a little stuffing: 13.5 % of the
// time at least.
TEST(Simulation, TheChannelCarriesWhatTheFramesWeigh) {
  Simulation simulation(OnALine());
  simulation.RunTo(20'000);
  EXPECT_GT(simulation.medium().Utilisation(), 5 * 26 * 10.0 / 9600);
  EXPECT_LT(simulation.medium().Utilisation(), 5 * 30 * 10.0 / 9600);
}

TEST(Simulation, LostFramesAreCountedAndTheRobotRecovers) {
  SimulationConfig config = OnALine();
  config.radio.block_loss = 0.2;
  Simulation simulation(config);
  simulation.RunTo(20'000);
  const client::Counters& counters = simulation.robot().conversation().counters();
  EXPECT_GT(counters.timeouts, 10u);
  EXPECT_EQ(counters.requests + counters.hellos,
            counters.answers + counters.hello_answers + counters.timeouts + counters.errors);
  EXPECT_GE(counters.answers, 50u);  // of 100 periods, more than a third of the exchanges lost
}

TEST(Simulation, WithoutAServerOnTheAirTheRobotNeverMoves) {
  SimulationConfig config = OnALine();
  config.radio.block_loss = 1;
  Simulation simulation(config);
  simulation.RunTo(5'000);
  EXPECT_EQ(simulation.robot().drive().travelled_m(), 0);
}

}  // namespace
}  // namespace pheromone::swarm
