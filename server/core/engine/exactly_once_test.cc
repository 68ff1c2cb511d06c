// Changes happen exactly once, whatever the radio loses, repeats or delays.

#include <gtest/gtest.h>

#include <random>

#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;
using testing::Bench;
using testing::Deposit;
using testing::Hello;
using testing::SameMessage;
using testing::Sense;
using testing::Trace;

uint64_t QuantaOnTheMap(const Bench& bench) {
  uint64_t sum = 0;
  bench.engine.field().ForEach([&](uint8_t, field::NodeIndex, field::NodeState state) {
    sum += state.level / field::kLevelsPerQuantum;
  });
  return sum;
}

protocol::HelloAnswer Greet(Bench* bench, uint8_t id, uint16_t nonce) {
  protocol::HelloAnswer answer;
  const auto message = bench->Handle(Hello(id, nonce));
  EXPECT_TRUE(message && protocol::Decode(*message, &answer));
  return answer;
}

TEST(CompareSeq, FollowsTheTableOfTheSpecification) {
  RobotState robot;
  robot.last_crc = 77;
  for (int last = 0; last < 256; ++last) {
    robot.last_seq = static_cast<uint8_t>(last);
    EXPECT_EQ(CompareSeq(robot, robot.last_seq, 77), SeqVerdict::kRepeat);
    EXPECT_EQ(CompareSeq(robot, robot.last_seq, 78), SeqVerdict::kReused);
    for (int behind = 1; behind <= 127; ++behind) {
      EXPECT_EQ(CompareSeq(robot, static_cast<uint8_t>(last - behind), 77), SeqVerdict::kStale);
    }
    for (int ahead = 1; ahead <= 128; ++ahead) {
      EXPECT_EQ(CompareSeq(robot, static_cast<uint8_t>(last + ahead), 77), SeqVerdict::kNew);
    }
  }
}

TEST(ExactlyOnce, AChangeBeforeHelloIsRefused) {
  Bench bench;
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 1)), Reason::kSayHello);
  EXPECT_EQ(bench.HandleForReason(Trace(1, 1)), Reason::kSayHello);
  EXPECT_EQ(QuantaOnTheMap(bench), 0u);
}

TEST(ExactlyOnce, ARepeatGetsTheStoredAnswerAndChangesNothing) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  const auto first = bench.Handle(Trace(1, 5));
  const uint64_t hash = bench.engine.StateHash();
  bench.now_ms += 100'000;
  const auto second = bench.Handle(Trace(1, 5));
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(SameMessage(*first, *second));
  EXPECT_EQ(bench.engine.StateHash(), hash);
  EXPECT_EQ(QuantaOnTheMap(bench), 1u);
}

TEST(ExactlyOnce, TheSameSeqWithOtherContentIsRefused) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  bench.Handle(Deposit(1, 5));
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 5, 1000)), Reason::kSequenceReused);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 5)), Reason::kNone);  // the stored one is still there
  EXPECT_EQ(QuantaOnTheMap(bench), 1u);
}

TEST(ExactlyOnce, AnOldSeqIsDropped) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  bench.Handle(Deposit(1, 100));
  EXPECT_FALSE(bench.Handle(Deposit(1, 99)).has_value());
  EXPECT_FALSE(bench.Handle(Deposit(1, 229)).has_value());
  EXPECT_TRUE(bench.Handle(Deposit(1, 228)).has_value());  // 128 ahead
  EXPECT_EQ(QuantaOnTheMap(bench), 2u);
}

TEST(ExactlyOnce, PermanentRefusalsAreStoredToo) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 5, -1)), Reason::kOffTheMap);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 5, -1)), Reason::kOffTheMap);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 5)), Reason::kSequenceReused);
}

TEST(ExactlyOnce, ABadLengthNeverEntersTheMemory) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  protocol::Message bad = Deposit(1, 5);
  --bad.length;
  EXPECT_EQ(bench.HandleForReason(bad), Reason::kBadLength);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 5)), Reason::kNone);
  EXPECT_EQ(QuantaOnTheMap(bench), 1u);
}

TEST(ExactlyOnce, DepositTraceAndEventShareOneCounter) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  bench.Handle(Deposit(1, 5));
  EXPECT_EQ(bench.HandleForReason(Trace(1, 5)), Reason::kSequenceReused);
  const auto event =
      testing::MessageOf(protocol::EventReport{1, 5, protocol::EventCode::kTrailLost, 0});
  EXPECT_EQ(bench.HandleForReason(event), Reason::kSequenceReused);
}

