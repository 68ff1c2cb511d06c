// Every field of a robot changes its hash: a wrong state after a replay must not have the right
// hash.

#include "server/core/engine/robot_table.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>
#include <string>

#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::CommandCode;
using protocol::EventCode;
using Change = std::function<void(RobotState&)>;

// Does not compile once a field is added: it belongs in the hash, and below.
[[maybe_unused]] void NameEveryField(const RobotState& robot) {
  [[maybe_unused]] const auto& [epoch, hello, previous_nonce, last_opcode, last_seq, last_crc,
                                last_answer, last_change, last_activity, next_command_seq, command,
                                last_event, observed, goal] = robot;
  [[maybe_unused]] const auto& [outcome, sent_command, result, sent, next_retry_ms] = command;
  [[maybe_unused]] const auto& [id, seq, code, arguments] = sent_command;
  [[maybe_unused]] const auto& [event_id, event_seq, event_code, argument] = *last_event;
  [[maybe_unused]] const auto& [pose, until_ms] = *observed;
  [[maybe_unused]] const auto& [position, heading] = pose;
  [[maybe_unused]] const auto& [route, tolerance_um] = *goal;
}

EngineConfig WithLinks(std::vector<LinkSettings> links) {
  EngineConfig config;
  config.links = std::move(links);
  return config;
}

