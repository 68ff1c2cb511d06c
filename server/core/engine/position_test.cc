// A robot's position: as reported, converted from its frame, or from a tracker; and refusals there.

#include <gtest/gtest.h>

#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::Message;
using protocol::Reason;
using testing::Bench;
using testing::Deposit;
using testing::Hello;
using testing::MessageOf;
using testing::ReasonOf;
using testing::SameMessage;
using testing::Sense;
using testing::Trace;

constexpr uint8_t kStill = 2;  // the type that does not evaporate

Message SenseWide(uint8_t id, int32_t x, int32_t y, uint16_t heading = 0) {
  return MessageOf(protocol::SenseRequest{id, kStill, true, {x, y, heading}});
}
Message TraceWide(uint8_t id, uint8_t seq, int32_t x, int32_t y, uint16_t heading = 0) {
  return MessageOf(protocol::TraceRequest{id, kStill, true, seq, {x, y, heading}});
}

uint32_t QuantaAt(const Bench& bench, int32_t column, int32_t row) {
  return bench.engine.field().LevelOf(kStill, {column, row}, bench.now_ms) /
         field::kLevelsPerQuantum;
}

PoseObserved Seen(int64_t x_mm, int64_t y_mm, uint16_t heading = 0, uint32_t valid_ms = 1000) {
  return {0, 1, {{x_mm * 1000, y_mm * 1000}, heading}, valid_ms};
}

// Robot 1 on link 0, and pheromone at (5.2 m, 5.1 m).
class PositionTest : public ::testing::Test {
 protected:
  explicit PositionTest(const EngineConfig& config = testing::SmallConfig()) : bench_(config) {
    bench_.Handle(Hello(1, 1));
    bench_.Handle(Hello(2, 1));
    bench_.Handle(Deposit(2, 1, 5200, 5100, 8, kStill));
  }

  // What a robot without frame and tracker senses there.
  protocol::SenseAnswer Smelled(int32_t x, int32_t y, uint16_t heading) {
    protocol::SenseAnswer answer;
    EXPECT_TRUE(protocol::Decode(*bench_.Handle(Sense(2, x, y, heading, kStill)), &answer));
    return answer;
  }

  // Expects `request` to be answered as if the robot were there.
  void ExpectSmell(const Message& request, int32_t x, int32_t y, uint16_t heading) {
    const protocol::SenseAnswer expected = Smelled(x, y, heading);
    EXPECT_NE(expected.left, expected.right);
    const Message answer = bench_.Handle(request).value();
    protocol::SenseAnswer sensed;
    protocol::TraceAnswer traced;
    if (protocol::Decode(answer, &sensed)) {
      EXPECT_EQ(sensed.left, expected.left);
      EXPECT_EQ(sensed.right, expected.right);
    } else {
      ASSERT_TRUE(protocol::Decode(answer, &traced));
      EXPECT_EQ(traced.left, expected.left);
      EXPECT_EQ(traced.right, expected.right);
    }
  }

  Bench bench_;
};

using ObservedPoseTest = PositionTest;

