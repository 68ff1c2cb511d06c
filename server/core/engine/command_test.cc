#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::CommandCode;
using testing::Bench;

protocol::Command CommandIn(const Outgoing& sent) {
  protocol::Command command;
  EXPECT_TRUE(protocol::Decode(sent.message, &command));
  return command;
}

class CommandTest : public ::testing::Test {
 protected:
  struct Sent {
    uint64_t after_ms;  ///< since the wait began
    Outgoing out;
  };

  CommandTest() { bench_.Handle(testing::Hello(1, 1)); }

  std::vector<Outgoing> Issue(CommandCode code, LinkIndex link = 0) {
    CommandIssued issued;
    issued.link = link;
    issued.id = 1;
    issued.code = code;
    return bench_.Apply(issued);
  }

  std::vector<Outgoing> IssueHaltToAll(LinkIndex link = 0) {
    CommandIssued issued;
    issued.link = link;
    issued.id = protocol::kBroadcastId;
    return bench_.Apply(issued);
  }

  // Advances from deadline to deadline until nothing is due.
  std::vector<Sent> SentUntilIdle() {
    constexpr int kMaxSteps = 1'000;
    const uint64_t start_ms = bench_.now_ms;
    std::vector<Sent> sent;
    for (int step = 0; bench_.engine.NextDeadline(); ++step) {
      if (step == kMaxSteps) {
        ADD_FAILURE() << "something is still due after " << step << " steps";
        break;
      }
      bench_.now_ms = std::max(bench_.now_ms, *bench_.engine.NextDeadline());
      for (const Outgoing& out : bench_.Apply(Advance{})) {
        sent.push_back({bench_.now_ms - start_ms, out});
      }
    }
    return sent;
  }

  std::vector<uint64_t> SendTimesUntilIdle() {
    std::vector<uint64_t> times;
    for (const Sent& it : SentUntilIdle()) {
      times.push_back(it.after_ms);
    }
    return times;
  }