// No field has its default value.
RobotState FullRobot() {
  RobotState robot;
  robot.epoch = 7;
  robot.previous_nonce = 2'000;
  robot.hello = {1, 1'000, 3, 1};
  robot.last_opcode = 0x20;
  robot.last_seq = 30;
  robot.last_crc = 4'000;
  robot.last_answer = testing::Deposit(1, 30);
  robot.last_change = 50;
  robot.last_activity = 60;
  robot.next_command_seq = 70;
  robot.command.outcome = CommandOutcome::kPending;
  robot.command.command = {1, 69, CommandCode::kSetParameter, {1, 2, 3, 4, 5}};
  robot.command.result = 8;
  robot.command.sent = 2;
  robot.command.next_retry_ms = 9'000;
  robot.last_event = protocol::EventReport{1, 10, EventCode::kLoadPicked, 11};
  robot.observed = ObservedPose{{{120, 130}, 140}, 15'000};
  robot.goal = Goal{{{160, 170}, {180, 190}}, 20'000};
  return robot;
}

void ChangeHello(RobotState* robot, uint8_t at) {
  protocol::Message hello;
  Encode(robot->hello, &hello);
  ASSERT_LT(at, hello.length);
  ++hello.data[at];
  Decode(hello, &robot->hello);
}

std::map<std::string, Change> EveryChange() {
  using R = RobotState;
  std::map<std::string, Change> changes = {
      {"epoch", [](R& r) { ++r.epoch; }},
      {"nonce", [](R& r) { ++r.hello.nonce; }},
      {"previous nonce", [](R& r) { ++*r.previous_nonce; }},
      {"no previous nonce", [](R& r) { r.previous_nonce.reset(); }},
      {"previous nonce 0", [](R& r) { r.previous_nonce = 0; }},
      {"HELLO's first byte", [](R& r) { ChangeHello(&r, kBehindNonce); }},
      {"HELLO's second byte", [](R& r) { ChangeHello(&r, kBehindNonce + 1); }},
      {"last opcode", [](R& r) { ++r.last_opcode; }},
      {"last seq", [](R& r) { ++r.last_seq; }},
      {"last crc", [](R& r) { ++r.last_crc; }},
      {"answer's id", [](R& r) { ++r.last_answer.id; }},
      {"answer's opcode", [](R& r) { ++r.last_answer.opcode; }},
      {"answer's length", [](R& r) { --r.last_answer.length; }},
      {"last change", [](R& r) { ++r.last_change; }},
      {"last activity", [](R& r) { ++r.last_activity; }},
      {"next command seq", [](R& r) { ++r.next_command_seq; }},
      {"outcome", [](R& r) { r.command.outcome = CommandOutcome::kAccepted; }},
      {"command's id", [](R& r) { ++r.command.command.id; }},
      {"command's seq", [](R& r) { ++r.command.command.seq; }},
      {"command's code", [](R& r) { r.command.command.code = CommandCode::kHalt; }},
      {"result", [](R& r) { r.command.result = -8; }},
      {"sent", [](R& r) { ++r.command.sent; }},
      {"next retry", [](R& r) { ++r.command.next_retry_ms; }},
      {"no event", [](R& r) { r.last_event.reset(); }},
      {"event's seq", [](R& r) { ++r.last_event->seq; }},
      {"event's code", [](R& r) { r.last_event->code = EventCode::kBatteryLow; }},
      {"event's argument", [](R& r) { r.last_event->argument = -11; }},
      {"not observed", [](R& r) { r.observed.reset(); }},
      {"observed x", [](R& r) { ++r.observed->pose.position.x; }},
      {"observed y", [](R& r) { ++r.observed->pose.position.y; }},
      {"observed heading", [](R& r) { ++r.observed->pose.heading; }},
      {"observed until", [](R& r) { ++r.observed->until_ms; }},
      {"no goal", [](R& r) { r.goal.reset(); }},
      {"goal's x", [](R& r) { ++r.goal->route[1].x; }},
      {"goal's y", [](R& r) { ++r.goal->route[1].y; }},
      {"route's x", [](R& r) { ++r.goal->route[0].x; }},
      {"shorter route", [](R& r) { r.goal->route.pop_back(); }},
      {"tolerance", [](R& r) { ++r.goal->tolerance_um; }},
  };
  for (uint8_t i = 0; i < FullRobot().last_answer.length; ++i) {
    changes["answer's byte " + std::to_string(i)] = [i](R& r) { ++r.last_answer.data[i]; };
  }
  for (uint8_t i = 0; i < protocol::kMaxCommandArguments; ++i) {
    changes["argument " + std::to_string(i)] = [i](R& r) { r.command.command.arguments[i] = 99; };
  }
  return changes;
}

TEST(RobotHash, TellsEveryFieldFromEveryOther) {
  std::set<uint64_t> hashes = {RobotTable::Hash("radio-a", 1, FullRobot())};
  EXPECT_TRUE(hashes.insert(RobotTable::Hash("radio-b", 1, FullRobot())).second);
  EXPECT_TRUE(hashes.insert(RobotTable::Hash("radio-a", 2, FullRobot())).second);
  for (const auto& [name, change] : EveryChange()) {
    RobotState robot = FullRobot();
    change(robot);
    EXPECT_TRUE(hashes.insert(RobotTable::Hash("radio-a", 1, robot)).second) << name;
  }
}

TEST(RobotTable, ItsHashFollowsEveryChange) {
  RobotTable table;
  table.Configure(WithLinks({{"radio-a", 1, 2}, {"radio-b", 1, 2}}));
  uint64_t expected = 0;
  for (LinkIndex link = 0; link < 2; ++link) {
    table.Update(link, 1, [](RobotState& robot) { robot = FullRobot(); });
    expected += RobotTable::Hash(link == 0 ? "radio-a" : "radio-b", 1, FullRobot());
    EXPECT_EQ(table.hash(), expected);
  }
  for (const auto& [name, change] : EveryChange()) {
    RobotTable changed;
    changed.Configure(WithLinks({{"radio-a", 1, 2}}));
    RobotState robot = FullRobot();
    changed.Update(0, 1, [&](RobotState& it) { it = robot; });
    changed.Update(0, 1, change);
    change(robot);
    EXPECT_EQ(changed.hash(), RobotTable::Hash("radio-a", 1, robot)) << name;
    EXPECT_EQ(changed.pending_commands(), robot.has_pending_command() ? 1u : 0u) << name;
  }
  table.ForgetAsMutant(0, 1);
  EXPECT_EQ(table.hash(), RobotTable::Hash("radio-b", 1, FullRobot()));
}

// The parts of the engine's own hash, one by one.
TEST(StateHash, TellsEpochsAndHaltsToAllApart) {
  const auto halt_at = [](testing::Bench* bench, uint64_t now_ms, LinkIndex link) {
    CommandIssued halt;
    halt.link = link;
    halt.id = protocol::kBroadcastId;
    bench->now_ms = now_ms;
    bench->Apply(halt);
  };
  const auto hash_after = [&](uint64_t now_ms, LinkIndex link, std::vector<uint64_t> advances) {
    testing::Bench bench;
    halt_at(&bench, now_ms, link);
    for (const uint64_t at_ms : advances) {
      bench.now_ms = at_ms;
      bench.Apply(Advance{});
    }
    return bench.engine.StateHash();
  };
  std::set<uint64_t> hashes = {testing::Bench().engine.StateHash()};
  const auto is_new = [&](uint64_t hash) { return hashes.insert(hash).second; };
  EXPECT_TRUE(is_new(testing::Bench(testing::SmallConfig(), 8).engine.StateHash())) << "epoch";
  EXPECT_TRUE(is_new(hash_after(1'100, 0, {})));
  EXPECT_TRUE(is_new(hash_after(1'100, 1, {}))) << "link";
  EXPECT_TRUE(is_new(hash_after(1'150, 0, {}))) << "when it is sent again";
  EXPECT_TRUE(is_new(hash_after(1'000, 0, {1'100}))) << "how often it is sent again";
  EXPECT_TRUE(is_new(hash_after(1'000, 0, {1'100, 1'200}))) << "the next one's seq";
}

}  // namespace
}  // namespace pheromone::engine