TEST_F(ObservedPoseTest, TakesThePlaceOfTheReportedOneInEveryRequest) {
  bench_.Apply(Seen(5000, 5000, 2000));
  ExpectSmell(Sense(1, 1000, 1000, 40'000, kStill), 5000, 5000, 2000);
  ExpectSmell(SenseWide(1, 1000, 1000, 40'000), 5000, 5000, 2000);
  ExpectSmell(Trace(1, 1, 1000, 1000, 40'000, kStill), 5000, 5000, 2000);
  bench_.Apply(Seen(4900, 5000, 2000));
  ExpectSmell(TraceWide(1, 2, 1000, 1000, 40'000), 4900, 5000, 2000);
  bench_.Apply(Seen(3000, 2000, 2000));
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, 3, 1000, 1000, 5, kStill)), Reason::kNone);
  EXPECT_EQ(QuantaAt(bench_, 50, 50), 1u);
  EXPECT_EQ(QuantaAt(bench_, 49, 50), 1u);
  EXPECT_EQ(QuantaAt(bench_, 30, 20), 5u);
  EXPECT_EQ(QuantaAt(bench_, 10, 10), 0u);
}

TEST_F(ObservedPoseTest, IsForgottenWhenItsTimeIsOver) {
  bench_.Apply(Seen(5000, 5000, 0, 300));
  bench_.now_ms += 299;
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, 1, 1000, 1000, 1, kStill)), Reason::kNone);
  EXPECT_EQ(QuantaAt(bench_, 50, 50), 1u);
  ++bench_.now_ms;
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, 2, 1000, 1000, 1, kStill)), Reason::kNone);
  EXPECT_EQ(QuantaAt(bench_, 50, 50), 1u);
  EXPECT_EQ(QuantaAt(bench_, 10, 10), 1u);
}

TEST_F(ObservedPoseTest, CanBeTakenBack) {
  bench_.Apply(Seen(5000, 5000, 0, 100'000));
  bench_.Apply(Seen(5000, 5000, 0, 0));
  bench_.Handle(Deposit(1, 1, 1000, 1000, 1, kStill));
  EXPECT_EQ(QuantaAt(bench_, 10, 10), 1u);
}

TEST_F(ObservedPoseTest, OffTheMapIsOffTheMapWhateverTheRobotSays) {
  bench_.Apply(Seen(-1, 5000));
  EXPECT_EQ(bench_.HandleForReason(Sense(1, 5000, 5000, 0, kStill)), Reason::kOffTheMap);
  EXPECT_EQ(bench_.HandleForReason(Trace(1, 1, 5000, 5000, 0, kStill)), Reason::kOffTheMap);
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, 2, 5000, 5000, 1, kStill)), Reason::kOffTheMap);
  EXPECT_EQ(QuantaAt(bench_, 50, 50), 0u);
  bench_.Apply(Seen(5000, 5000));  // and the other way round
  EXPECT_EQ(bench_.HandleForReason(Sense(1, -1, 5000, 0, kStill)), Reason::kNone);
}

TEST_F(ObservedPoseTest, ConcernsOneRobotOfOneLink) {
  bench_.Handle(Hello(1, 1), 1);
  bench_.Apply(Seen(5000, 5000));
  bench_.Handle(Deposit(1, 1, 1000, 1000, 1, kStill), 1);
  EXPECT_EQ(QuantaAt(bench_, 10, 10), 1u);
}

TEST_F(ObservedPoseTest, OutlivesARestartOfTheRobotWhichStandsWhereItStood) {
  bench_.Apply(Seen(5000, 5000));
  bench_.Handle(Hello(1, 2));
  bench_.Handle(Deposit(1, 2, 1000, 1000, 1, kStill));
  EXPECT_EQ(QuantaAt(bench_, 50, 50), 1u);
}

TEST_F(ObservedPoseTest, OnlyRobotsThatSaidHelloInThisEpochAreTracked) {
  EXPECT_TRUE(bench_.engine.SaidHello(0, 1));
  EXPECT_FALSE(bench_.engine.SaidHello(0, 3));
  EXPECT_FALSE(bench_.engine.SaidHello(1, 1));
  EXPECT_FALSE(bench_.engine.SaidHello(9, 1));
  EngineConfig config = testing::SmallConfig();
  config.pose_unit_10um = 50;
  bench_.Apply(ConfigChanged{config, 8});
  EXPECT_FALSE(bench_.engine.SaidHello(0, 1));
}