TEST(ExactlyOnce, RobotsOfOtherIdsAndLinksAreOthers) {
  Bench bench;
  for (const LinkIndex link : {LinkIndex{0}, LinkIndex{1}}) {
    for (const uint8_t id : {uint8_t{1}, uint8_t{254}}) {
      bench.Handle(Hello(id, 1), link);
      EXPECT_EQ(bench.HandleForReason(Deposit(id, 5), link), Reason::kNone);
    }
  }
  EXPECT_EQ(QuantaOnTheMap(bench), 4u);
}

TEST(Hello, ReportsTheLastChangeAndAWarmRestartKeepsIt) {
  Bench bench;
  bench.Handle(Hello(1, 9));
  bench.Handle(Trace(1, 33));
  protocol::HelloAnswer answer;
  ASSERT_TRUE(protocol::Decode(*bench.Handle(Hello(1, 9)), &answer));
  EXPECT_EQ(answer.last_opcode, 0x31);
  EXPECT_EQ(answer.last_seq, 33);
  bench.Handle(Trace(1, 33));
  EXPECT_EQ(QuantaOnTheMap(bench), 1u);  // still a repeat
}

TEST(Hello, AnUnknownRobotBeginsAfterZero) {
  Bench bench;
  const protocol::HelloAnswer answer = Greet(&bench, 1, 9);
  EXPECT_EQ(answer.last_opcode, 0);
  EXPECT_EQ(answer.last_seq, 0);
  EXPECT_FALSE(bench.Handle(Deposit(1, 255)).has_value());
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 0)), Reason::kSequenceReused);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 1)), Reason::kNone);
  EXPECT_EQ(QuantaOnTheMap(bench), 1u);
}

TEST(Hello, ANewNonceTakesTheNextNumber) {
  Bench bench;
  Greet(&bench, 1, 9);
  bench.Handle(Trace(1, 33));
  protocol::HelloAnswer answer = Greet(&bench, 1, 10);
  EXPECT_EQ(answer.last_opcode, 0x31);
  EXPECT_EQ(answer.last_seq, 34);
  answer = Greet(&bench, 1, 10);  // its answer was lost
  EXPECT_EQ(answer.last_seq, 34);
  bench.Handle(Trace(1, 34));
  EXPECT_EQ(Greet(&bench, 1, 11).last_seq, 35);
  bench.Handle(Trace(1, 36));
  EXPECT_EQ(QuantaOnTheMap(bench), 2u);
}

// A network may deliver after the boot what was sent before: requests that were executed, and the
// last one, which perhaps was not.
TEST(Hello, RequestsFromBeforeTheBootAreNotExecutedAfterIt) {
  Bench bench;
  Greet(&bench, 1, 9);
  bench.Handle(Trace(1, 33));
  Greet(&bench, 1, 10);
  EXPECT_FALSE(bench.Handle(Trace(1, 32)).has_value());
  EXPECT_FALSE(bench.Handle(Trace(1, 33)).has_value());
  EXPECT_EQ(bench.HandleForReason(Trace(1, 34)), Reason::kSequenceReused);
  EXPECT_EQ(QuantaOnTheMap(bench), 1u);
  EXPECT_EQ(bench.HandleForReason(Trace(1, 35)), Reason::kNone);
  EXPECT_EQ(QuantaOnTheMap(bench), 2u);
}

TEST(Hello, ALateOneOfTheBootBeforeTakesNoNumberAndForgetsNothing) {
  Bench bench;
  Greet(&bench, 1, 9);
  Greet(&bench, 1, 10);
  const auto first = bench.Handle(Trace(1, 2));
  EXPECT_EQ(Greet(&bench, 1, 9).last_seq, 2);
  const auto second = bench.Handle(Trace(1, 2));
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(SameMessage(*first, *second));
  EXPECT_EQ(Greet(&bench, 1, 10).last_seq, 2);
  EXPECT_EQ(QuantaOnTheMap(bench), 1u);
}

TEST(Hello, TheNumbersGoRound) {
  Bench bench;
  Greet(&bench, 1, 1);
  Greet(&bench, 1, 2);
  bench.Handle(Trace(1, 128));
  bench.Handle(Trace(1, 255));
  EXPECT_EQ(Greet(&bench, 1, 3).last_seq, 0);
  EXPECT_EQ(bench.HandleForReason(Trace(1, 0)), Reason::kSequenceReused);
  EXPECT_EQ(bench.HandleForReason(Trace(1, 1)), Reason::kNone);
}