  std::vector<protocol::Command> CommandsUntilIdle() {
    std::vector<protocol::Command> commands;
    for (const Sent& it : SentUntilIdle()) {
      commands.push_back(CommandIn(it.out));
    }
    return commands;
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
  EXPECT_EQ(bench_.engine.NextDeadline(), bench_.now_ms + RobotsPart::kFirstRetryMs);
  bench_.Handle(Ack(command.seq));
  EXPECT_EQ(state().outcome, CommandOutcome::kAccepted);
  EXPECT_FALSE(bench_.engine.NextDeadline().has_value());
}

TEST_F(CommandTest, IsRetriedWithGrowingIntervalsAndThenReported) {
  const uint64_t start_ms = bench_.now_ms;
  Issue(CommandCode::kHalt);
  EXPECT_EQ(SendTimesUntilIdle(), (std::vector<uint64_t>{250, 750, 1750, 3750, 7750}));
  EXPECT_EQ(bench_.now_ms - start_ms, 11'750u);
  EXPECT_EQ(state().outcome, CommandOutcome::kUnanswered);
  EXPECT_EQ(state().sent, RobotsPart::kCommandTransmissions);
  EXPECT_EQ(state().next_retry_ms, 0u);
  EXPECT_EQ(bench_.engine.counters().commands_unanswered, 1u);
}

// Any number of times: the previous command must leave nothing behind.
TEST_F(CommandTest, EachCommandBeginsAnew) {
  for (uint8_t i = 0; i < 20; ++i) {
    const auto out = Issue(CommandCode::kHalt);
    ASSERT_EQ(out.size(), 1u) << int{i};
    EXPECT_EQ(CommandIn(out[0]).seq, i);
    EXPECT_EQ(state().outcome, CommandOutcome::kPending);
    EXPECT_EQ(state().sent, 1);
    EXPECT_EQ(state().next_retry_ms, bench_.now_ms + RobotsPart::kFirstRetryMs);
    EXPECT_EQ(state().result, 0);
    if (i % 3 != 0) {  // and some are never answered
      bench_.Handle(Ack(i, i % 3 == 1 ? 0 : 11));
      EXPECT_EQ(state().outcome, i % 3 == 1 ? CommandOutcome::kAccepted : CommandOutcome::kRefused);
      EXPECT_EQ(state().next_retry_ms, 0u);
    }
    bench_.now_ms += 5;
  }
  Issue(CommandCode::kHalt);
  EXPECT_EQ(SendTimesUntilIdle(), (std::vector<uint64_t>{250, 750, 1750, 3750, 7750}));
}

TEST_F(CommandTest, CarriesItsArgumentsEachTimeThatItIsSent) {
  const struct {
    CommandCode code;
    std::vector<uint8_t> arguments;
  } cases[] = {{CommandCode::kFollowType, {3}},
               {CommandCode::kSpeed, {0x34, 0x12}},
               {CommandCode::kGoTo, {1, 2, 3, 4}},
               {CommandCode::kSetParameter, {9, 8, 7, 6, 5}}};
  for (const auto& it : cases) {
    CommandIssued issued;
    issued.id = 1;
    issued.code = it.code;
    std::copy(it.arguments.begin(), it.arguments.end(), issued.arguments.begin());
    std::vector<Outgoing> out = bench_.Apply(issued);
    for (const Sent& again : SentUntilIdle()) {
      out.push_back(again.out);
    }
    ASSERT_EQ(out.size(), RobotsPart::kCommandTransmissions);
    for (const Outgoing& sent : out) {
      const protocol::Message& message = sent.message;
      EXPECT_EQ(message.id, 1);
      ASSERT_EQ(message.length, 2 + it.arguments.size());
      EXPECT_EQ(message.data[1], static_cast<uint8_t>(it.code));
      EXPECT_EQ(std::vector<uint8_t>(message.data + 2, message.data + message.length),
                it.arguments);
    }
  }
  // A command without arguments has none of the previous one's.
  Issue(CommandCode::kHalt);
  for (const uint8_t argument : state().command.arguments) {
    EXPECT_EQ(argument, 0);
  }
}

TEST_F(CommandTest, GoesOutOnTheLinkOfItsRobot) {
  bench_.Handle(testing::Hello(1, 1), 1);
  std::vector<Outgoing> out = Issue(CommandCode::kPickLoad, 1);
  for (const Sent& again : SentUntilIdle()) {
    out.push_back(again.out);
  }
  ASSERT_EQ(out.size(), RobotsPart::kCommandTransmissions);
  for (const Outgoing& sent : out) {
    EXPECT_EQ(sent.link, 1);
  }
  EXPECT_EQ(state().outcome, CommandOutcome::kNone);  // of its namesake on the other link
}

TEST_F(CommandTest, ALongGapIsOneRetry) {
  Issue(CommandCode::kHalt);
  bench_.now_ms += 3'600'000;
  EXPECT_EQ(bench_.Apply(Advance{}).size(), 1u);
  EXPECT_EQ(bench_.engine.NextDeadline(), bench_.now_ms + 2 * RobotsPart::kFirstRetryMs);
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
  std::vector<Sent> sent = {{0, IssueHaltToAll(1).at(0)}};
  const std::vector<Sent> later = SentUntilIdle();
  sent.insert(sent.end(), later.begin(), later.end());
  ASSERT_EQ(sent.size(), 3u);
  for (size_t i = 0; i < sent.size(); ++i) {
    EXPECT_EQ(sent[i].after_ms, i * RobotsPart::kBroadcastIntervalMs);
    EXPECT_EQ(sent[i].out.link, 1);
    EXPECT_EQ(sent[i].out.message.id, protocol::kBroadcastId);
    EXPECT_EQ(CommandIn(sent[i].out).code, CommandCode::kHalt);
  }
}

// By its seq a robot distinguishes a new halt from one that it has executed.
TEST_F(CommandTest, TheTransmissionsOfAHaltToAllShareASeqAndTheNextHasAnother) {
  for (uint8_t round = 0; round < 3; ++round) {
    Issue(CommandCode::kHalt);  // counts for itself
    bench_.Handle(Ack(round));
    std::vector<uint8_t> seqs = {CommandIn(IssueHaltToAll(round % 2).at(0)).seq};
    for (const protocol::Command& halt : CommandsUntilIdle()) {
      seqs.push_back(halt.seq);
    }
    EXPECT_EQ(seqs, std::vector<uint8_t>(3, round));
  }
}

TEST_F(CommandTest, TwoHaltsToAllAtOnceAreBothSentToTheEnd) {
  IssueHaltToAll();
  bench_.now_ms += 30;
  IssueHaltToAll();
  std::vector<std::pair<uint64_t, uint8_t>> sent;
  for (const Sent& it : SentUntilIdle()) {
    sent.emplace_back(it.after_ms, CommandIn(it.out).seq);
  }
  EXPECT_EQ(sent,
            (std::vector<std::pair<uint64_t, uint8_t>>{{70, 0}, {100, 1}, {170, 0}, {200, 1}}));
}

// A robot that missed the first still gets the others.
TEST_F(CommandTest, AReloadLeavesTheTransmissionsOfAHaltToAll) {
  IssueHaltToAll();
  EngineConfig next = testing::SmallConfig();
  next.field.pheromones[0].tau_ms = 60'000;
  bench_.Apply(ConfigChanged{next, 7});
  const std::vector<protocol::Command> sent = CommandsUntilIdle();
  ASSERT_EQ(sent.size(), RobotsPart::kBroadcastTransmissions - 1u);
  for (const protocol::Command& command : sent) {
    EXPECT_EQ(command.code, CommandCode::kHalt);
  }
}

// Robots obey each transmission of a halt: one after the resume would undo it.
TEST_F(CommandTest, AResumeIsSentAfterTheLastTransmissionOfAHaltToAll) {
  EXPECT_EQ(IssueHaltToAll().size(), 1u);
  bench_.now_ms += 30;
  EXPECT_TRUE(Issue(CommandCode::kResume).empty());
  const std::vector<protocol::Command> sent = CommandsUntilIdle();
  ASSERT_EQ(sent.size(), 2u + RobotsPart::kCommandTransmissions);
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
  const std::vector<protocol::Command> sent = CommandsUntilIdle();
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
  for (const protocol::Command& sent : CommandsUntilIdle()) {
    EXPECT_EQ(sent.code, CommandCode::kHalt);
  }
}

TEST_F(CommandTest, AHaltToAllLeavesOtherPendingCommands) {
  Issue(CommandCode::kPickLoad);
  IssueHaltToAll();
  EXPECT_EQ(state().outcome, CommandOutcome::kPending);
}

TEST_F(CommandTest, AHaltToAllOfALinkLeavesTheResumesOfOthers) {
  bench_.Handle(testing::Hello(1, 1), 1);
  Issue(CommandCode::kResume, 0);
  IssueHaltToAll(1);
  EXPECT_EQ(state().outcome, CommandOutcome::kPending);
  EXPECT_EQ(Issue(CommandCode::kResume, 0).size(), 1u);  // not delayed either
  EXPECT_TRUE(Issue(CommandCode::kResume, 1).empty());
}

TEST_F(CommandTest, AResumeThatWaitedIsSentAtTheLastTransmissionOfTheHalt) {
  IssueHaltToAll();
  bench_.now_ms += 30;
  Issue(CommandCode::kResume);
  std::vector<std::pair<uint64_t, CommandCode>> sent;
  for (const Sent& it : SentUntilIdle()) {
    sent.emplace_back(it.after_ms, CommandIn(it.out).code);
  }
  ASSERT_GE(sent.size(), 4u);
  sent.resize(4);
  EXPECT_EQ(sent, (std::vector<std::pair<uint64_t, CommandCode>>{{70, CommandCode::kHalt},
                                                                 {170, CommandCode::kHalt},
                                                                 {170, CommandCode::kResume},
                                                                 {420, CommandCode::kResume}}));
}

TEST_F(CommandTest, WhatCannotBeCommandedIsSaid) {
  CommandIssued issued;
  issued.id = 9;
  EXPECT_FALSE(bench_.engine.Check(issued).ok());  // never said HELLO
  issued.id = protocol::kBroadcastId;
  EXPECT_TRUE(bench_.engine.Check(issued).ok());
  issued.code = CommandCode::kResume;
  EXPECT_FALSE(bench_.engine.Check(issued).ok());  // only halt goes to all
  issued.id = 1;
  issued.link = 2;
  EXPECT_FALSE(bench_.engine.Check(issued).ok());
  issued.link = 0;
  issued.code = static_cast<CommandCode>(77);
  EXPECT_FALSE(bench_.engine.Check(issued).ok());
}

}  // namespace
}  // namespace pheromone::engine