// The hash covers each part of it, and its end.
TEST_F(ObservedPoseTest, IsStateAndCountsIntoItsHash) {
  std::vector<uint64_t> hashes = {bench_.engine.StateHash()};
  for (const PoseObserved& seen :
       {Seen(1, 2, 3, 4), Seen(9, 2, 3, 4), Seen(1, 9, 3, 4), Seen(1, 2, 9, 4), Seen(1, 2, 3, 9)}) {
    bench_.Apply(seen);
    for (const uint64_t before : hashes) {
      EXPECT_NE(bench_.engine.StateHash(), before);
    }
    hashes.push_back(bench_.engine.StateHash());
  }
  bench_.Apply(Seen(1, 2, 3, 4));
  EXPECT_EQ(bench_.engine.StateHash(), hashes[1]);
}

TEST_F(ObservedPoseTest, ARepeatedTraceGetsTheAnswerOfItsFirstPlace) {
  bench_.Apply(Seen(5000, 5000, 2000));
  const auto first = bench_.Handle(Trace(1, 1, 1000, 1000, 0, kStill));
  bench_.Apply(Seen(4000, 4000, 2000));
  const auto second = bench_.Handle(Trace(1, 1, 1000, 1000, 0, kStill));
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(SameMessage(*first, *second));
  EXPECT_EQ(QuantaAt(bench_, 40, 40), 0u);
}

// Robot 1 was switched on at (6 m, 4 m), facing +y.
class FrameTest : public PositionTest {
 protected:
  FrameTest() : PositionTest(Config()) {}
  static EngineConfig Config() {
    EngineConfig config = testing::SmallConfig();
    config.frames = {MakeFrame("radio-a", 1, {6'000'000, 4'000'000}, 90)};
    return config;
  }
};

// In its own coordinates, (1 m, 1 m) is one metre ahead and one to the left.
TEST_F(FrameTest, WhatARobotReportsIsTurnedAndMovedOntoTheMap) {
  ExpectSmell(Sense(1, 1000, 1000, 51'152, kStill), 5000, 5000, 2000);
  ExpectSmell(SenseWide(1, 1000, 1000, 51'152), 5000, 5000, 2000);
  ExpectSmell(Trace(1, 1, 1000, 1000, 51'152, kStill), 5000, 5000, 2000);
  bench_.Handle(Deposit(1, 2, 2000, 3000, 5, kStill));
  EXPECT_EQ(QuantaAt(bench_, 50, 50), 1u);
  EXPECT_EQ(QuantaAt(bench_, 30, 60), 5u);
}

TEST_F(FrameTest, ThePlaceOnTheMapDecidesWhetherItIsOnTheMap) {
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, 1, -4000, -4000, 1, kStill)), Reason::kNone);
  EXPECT_EQ(QuantaAt(bench_, 100, 0), 1u);
  EXPECT_EQ(bench_.HandleForReason(Sense(1, -4001, 0, 0, kStill)), Reason::kOffTheMap);
  EXPECT_EQ(bench_.HandleForReason(Trace(1, 2, 6001, 0, 0, kStill)), Reason::kOffTheMap);
}

TEST_F(FrameTest, BelongsToOneRobotOfOneLink) {
  bench_.Handle(Hello(1, 1), 1);
  bench_.Handle(Deposit(1, 1, 1000, 1000, 1, kStill), 1);
  bench_.Handle(Deposit(2, 2, 2000, 1000, 1, kStill));
  EXPECT_EQ(QuantaAt(bench_, 10, 10), 1u);
  EXPECT_EQ(QuantaAt(bench_, 20, 10), 1u);
}

TEST_F(FrameTest, DoesNotTouchWhatATrackerSays) {
  bench_.Apply(Seen(5000, 5000, 2000));
  ExpectSmell(Sense(1, 1000, 1000, 0, kStill), 5000, 5000, 2000);
}

TEST_F(FrameTest, AnotherOneIsAnEventButNoEpoch) {
  const uint64_t hash = bench_.engine.StateHash();
  EngineConfig config = Config();
  config.frames[0].x_um -= 1'000'000;
  ASSERT_TRUE(bench_.engine.CheckConfig(config).ok());
  bench_.Apply(ConfigChanged{config, 8});
  EXPECT_NE(bench_.engine.StateHash(), hash);
  EXPECT_EQ(bench_.engine.epoch(), 7);
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, 1, 1000, 1000, 1, kStill)), Reason::kNone);
  EXPECT_EQ(QuantaAt(bench_, 40, 50), 1u);
}

