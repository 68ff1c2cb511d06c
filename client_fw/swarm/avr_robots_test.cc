// Robots that run the image which one would flash, in a scenario.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/scenario/report.h"
#include "client_fw/swarm/scenario/run.h"
#include "client_fw/swarm/simulation.h"

namespace pheromone::swarm {
namespace {

Scenario Example() {
  Result<Scenario> scenario =
      LoadScenario(PHEROMONE_SOURCE_DIR "/client_fw/swarm/examples/avr.toml");
  EXPECT_TRUE(scenario.ok()) << scenario.error();
  return scenario.value();
}

std::string Everything(const Scenario& scenario) {
  const SwarmRecord record = RunScenario(scenario, {});
  return Summarise(scenario, record) + RobotsToCsv(scenario, record) + TracksToCsv(record) +
         ExchangesToCsv(record) + DrawScenario(scenario, record);
}

// Robot 1 is the image, robot 2 the same code compiled for this machine.
TEST(AvrRobots, AnImageFollowsThePathAsTheCoreDoes) {
  const SwarmRecord record = RunScenario(Example(), {});
  ASSERT_EQ(2u, record.robots.size());
  for (const RobotRecord& robot : record.robots) {
    EXPECT_GT(robot.progress_m, 0.85 * 0.2 * 20);
    EXPECT_LT(robot.mean_error_m, 0.05);
    // Five a second, but for the second in which the Pioneer is found.
    EXPECT_GE(robot.counters.answers, 94u);
    EXPECT_LE(robot.counters.answers, 101u);
  }
  EXPECT_NEAR(record.robots[1].progress_m, record.robots[0].progress_m, 0.1);
  EXPECT_EQ(0u, record.channels[0].radio.collided_blocks);
}

// As the core does (path_experiment_test.cc): its default law, on the server's default circuit.
PathExperiment FastImage() {
  PathExperiment experiment;
  experiment.shape = Shape::kCircuit;
  experiment.law = client::Settings().law;
  experiment.speed_mm_s = 600;
  experiment.pioneer = sim::FindPioneerModel("p3dx-sh");
  experiment.image = BuiltAvrImage();
  experiment.sample_ms = 100;
  return experiment;
}

TEST(AvrRobots, AnImageHoldsTheDefaultCircuitAt600MmS) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    PathExperiment experiment = FastImage();
    experiment.duration_ms = 60'000;
    const PathRun run = FollowPath(experiment, seed);
    EXPECT_LE(MeanDistance(run.track, 5'000), 0.060) << seed;
    EXPECT_GE(run.progress, 0.5) << seed;
  }
}

TEST(AvrRobots, AnImageWhoseTrailIsTakenAwayStandsWithinAMetre) {
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    PathExperiment experiment = FastImage();
    experiment.erase_ms = 10'000 + 2'300 * static_cast<int64_t>(seed);
    experiment.duration_ms = experiment.erase_ms + 12'000;
    const PathRun run = FollowPath(experiment, seed);
    EXPECT_LE(run.on_its_own_m, 1.0) << seed;
    const Sample& last = run.track.back();
    const Sample& before = run.track[run.track.size() - 31];
    EXPECT_EQ(before.pose.x_m, last.pose.x_m) << seed;
    EXPECT_EQ(before.pose.y_m, last.pose.y_m) << seed;
    EXPECT_EQ(before.pose.heading_rad, last.pose.heading_rad) << seed;
    for (const Sample& sample : run.track) {
      ASSERT_TRUE(sample.pose.x_m > 0 && sample.pose.x_m < 10 && sample.pose.y_m > 0 &&
                  sample.pose.y_m < 10)
          << seed;
    }
  }
}

TEST(AvrRobots, SameSeedSameBytes) {
  Scenario scenario = Example();
  scenario.duration_ms = 5'000;
  scenario.groups[0].spread_m = 0.1;
  const std::string first = Everything(scenario);
  EXPECT_EQ(first, Everything(scenario));
  scenario.seed = 2;
  EXPECT_NE(first, Everything(scenario));
}

// They come to the image through its EEPROM, laid out as its compiler does.
TEST(AvrRobots, AnImageObeysItsSettings) {
  Scenario scenario = Example();
  scenario.groups.resize(1);
  client::Parameters& client = scenario.groups[0].client;
  client.speed_mm_s = 340;
  client.period_ms = 500;
  client.fail_safe_ms = 1000;
  client.lay_trail = true;
  const SwarmRecord record = RunScenario(scenario, {});
  EXPECT_NEAR(0.34 * 17, record.robots[0].progress_m, 0.5);
  EXPECT_NEAR(2 * 19, record.robots[0].counters.answers, 2);
  // A TRACE leaves something: the field is another one afterwards.
  client.lay_trail = false;
  EXPECT_NE(record.state_hash, RunScenario(scenario, {}).state_hash);
}

TEST(AvrRobots, AnImageStopsAtAWall) {
  Scenario scenario = Example();
  field::FieldConfig& field = scenario.engine.field;
  field::ObstacleMask mask(field.map.columns(), field.map.rows());
  field::BlockLine(field.map, {{{3'000'000, 0}, {3'000'000, 9'000'000}}}, 100'000, &mask);
  field.obstacles = field::Shared(std::move(mask));
  scenario.groups.resize(1);
  const SwarmRecord record = RunScenario(scenario, {});
  EXPECT_EQ(1u, record.robots[0].bumps);
  EXPECT_LT(record.robots[0].track.back().pose.x_m, 2.95 - 0.25);
  EXPECT_GT(record.robots[0].track.back().pose.x_m, 2.95 - 0.25 - 0.001);
}

TEST(AvrRobots, TheDaemonIsToldWhereAnImageIsSwitchedOn) {
  EXPECT_EQ(
      "[[frame]]\nlink = \"radio-1\"\nid = 1\nx_m = 1.000000\ny_m = 2.100000\nheading_deg = "
      "20.001\n",
      FramesForDaemon(Example()));
}

TEST(AvrRobots, AnImageThatIsNoneIsAnError) {
  Scenario scenario = Example();
  scenario.groups[0].image = PHEROMONE_SOURCE_DIR "/README.md";
  EXPECT_THROW(RunScenario(scenario, {}), std::runtime_error);
}

// Four of sixteen robots run the image; a SENSE and its answer have 26 bytes and two turnarounds.
TEST(AvrRobots, ImagesTakeTheirTurnsAmongOthers) {
  constexpr int kRobots = 16;
  constexpr double kPeak = 1 / (26 * 10 / 9600.0 + 2 * 0.002);
  SimulationConfig config;
  config.engine = Example().engine;
  config.engine.links = {ChannelTiming{}.Link("radio-a")};
  for (int i = 0; i < kRobots; ++i) {
    RobotConfig robot;
    robot.client = Example().groups[0].client;
    robot.client.id = static_cast<uint8_t>(i + 1);
    robot.client.boot_counter = static_cast<uint16_t>(100 + i);
    robot.client.speed_mm_s = 0;
    robot.start = {1.5 + 0.1 * i, 2, 0};
    if (i % 4 == 0) {
      robot.image = BuiltAvrImage();
      robot.pioneer = sim::FindPioneerModel("p3dx");
    }
    config.robots.push_back(robot);
  }
  Simulation simulation(config);
  simulation.RunTo(10'000);
  std::vector<uint32_t> before;
  for (size_t i = 0; i < kRobots; ++i) {
    before.push_back(simulation.robot(i).counters().answers);
  }
  simulation.RunTo(30'000);
  uint32_t all = 0;
  uint32_t least = UINT32_MAX;
  for (size_t i = 0; i < kRobots; ++i) {
    const uint32_t answers = simulation.robot(i).counters().answers - before[i];
    all += answers;
    least = std::min(least, answers);
  }
  EXPECT_GE(all / 20.0, 1.1 * kPeak);
  EXPECT_GE(least * kRobots, 0.95 * all);
  std::cout << all / 20.0 << " exchanges a second, " << all / 20.0 / kPeak << " of C_1; "
            << least * kRobots / static_cast<double>(all) << " of the mean at least\n";
}

// The image that signs, beside the same code on the host. What the tally of an image makes of
// signed frames is what they say.
TEST(AvrRobots, ASignedImageHasItsTurnsAndObeys) {
  SimulationConfig config;
  config.engine = Example().engine;
  config.engine.links = {ChannelTiming{}.Link("radio-a")};
  for (uint8_t id = 1; id <= 4; ++id) {
    RobotConfig robot;
    robot.client = Example().groups[0].client;
    robot.client.id = id;
    robot.client.boot_counter = id == 1 ? 0 : 100;
    robot.start = {1, 1.6 + 0.2 * id, 0.35};
    robot.pioneer = sim::FindPioneerModel("p3dx");
    if (id <= 2) {
      robot.image = BuiltAvrImage();
      config.engine.frames.push_back(
          engine::MakeFrame("radio-a", id, {1'000'000, std::llround(robot.start.y_m * 1e6)}, 20.0));
    }
    config.keys[id].fill(static_cast<uint8_t>(7 * id));
    config.robots.push_back(robot);
  }
  Simulation simulation(config);
  simulation.RunTo(10'000);
  for (size_t i = 0; i < 4; ++i) {
    const client::Counters counters = simulation.robot(i).counters();
    EXPECT_GE(counters.answers, 40u) << i;
    EXPECT_LE(counters.answers, 50u) << i;
    EXPECT_GE(counters.hellos, 2u) << i;
    EXPECT_EQ(1u, counters.hello_answers) << i;
    EXPECT_GT(simulation.robot(i).true_pose().x_m, 1.5) << i;
  }
  EXPECT_EQ(0u, simulation.signing().counters().unsigned_frames);
  EXPECT_EQ(0u, simulation.signing().counters().wrong_tags);
  simulation.service().Inspect([](const engine::Engine& engine) {
    EXPECT_EQ(1, engine.robots().Find(0, 1)->hello.nonce) << "an image counts this start itself";
    EXPECT_EQ(101, engine.robots().Find(0, 2)->hello.nonce);
    EXPECT_EQ(100, engine.robots().Find(0, 3)->hello.nonce);
  });
  ASSERT_TRUE(simulation.Issue({0, 2, protocol::CommandCode::kHalt, {}}).ok());
  simulation.RunTo(12'000);
  EXPECT_EQ(1u, simulation.robot(1).counters().acks);
  EXPECT_EQ(0, simulation.robot(1).wheels().left_mm_s);
  EXPECT_NE(0, simulation.robot(0).wheels().left_mm_s);
}

TEST(AvrRobots, TheImageOfARobotWithANetDoesNotSign) {
  SimulationConfig config;
  config.engine = Example().engine;
  config.robot.image = BuiltForagerImage();
  config.robot.pioneer = sim::FindPioneerModel("p3dx");
  config.keys[config.robot.client.id];
  EXPECT_THROW(Simulation{config}, std::runtime_error);
}

// Three images and a server whose transmitters are all keyed by a line, and need 40 ms from that to
// the first bit, and 10 ms from the last one.
class KeyedImages {
 public:
  KeyedImages(uint16_t lead_ms, uint16_t tail_ms) {
    constexpr int64_t kMs = 1'000'000;
    SimulationConfig config;
    config.engine = Example().engine;
    ChannelTiming timing;
    timing.turnaround_ns = 53 * kMs;  // with the two above, and a simulated modem's steps
    timing.keyed = true;
    timing.lead_ns = 40 * kMs;
    config.engine.links = {timing.Link("radio-a")};
    config.radio.turnaround_ns = timing.turnaround_ns;
    config.server.keyed = true;
    config.server.lead_ns = timing.lead_ns;
    config.server.tail_ns = 10 * kMs;
    for (int i = 0; i < kRobots; ++i) {
      RobotConfig robot;
      robot.client = Example().groups[0].client;
      robot.client.id = static_cast<uint8_t>(i + 1);
      robot.client.boot_counter = static_cast<uint16_t>(100 + i);
      robot.client.speed_mm_s = 0;
      robot.client.ptt_lead_ms = lead_ms;
      robot.client.ptt_tail_ms = tail_ms;
      robot.start = {1.5 + 0.1 * i, 2, 0};
      robot.image = BuiltAvrImage();
      robot.keyed = sim::KeyedModem{40 * kMs, 10 * kMs};
      robot.pioneer = sim::FindPioneerModel("p3dx");
      config.robots.push_back(robot);
    }
    simulation.emplace(config);
    simulation->RunTo(10'000);
    early_answers = Answers();
    early = simulation->server().decoder_counters();
    early_rounds = simulation->server().counters().rounds;
    simulation->RunTo(30'000);
  }

  uint32_t Answers() const {
    uint32_t all = 0;
    for (size_t i = 0; i < kRobots; ++i) {
      all += simulation->robot(i).counters().answers;
    }
    return all;
  }

  static constexpr int kRobots = 3;
  std::optional<Simulation> simulation;
  uint32_t early_answers = 0;  // of the first ten seconds, in which they find each other
  protocol::DecoderCounters early;
  radio::RoundCounters early_rounds;
};

TEST(AvrRobots, ImagesWithKeyedTransmittersLoseNoByteOfTheirsOrTheServers) {
  const KeyedImages images(40, 10);
  const protocol::DecoderCounters& heard = images.simulation->server().decoder_counters();
  const radio::RoundCounters rounds = images.simulation->server().counters().rounds;
  const uint32_t answers = images.Answers() - images.early_answers;
  const uint64_t turns = rounds.turns - images.early_rounds.turns;
  std::cout << answers / 20.0 << " exchanges a second of three keyed robots, " << turns
            << " turns\n";
  EXPECT_GT(turns, 100u);
  EXPECT_EQ(images.early_rounds.missed, rounds.missed);
  EXPECT_NEAR(static_cast<double>(turns), heard.frames - images.early.frames, KeyedImages::kRobots);
  EXPECT_EQ(images.early.crc_errors, heard.crc_errors);
  EXPECT_EQ(images.early.ignored_bytes, heard.ignored_bytes);
  EXPECT_NEAR(static_cast<double>(turns), answers, KeyedImages::kRobots);
}

TEST(AvrRobots, ALeadOrTailThatIsTooShortDamagesEveryFrame) {
  for (const auto& [lead_ms, tail_ms] : {std::pair(39, 10), std::pair(40, 9)}) {
    const KeyedImages images(static_cast<uint16_t>(lead_ms), static_cast<uint16_t>(tail_ms));
    EXPECT_EQ(0u, images.Answers()) << lead_ms << ' ' << tail_ms;
    EXPECT_EQ(0u, images.simulation->server().decoder_counters().frames);
    EXPECT_GT(images.simulation->medium().counters().blocks, 0u);
  }
}

}  // namespace
}  // namespace pheromone::swarm