TEST(Hello, TellsWhatAClientMustKnow) {
  Bench bench(testing::SmallConfig(), 0xBEEF);
  protocol::HelloAnswer answer;
  ASSERT_TRUE(protocol::Decode(*bench.Handle(Hello(3, 0x1234), 1), &answer));
  EXPECT_EQ(answer.id, 3);
  EXPECT_EQ(answer.nonce, 0x1234);
  EXPECT_EQ(answer.protocol_version, 1);
  EXPECT_EQ(answer.epoch, 0xBEEF);
  EXPECT_EQ(answer.pose_unit_10um, 100);
  EXPECT_EQ(answer.antenna_distance_mm, 330);
  EXPECT_EQ(answer.type_mask, (1u << 1) | (1u << 2));
  EXPECT_EQ(answer.slot_ms, 4);
  EXPECT_EQ(answer.response_window_ms, 50);
}

TEST(Hello, TwoNoncesTakingTurnsAreAnIdConflict) {
  Bench bench;
  bench.Handle(Hello(1, 100));
  bench.Handle(Hello(1, 101));
  EXPECT_EQ(bench.engine.counters().id_conflicts, 0u);
  bench.Handle(Hello(1, 100));
  bench.Handle(Hello(1, 101));
  EXPECT_EQ(bench.engine.counters().id_conflicts, 2u);
}

TEST(Hello, NoRobotIsForgottenForAnother) {
  Bench bench;
  for (int id = 1; id <= 254; ++id) {
    Greet(&bench, static_cast<uint8_t>(id), 1);
  }
  for (int id = 1; id <= 254; ++id) {
    EXPECT_EQ(bench.HandleForReason(Deposit(static_cast<uint8_t>(id), 1)), Reason::kNone) << id;
  }
}

TEST(Epoch, ChangesWithWhatHelloTellsAndRobotsMustAskAgain) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  bench.Handle(Deposit(1, 5));
  EngineConfig config = testing::SmallConfig();
  config.field.antennas.distance_um = 400'000;
  bench.Apply(ConfigChanged{config, 8});
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 6)), Reason::kSayHello);
  EXPECT_EQ(bench.HandleForReason(Sense(1)), Reason::kNone);
  bench.Handle(Hello(1, 1));
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 5)), Reason::kNone);
  EXPECT_EQ(QuantaOnTheMap(bench), 1u);  // the memory outlived the epoch: still a repeat
}

TEST(Epoch, StaysWhenAChangeDoesNotConcernTheClients) {
  Bench bench;
  bench.Handle(Hello(1, 1));
  EngineConfig config = testing::SmallConfig();
  config.field.pheromones[0].tau_ms = 1'000;
  bench.Apply(ConfigChanged{config, 8});
  EXPECT_EQ(bench.engine.epoch(), 7);
  EXPECT_EQ(bench.HandleForReason(Deposit(1, 6)), Reason::kNone);
}

// A client that retries until it is answered, over a channel that loses requests and answers and
// echoes old frames: in the end each of its deposits was made once.
TEST(ExactlyOnce, OverALossyChannelEachDepositIsMadeOnce) {
  std::mt19937 random(42);
  EngineConfig config = testing::SmallConfig();
  config.field.pheromones[1].max_count = 60'000;
  Bench bench(config);
  Greet(&bench, 1, 1);
  std::vector<protocol::Message> sent;
  constexpr int kDeposits = 2'000;
  for (int i = 0; i < kDeposits; ++i) {
    const protocol::Message request = Deposit(1, static_cast<uint8_t>(i + 1), 5000, 5000, 1, 2);
    sent.push_back(request);
    for (bool answered = false; !answered;) {
      bench.now_ms += 10;
      if (random() % 3 == 0) {  // an echo from at most 100 requests ago
        const size_t age = 1 + random() % 100;
        if (age < sent.size()) {
          bench.Handle(sent[sent.size() - 1 - age]);
        }
      }
      if (random() % 2 == 0) {
        continue;  // the request was lost
      }
      const auto answer = bench.Handle(request);
      answered = answer.has_value() && random() % 2 == 0;
    }
  }
  EXPECT_EQ(QuantaOnTheMap(bench), static_cast<uint64_t>(kDeposits));
}

}  // namespace
}  // namespace pheromone::engine