TEST_F(FrameTest, AWrongOneIsRefusedWithTheConfiguration) {
  EngineConfig config = Config();
  config.frames[0].cos_q30 = 1 << 29;
  EXPECT_FALSE(bench_.engine.CheckConfig(config).ok());
  EXPECT_FALSE(Engine().CheckConfig(config).ok());
}

// A wall along y = 3 m, and a blend of both types.
class RefusalTest : public PositionTest {
 protected:
  RefusalTest() : PositionTest(Config()) {}
  static EngineConfig Config() {
    EngineConfig config = testing::SmallConfig();
    field::ObstacleMask mask(config.field.map.columns(), config.field.map.rows());
    mask.BlockRow(30, 0, 100);
    config.field.obstacles = field::Shared(std::move(mask));
    field::PheromoneLaw blend;
    blend.type = 3;
    blend.name = "both";
    blend.blend = {{1, 1000}, {2, 1000}};
    config.field.pheromones.push_back(blend);
    return config;
  }
};

TEST_F(RefusalTest, NothingIsLeftWhereAnObstacleIs) {
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, 1, 5000, 3000, 1, kStill)),
            Reason::kBlockedByObstacle);
  EXPECT_EQ(bench_.HandleForReason(Trace(1, 2, 5000, 3000, 0, kStill)), Reason::kBlockedByObstacle);
  EXPECT_EQ(bench_.HandleForReason(TraceWide(1, 3, 5000, 3000)), Reason::kBlockedByObstacle);
  EXPECT_EQ(bench_.HandleForReason(Sense(1, 5000, 3000, 0, kStill)), Reason::kNone);
  EXPECT_EQ(bench_.engine.field().node_count(), 1u);  // the one that lay there before
}

TEST_F(RefusalTest, NothingIsLeftOfABlendWhichCanBeSmelled) {
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, 1, 5000, 5000, 1, 3)), Reason::kNotPermitted);
  EXPECT_EQ(bench_.HandleForReason(Trace(1, 2, 5000, 5000, 0, 3)), Reason::kNotPermitted);
  EXPECT_EQ(bench_.HandleForReason(Sense(1, 5000, 5000, 0, 3)), Reason::kNone);
  EXPECT_EQ(bench_.engine.field().node_count(), 1u);
}

// protocol/README.md, "Exactly once": type, blend, position, value, obstacle, room.
TEST_F(RefusalTest, TheFirstOfSeveralReasonsIsTheOneOfTheSpecification) {
  uint8_t seq = 0;
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, ++seq, -1, 0, 0, 3)), Reason::kNotPermitted);
  EXPECT_EQ(bench_.HandleForReason(Trace(1, ++seq, -1, 0, 0, 3)), Reason::kNotPermitted);
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, ++seq, -1, 3000, 0, kStill)), Reason::kOffTheMap);
  EXPECT_EQ(bench_.HandleForReason(Deposit(1, ++seq, 5000, 3000, 0, kStill)), Reason::kBadValue);
}

TEST_F(RefusalTest, RefusalsAreFinalAnswersAndAreRepeated) {
  for (const Message& request : {Deposit(1, 1, 5000, 3000, 1, kStill), Trace(1, 2, 0, 0, 0, 3)}) {
    const auto first = bench_.Handle(request);
    const uint64_t hash = bench_.engine.StateHash();
    const auto second = bench_.Handle(request);
    ASSERT_TRUE(first && second);
    EXPECT_NE(ReasonOf(*first), Reason::kNone);
    EXPECT_TRUE(SameMessage(*first, *second));
    EXPECT_EQ(bench_.engine.StateHash(), hash);
  }
}

}  // namespace
}  // namespace pheromone::engine
