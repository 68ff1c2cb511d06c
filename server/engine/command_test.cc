#include <gtest/gtest.h>

#include "server/engine/engine.h"
#include "server/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::CommandCode;
using testing::Bench;

class CommandTest : public ::testing::Test {
 protected:
  CommandTest() { bench_.Handle(testing::Hello(1, 1)); }

  std::vector<Outgoing> Issue(CommandCode code) {
    CommandIssued issued;
    issued.id = 1;
    issued.code = code;
    return bench_.Apply(issued);
  }

  std::vector<Outgoing> IssueHaltToAll() {
    CommandIssued issued;
    issued.id = protocol::kBroadcastId;
    return bench_.Apply(issued);
  }

  std::vector<protocol::Command> AllThatIsSent();

  std::vector<Outgoing> AdvanceToDeadline() {
    bench_.now_ms = bench_.engine.NextDeadline().value_or(bench_.now_ms);
    return bench_.Apply(Advance{});
  }

  const CommandState& state() { return bench_.engine.robots().Find(0, 1)->command; }

  protocol::Message Ack(uint8_t seq, int16_t result = 0) {
    return testing::MessageOf(protocol::CommandAck{1, seq, CommandCode::kHalt, result});
  }

  Bench bench_;
};

TEST_F(CommandTest, IsSentAtOnceAndAwaitsItsAck) {
  const auto out = Issue(CommandCode::kHalt);
  ASSERT_EQ(out.size(), 1u);
  protocol::Command command;
  ASSERT_TRUE(protocol::Decode(out[0].message, &command));
  EXPECT_EQ(command.id, 1);
  EXPECT_EQ(command.code, CommandCode::kHalt);
  EXPECT_EQ(state().outcome, CommandOutcome::kPending);
  EXPECT_EQ(bench_.engine.NextDeadline(), bench_.now_ms + Engine::kFirstRetryMs);
  bench_.Handle(Ack(command.seq));
  EXPECT_EQ(state().outcome, CommandOutcome::kAccepted);
  EXPECT_FALSE(bench_.engine.NextDeadline().has_value());
}

TEST_F(CommandTest, IsRetriedWithGrowingIntervalsAndThenReported) {
  const uint64_t start = bench_.now_ms;
  Issue(CommandCode::kHalt);
  std::vector<uint64_t> times;
  while (bench_.engine.NextDeadline()) {
    if (!AdvanceToDeadline().empty()) {
      times.push_back(bench_.now_ms - start);
    }
  }
  EXPECT_EQ(times, (std::vector<uint64_t>{250, 750, 1750, 3750, 7750}));
  EXPECT_EQ(state().outcome, CommandOutcome::kUnanswered);
  EXPECT_EQ(bench_.engine.counters().commands_unanswered, 1u);
}

TEST_F(CommandTest, ALongGapIsOneRetry) {
  Issue(CommandCode::kHalt);
  bench_.now_ms += 3'600'000;
  EXPECT_EQ(bench_.Apply(Advance{}).size(), 1u);
  EXPECT_EQ(bench_.engine.NextDeadline(), bench_.now_ms + 2 * Engine::kFirstRetryMs);
}

TEST_F(CommandTest, ARefusalIsKeptWithItsReason) {
  Issue(CommandCode::kHalt);
  bench_.Handle(Ack(state().command.seq, 11));
  EXPECT_EQ(state().outcome, CommandOutcome::kRefused);
  EXPECT_EQ(state().result, 11);
}

TEST_F(CommandTest, AnAckOfAnotherCommandIsIgnored) {
  Issue(CommandCode::kHalt);
  const auto other = static_cast<uint8_t>(state().command.seq + 1);
  EXPECT_EQ(bench_.engine.Classify(0, Ack(other)), Handling::kIgnore);
  EXPECT_EQ(state().outcome, CommandOutcome::kPending);
}

TEST_F(CommandTest, ANewerCommandTakesThePlaceOfAPendingOne) {
  Issue(CommandCode::kResume);
  const uint8_t first = state().command.seq;
  Issue(CommandCode::kHalt);
  EXPECT_EQ(state().command.code, CommandCode::kHalt);
  EXPECT_EQ(state().command.seq, static_cast<uint8_t>(first + 1));
}

