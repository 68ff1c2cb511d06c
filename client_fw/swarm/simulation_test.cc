#include "client_fw/swarm/simulation.h"

#include <gtest/gtest.h>

#include <string>

#include "client_fw/sim/radio_tally.h"
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
  const client::Counters& counters = simulation.robot().counters();
  EXPECT_EQ(counters.hellos, 1u);
  EXPECT_EQ(counters.timeouts, 0u);
  EXPECT_EQ(counters.answers, counters.requests);
  EXPECT_GE(counters.answers, 49u);
  EXPECT_LE(counters.answers, 51u);
  EXPECT_EQ(simulation.server().counters().late_answers, 0u);
}

// 14 bytes there and 12 back, 5 times a second at 9600 baud, and a little stuffing: 13.5 % of the
// time at least.
TEST(Simulation, TheChannelCarriesWhatTheFramesWeigh) {
  Simulation simulation(OnALine());
  simulation.RunTo(20'000);
  EXPECT_GT(simulation.medium().Utilisation(), 5 * 26 * 10.0 / 9600);
  EXPECT_LT(simulation.medium().Utilisation(), 5 * 30 * 10.0 / 9600);
}

TEST(Simulation, ASignedRobotObeysAndOneWithoutAKeyIsIgnored) {
  SimulationConfig config = OnALine();
  config.robots = {config.robot, config.robot};
  config.robots[0].client.id = 1;
  config.robots[1].client.id = 2;
  config.keys = {{uint8_t{1}, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}}};
  Simulation simulation(config);
  simulation.RunTo(10'000);
  EXPECT_GE(simulation.robot(0).counters().answers, 40u);
  EXPECT_EQ(simulation.robot(0).counters().forged, 0u);
  EXPECT_EQ(simulation.robot(1).counters().hello_answers, 0u);
  EXPECT_GE(simulation.signing().counters().unknown_robots, 5u);
  ASSERT_TRUE(simulation.Issue({0, 1, protocol::CommandCode::kHalt, {}}).ok());
  simulation.RunTo(11'000);
  EXPECT_EQ(simulation.robot(0).counters().commands, 1u);
}

// The robot's own counters are the oracle.
TEST(Simulation, ATallyOfSignedFramesCountsWhatTheRobotCounts) {
  class Ear : public sim::Station {
   public:
    void OnByte(uint8_t byte, int64_t time_ns) override {
      tally.OnSent(byte, time_ns);
      tally.OnHeard(byte, time_ns);
    }
    void OnTransmitted(int64_t /*time_ns*/) override {}
    sim::RadioTally tally{1, true};
  };
  for (const bool rounds : {false, true}) {
    Ear ear;
    SimulationConfig config = OnALine();
    for (uint8_t id = 1; id <= (rounds ? 3 : 1); ++id) {  // nothing collides
      config.robots.push_back(config.robot);
      config.robots.back().client.id = id;
      config.robots.back().client.rounds = rounds;
      config.robots.back().power_on_ms = 300 * id;
      config.keys[id].fill(id);
    }
    config.add_listener = [&](size_t, sim::RadioMedium* medium) { medium->AddStation(&ear); };
    Simulation simulation(config);
    simulation.RunTo(10'150);  // between two requests
    const client::Counters truth = simulation.robot().counters();
    const client::Counters told = ear.tally.counters();
    EXPECT_EQ(truth.requests, told.requests);
    EXPECT_EQ(truth.answers, told.answers);
    EXPECT_EQ(truth.hellos, told.hellos);
    EXPECT_EQ(truth.hello_answers, told.hello_answers);
    EXPECT_EQ(truth.rounds, told.rounds);
    EXPECT_GT(told.answers, 40u);
    EXPECT_EQ(rounds, told.rounds != 0);
    EXPECT_EQ(simulation.robot().p_left(), ear.tally.p_left());
  }
}

TEST(Simulation, LostFramesAreCountedAndTheRobotRecovers) {
  SimulationConfig config = OnALine();
  config.radio.block_loss = 0.2;
  Simulation simulation(config);
  simulation.RunTo(20'000);
  const client::Counters& counters = simulation.robot().counters();
  EXPECT_GT(counters.timeouts, 10u);
  // Each frame that asked ended in one way. Those that reported an EVENT are counted by their ends
  // only, and there are few.
  const uint32_t ended =
      counters.answers + counters.hello_answers + counters.timeouts + counters.errors;
  EXPECT_GE(ended + 1, counters.requests + counters.hellos) << "one may be on its way";
  EXPECT_LE(ended, counters.requests + counters.hellos + 5);
  EXPECT_GE(counters.answers, 50u);  // of 100 periods, more than a third of the exchanges lost
}

TEST(Simulation, WithoutAServerOnTheAirTheRobotNeverMoves) {
  SimulationConfig config = OnALine();
  config.radio.block_loss = 1;
  Simulation simulation(config);
  simulation.RunTo(5'000);
  EXPECT_EQ(simulation.robot().true_pose().x_m, config.robot.start.x_m);
  EXPECT_EQ(simulation.robot().true_pose().y_m, config.robot.start.y_m);
}

SimulationConfig WithRobots(size_t count, size_t channels) {
  SimulationConfig config = OnALine();
  config.engine.links.resize(channels, config.engine.links.front());
  config.channels = channels;
  for (size_t i = 0; i < channels; ++i) {
    config.engine.links[i].name = "radio-" + std::to_string(i);
  }
  for (size_t i = 0; i < count; ++i) {
    config.robots.push_back(config.robot);
    config.robots.back().client.id = static_cast<uint8_t>(i + 1);
    config.robots.back().power_on_ms = static_cast<int64_t>(100 * i);
  }
  return config;
}

TEST(Simulation, OneRobotOfTheListIsTheSameAsOneRobot) {
  SimulationConfig listed = OnALine();
  listed.robots = {listed.robot};
  Simulation a(OnALine());
  Simulation b(listed);
  a.RunTo(5'000);
  b.RunTo(5'000);
  EXPECT_EQ(a.robot().true_pose().x_m, b.robot(0).true_pose().x_m);
  EXPECT_EQ(a.state_hash(), b.state_hash());
  EXPECT_EQ(a.medium().counters().bytes, b.medium().counters().bytes);
}

TEST(Simulation, RobotsOfOneChannelHearEachOther) {
  Simulation simulation(WithRobots(3, 1));
  simulation.RunTo(10'000);
  ASSERT_EQ(3u, simulation.robot_count());
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_GT(simulation.robot(i).counters().answers, 40u);
    EXPECT_GT(simulation.robot(i).counters().heard, 80u);
  }
}

TEST(Simulation, RobotsTakeTurnsOnTheChannels) {
  Simulation simulation(WithRobots(2, 2));
  simulation.RunTo(10'000);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_GT(simulation.robot(i).counters().answers, 45u);
    EXPECT_EQ(0u, simulation.robot(i).counters().heard);
    EXPECT_GT(simulation.medium(i).counters().blocks, 90u);
  }
}

TEST(Simulation, ARobotThatIsOffIsSilent) {
  SimulationConfig config = OnALine();
  config.robot.power_on_ms = 2'000;
  Simulation simulation(config);
  simulation.RunTo(1'999);
  EXPECT_EQ(0u, simulation.medium().counters().blocks);
  simulation.RunTo(3'000);
  EXPECT_GT(simulation.robot().counters().answers, 2u);
}

TEST(Simulation, HiddenRobotsHearTheServerAndNotEachOther) {
  SimulationConfig config = WithRobots(2, 1);
  config.hidden_pairs = {{0, 1}};
  Simulation simulation(config);
  simulation.RunTo(10'000);
  for (size_t i = 0; i < 2; ++i) {
    const client::Counters& counters = simulation.robot(i).counters();
    EXPECT_GT(counters.answers, 30u);
    EXPECT_GE(counters.rounds, counters.answers - 10);
    EXPECT_LE(counters.heard, 10u);  // what the server said to the other before there were rounds
  }
}

TEST(Simulation, ACommandReachesItsRobotAndIsAcknowledged) {
  Simulation simulation(OnALine());
  simulation.RunTo(3'000);
  engine::CommandIssued halt;
  halt.id = 1;
  halt.code = protocol::CommandCode::kHalt;
  ASSERT_TRUE(simulation.Issue(halt).ok());
  simulation.RunTo(4'000);
  EXPECT_EQ((client::WheelSpeeds{0, 0}), simulation.robot().wheels());
  EXPECT_EQ(1u, simulation.robot().counters().commands);
  halt.id = 9;
  EXPECT_FALSE(simulation.Issue(halt).ok());
}

}  // namespace
}  // namespace pheromone::swarm
