#include "client_fw/sim/radio_tally.h"

#include <gtest/gtest.h>

#include <memory>

#include "client_fw/sim/simulated_robot.h"
#include "client_fw/sim/testing/fake_server.h"

namespace pheromone::sim {
namespace {

constexpr int64_t kMs = 1'000'000;

// A modem beside a robot's that passes on what is on the air, both ways: the tally's view.
class Ear : public Station {
 public:
  explicit Ear(uint8_t id) : tally(id) {}
  void OnByte(uint8_t byte, int64_t time_ns) override {
    tally.OnSent(byte, time_ns);
    tally.OnHeard(byte, time_ns);
  }
  void OnTransmitted(int64_t /*time_ns*/) override {}
  RadioTally tally;
};

void Pass(const protocol::Message& message, RadioTally* tally,
          void (RadioTally::*to)(uint8_t, int64_t)) {
  for (const uint8_t byte : client::FrameOf(message)) {
    (tally->*to)(byte, 0);
  }
}

// The robot's own counters are the oracle: what the tally makes of the air has to agree.
class RadioTallyTest : public testing::TestWithParam<bool> {};

TEST_P(RadioTallyTest, CountsWhatTheRobotCounts) {
  RadioMedium medium({});
  FakeServer server(&medium);
  Ear ear(5);
  medium.AddStation(&ear);
  server.smell = [](const protocol::WirePose&) { return std::pair<int16_t, int16_t>{700, -30}; };
  SimulatedRobotConfig config;
  config.client.id = 5;
  config.client.boot_counter = 1;
  SimulatedRobot robot(config, &medium);
  config.client.id = 6;
  config.power_on_ms = 100;  // halfway through the other's period, so that nothing collides
  SimulatedRobot other(config, &medium);
  for (int ms = 0; ms < 9'950; ++ms) {
    server.silent = GetParam() && ms > 4'000 && ms < 6'000;
    medium.AdvanceTo(medium.now_ns() + kMs);
    server.Step();
    robot.Step();
    other.Step();
  }
  const client::Counters& truth = robot.counters();
  const client::Counters& told = ear.tally.counters();
  EXPECT_EQ(truth.requests, told.requests);
  EXPECT_EQ(truth.answers, told.answers);
  EXPECT_EQ(truth.hellos, told.hellos);
  EXPECT_EQ(truth.hello_answers, told.hello_answers);
  EXPECT_GT(told.answers, 30u);
  EXPECT_GT(told.heard, 30u);
  EXPECT_EQ(700, ear.tally.p_left());
  EXPECT_EQ(-30, ear.tally.p_right());
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutSilence, RadioTallyTest, testing::Bool());

// Its turn is the second; the next ROUND has the answer in the second place.
TEST(RadioTally, CountsTheAnswersInRounds) {
  RadioTally tally(7);
  protocol::Round round;
  round.number = 1;
  round.turn_count = 2;
  round.turns[0] = 3;
  round.turns[1] = 7;
  protocol::Message message;
  Encode(round, &message);
  Pass(message, &tally, &RadioTally::OnHeard);
  ASSERT_TRUE(Encode(protocol::SenseRequest{7, 1, false, {1, 2, 3}}, &message));
  Pass(message, &tally, &RadioTally::OnSent);
  round.number = 2;
  round.turn_count = 0;
  round.answer_count = 2;
  round.answers[0] = {1, 2};
  round.answers[1] = {30, -40};
  Encode(round, &message);
  Pass(message, &tally, &RadioTally::OnHeard);
  EXPECT_EQ(1u, tally.counters().answers);
  EXPECT_EQ(30, tally.p_left());
  EXPECT_EQ(-40, tally.p_right());
  Pass(message, &tally, &RadioTally::OnHeard);  // it has not asked again
  EXPECT_EQ(1u, tally.counters().answers);
  EXPECT_EQ(3u, tally.counters().rounds);
}

}  // namespace
}  // namespace pheromone::sim