TEST_F(CommandTest, ARestartedRobotsCommandIsUnknownAndNotSentAgain) {
  Issue(CommandCode::kHalt);
  bench_.Handle(testing::Hello(1, 2));
  EXPECT_EQ(state().outcome, CommandOutcome::kUnknown);
  EXPECT_FALSE(bench_.engine.NextDeadline().has_value());
  EXPECT_EQ(bench_.engine.counters().commands_unknown, 1u);
}

TEST_F(CommandTest, HaltToAllIsSentThreeTimesWithoutAck) {
  size_t sent = IssueHaltToAll().size();
  while (bench_.engine.NextDeadline()) {
    for (const Outgoing& it : AdvanceToDeadline()) {
      EXPECT_EQ(it.message.id, protocol::kBroadcastId);
      ++sent;
    }
  }
  EXPECT_EQ(sent, 3u);
}

// Whatever is sent until nothing is due any more.
std::vector<protocol::Command> CommandTest::AllThatIsSent() {
  std::vector<protocol::Command> commands;
  while (bench_.engine.NextDeadline()) {
    for (const Outgoing& it : AdvanceToDeadline()) {
      EXPECT_TRUE(protocol::Decode(it.message, &commands.emplace_back()));
    }
  }
  return commands;
}

// Robots take the halt of each transmission: one after the resume would undo it.
TEST_F(CommandTest, AResumeIsSentAfterTheLastTransmissionOfAHaltToAll) {
  EXPECT_EQ(IssueHaltToAll().size(), 1u);
  bench_.now_ms += 30;
  EXPECT_TRUE(Issue(CommandCode::kResume).empty());
  const std::vector<protocol::Command> sent = AllThatIsSent();
  ASSERT_EQ(sent.size(), 2u + Engine::kCommandTransmissions);
  for (size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(sent[i].code, i < 2 ? CommandCode::kHalt : CommandCode::kResume) << i;
  }
}

TEST_F(CommandTest, AResumeWaitsForAHaltToAllThatIsSentLate) {
  IssueHaltToAll();
  Issue(CommandCode::kResume);
  bench_.now_ms += 3'600'000;
  const auto late = bench_.Apply(Advance{});  // the second of three, and all that was due
  ASSERT_EQ(late.size(), 1u);
  EXPECT_EQ(late[0].message.id, protocol::kBroadcastId);
  const std::vector<protocol::Command> sent = AllThatIsSent();
  ASSERT_GT(sent.size(), 1u);
  EXPECT_EQ(sent[0].code, CommandCode::kHalt);
  EXPECT_EQ(sent[1].code, CommandCode::kResume);
}

TEST_F(CommandTest, OtherCommandsDoNotWaitForAHaltToAll) {
  IssueHaltToAll();
  EXPECT_EQ(Issue(CommandCode::kHalt).size(), 1u);
  EXPECT_EQ(Issue(CommandCode::kPickLoad).size(), 1u);
}

TEST_F(CommandTest, AHaltToAllEndsAPendingResume) {
  Issue(CommandCode::kResume);
  IssueHaltToAll();
  EXPECT_EQ(state().outcome, CommandOutcome::kUnanswered);
  EXPECT_EQ(bench_.engine.counters().commands_unanswered, 1u);
  for (const protocol::Command& sent : AllThatIsSent()) {
    EXPECT_EQ(sent.code, CommandCode::kHalt);
  }
}

TEST_F(CommandTest, AHaltToAllLeavesOtherPendingCommands) {
  Issue(CommandCode::kPickLoad);
  IssueHaltToAll();
  EXPECT_EQ(state().outcome, CommandOutcome::kPending);
}

TEST_F(CommandTest, WhatCannotBeCommandedIsSaid) {
  CommandIssued issued;
  issued.id = 9;
  EXPECT_FALSE(bench_.engine.CheckCommand(issued).ok());  // never said HELLO
  issued.id = protocol::kBroadcastId;
  EXPECT_TRUE(bench_.engine.CheckCommand(issued).ok());
  issued.code = CommandCode::kResume;
  EXPECT_FALSE(bench_.engine.CheckCommand(issued).ok());  // only halt goes to all
  issued.id = 1;
  issued.link = 2;
  EXPECT_FALSE(bench_.engine.CheckCommand(issued).ok());
  issued.link = 0;
  issued.code = static_cast<CommandCode>(77);
  EXPECT_FALSE(bench_.engine.CheckCommand(issued).ok());
}

}  // namespace
}  // namespace pheromone::engine
