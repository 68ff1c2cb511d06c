// A robot with a net over the radio: lines, standing, halts, and the net's records exactly once in
// spite of lost frames, a silent server and resets.
#include "client_fw/core/tasks/forager.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "client_fw/core/testing/conversation_harness.h"
#include "client_fw/core/testing/naive_server.h"

namespace pheromone {
namespace client {
namespace {

using protocol::NetAction;

constexpr uint32_t kInstantMs = 200;

Parameters ForagingParameters() {
  Parameters parameters = TestParameters();
  PrepareForForaging(kRobotNet, &parameters);
  return parameters;
}

class ForagerTest : public testing::Test {
 protected:
  ForagerTest() { Start(RequestMemory(), 5000); }

  void Start(const RequestMemory& remembered, uint32_t now_ms) {
    const Parameters parameters = ForagingParameters();
    harness_ = std::make_unique<Harness>(parameters, now_ms, remembered);
    server_.hello = harness_->hello;
    server_.hello.type_mask = 0x007E;
    forager_ = std::make_unique<Forager>(kRobotNet, NetRobotParameters(), parameters.id,
                                         parameters.boot_counter, &net_memory_);
  }
  void Reset() {
    const RequestMemory memory = harness_->memory;
    const uint32_t now_ms = harness_->now_ms;
    Start(memory, now_ms + 30);
  }

  // A millisecond of the loop, as Robot has it.
  void Step() {
    const int before = harness_->frames_sent;
    harness_->Step();
    if (harness_->frames_sent != before) {
      ++frame_;
      if (serves_ && !loses_(2 * frame_)) {
        Answer();
      }
    }
    forager_->Step(harness_->now_ms, &harness_->pose, &harness_->conversation);
    if (harness_->now_ms % kInstantMs == 0) {
      bench_.Act();
    }
    const bool moves = !(Wheels() == kStill);
    moved_at_tag_ |= moves && !forager_->net_robot().drives();
    if (moves) {
      lines_.insert(harness_->conversation.state().parameters.type);
    }
  }
  void Run(uint32_t ms) {
    for (uint32_t i = 0; i < ms; ++i) {
      Step();
    }
  }

  WheelSpeeds Wheels() const { return forager_->Wheels(harness_->conversation); }
  const NetRobot& net_robot() const { return forager_->net_robot(); }

  void Answer() {
    if (const auto answer = server_.AnswerTo(harness_->sent); answer && !loses_(2 * frame_ + 1)) {
      harness_->Feed(*answer);
    }
  }

  void Command(protocol::CommandCode code) {
    protocol::Command command;
    command.id = kTestId;
    command.seq = ++command_seq_;
    command.code = code;
    harness_->FeedEncoded(command);
  }

  // Captures the tag, and goes on if it is let; stands there otherwise.
  bool Visit(const std::string& tag, uint32_t limit_ms = 20000) {
    bench_.in_range = {bench_.tag(tag)};
    const uint32_t before = net_robot().marking();
    bool passed = false;
    for (uint32_t i = 0; i < limit_ms && !passed; ++i) {
      Step();
      passed = net_robot().drives() && net_robot().marking() != before;
    }
    bench_.in_range.clear();
    for (uint32_t i = 0; i < limit_ms && passed && net_robot().state().tag != 0; ++i) {
      Step();
    }
    return passed;
  }

  void Advise(bool a) {
    bench_.at("P")->shown.state = a ? protocol::kNetAdviceA : protocol::kNetAdviceB;
    bench_.Show(bench_.at("P"));
  }

  void DriveTrip(bool a) {
    Advise(a);
    for (const std::string& tag : a ? TripA() : TripB()) {
      ASSERT_TRUE(Visit(tag)) << tag;
    }
  }

  void ExpectTrip(bool a, size_t from = 0) {
    const NetAction choice = a ? NetAction::kChooseA : NetAction::kChooseB;
    const NetAction store = a ? NetAction::kStoreA : NetAction::kStoreB;
    const std::vector<NetAction> expected = {NetAction::kPresent,
                                             NetAction::kPass,
                                             choice,
                                             NetAction::kLeave,
                                             NetAction::kPresent,
                                             NetAction::kPass,
                                             NetAction::kTake,
                                             NetAction::kLeave,
                                             NetAction::kPresent,
                                             NetAction::kPass,
                                             store,
                                             NetAction::kLeave};
    std::vector<NetAction> told;
    for (size_t i = from; i < bench_.handled.size(); ++i) {
      told.push_back(bench_.handled[i].action);
    }
    EXPECT_EQ(expected, told);
    EXPECT_EQ(1u, net_robot().marking());
    EXPECT_FALSE(moved_at_tag_);
    EXPECT_EQ(0u, net_robot().counters().exceptions);
  }

  NaiveServer server_;
  NaiveBench& bench_ = server_.bench;
  NetMemory net_memory_ = {};
  std::unique_ptr<Harness> harness_;
  std::unique_ptr<Forager> forager_;
  std::vector<protocol::EventReport>& events_ = server_.events;
  std::function<bool(int)> loses_ = [](int) { return false; };  // a frame, by its number
  bool serves_ = true;
  bool moved_at_tag_ = false;
  std::set<int> lines_;  // along which it has driven
  int frame_ = 0;
  uint8_t command_seq_ = 0;
};

TEST_F(ForagerTest, FollowsTheLineOfItsPlaceAndStandsAtTags) {
  Run(1000);
  EXPECT_EQ(kStraight, Wheels());
  EXPECT_EQ(1, harness_->conversation.state().parameters.type);
  DriveTrip(true);
  ExpectTrip(true);
  EXPECT_EQ((std::set<int>{1, 2, 3, 6}), lines_);
  lines_.clear();
  const size_t handled = bench_.handled.size();
  DriveTrip(false);
  ExpectTrip(false, handled);
  EXPECT_EQ((std::set<int>{1, 4, 5, 6}), lines_);
  EXPECT_TRUE(events_.empty());
}

// Otherwise it would set off by what it sensed of the last line.
TEST_F(ForagerTest, DrivesAlongAnotherLineWhenItHasItsIntensities) {
  Advise(true);
  Visit("N1");
  bench_.in_range = {bench_.tag("P")};
  bool sensed = false;
  for (int i = 0; i < 5000 && !sensed; ++i) {
    const uint32_t answers = harness_->counters().answers;
    const bool follows = harness_->conversation.state().parameters.type == 2;
    Step();
    sensed = follows && harness_->counters().answers != answers;
    if (follows && !sensed) {
      EXPECT_EQ(kStill, Wheels());
    }
  }
  EXPECT_TRUE(sensed);
  Run(300);
  EXPECT_EQ(kStraight, Wheels());
}

TEST_F(ForagerTest, HoldsTheLoadWhileItHasEnergy) {
  Advise(true);
  for (const char* tag : {"N1", "P", "N5", "S1"}) {
    EXPECT_TRUE(Visit(tag));
    EXPECT_FALSE(forager_->HoldsLoad());
  }
  for (const char* tag : {"Src", "S3", "N2"}) {
    EXPECT_TRUE(Visit(tag));
    EXPECT_TRUE(forager_->HoldsLoad());
  }
  EXPECT_TRUE(Visit("P"));
  EXPECT_FALSE(forager_->HoldsLoad());
}

TEST_F(ForagerTest, ExceptionHaltsTellsTheTagAndIsReleasedByACommand) {
  bench_.accepts = [&](const NaiveRecord&) { return bench_.handled.size() != 1; };
  EXPECT_FALSE(Visit("N1", 3000));
  EXPECT_EQ(NetFault::kRefused, net_robot().fault());
  EXPECT_TRUE((harness_->conversation.state().flags & kHalted) != 0);
  ASSERT_EQ(1u, events_.size());
  EXPECT_EQ(protocol::EventCode::kNetException, events_[0].code);
  EXPECT_EQ(bench_.tag("N1"), static_cast<uint16_t>(events_[0].argument));
  EXPECT_EQ(1u, net_robot().marking());
  const int requests = bench_.requests;
  Run(3000);
  EXPECT_EQ(requests, bench_.requests);
  EXPECT_EQ(1u, events_.size());

  Command(protocol::CommandCode::kResume);
  EXPECT_TRUE(Visit("N1"));
  EXPECT_EQ(2u, net_robot().marking());
  EXPECT_EQ(NetFault::kNone, net_robot().fault());
  EXPECT_EQ(1u, events_.size());
}

TEST_F(ForagerTest, ResetDoesNotReleaseARobotWithAnException) {
  bench_.accepts = [&](const NaiveRecord&) { return bench_.handled.size() != 1; };
  EXPECT_FALSE(Visit("N1", 3000));
  bench_.in_range = {bench_.tag("N1")};
  Reset();
  Run(5000);
  EXPECT_EQ(1u, bench_.handled.size());
  EXPECT_EQ(kStill, Wheels());
  Command(protocol::CommandCode::kResume);
  EXPECT_TRUE(Visit("N1"));
}

TEST_F(ForagerTest, AHaltedRobotGoesOnWhereItWasStopped) {
  bench_.shows_green = false;
  EXPECT_FALSE(Visit("N1", 3000));
  bench_.in_range = {bench_.tag("N1")};
  Command(protocol::CommandCode::kHalt);
  Run(500);
  bench_.at("N1")->shown.state = protocol::kNetGreen;
  Run(3000);
  EXPECT_EQ(1u, bench_.handled.size()) << "it has passed";
  Command(protocol::CommandCode::kResume);
  Run(3000);
  EXPECT_TRUE(net_robot().drives());
  EXPECT_EQ(2u, bench_.handled.size());
}

TEST_F(ForagerTest, LineThatTheServerDoesNotHaveStopsIt) {
  server_.hello.type_mask = 0x0006;
  Advise(false);
  Visit("N1");
  Visit("P");
  Run(2000);
  EXPECT_TRUE((harness_->conversation.state().flags & kTypeMissing) != 0);
  EXPECT_EQ(kStill, Wheels());
}

TEST_F(ForagerTest, LostFramesLoseAndRepeatNothing) {
  for (const int percent : {10, 30, 50}) {
    SCOPED_TRACE(percent);
    std::mt19937 random(static_cast<unsigned>(percent));
    loses_ = [&](int) { return static_cast<int>(random() % 100) < percent; };
    const size_t handled = bench_.handled.size();
    DriveTrip(percent != 30);
    ExpectTrip(percent != 30, handled);
  }
}

TEST_F(ForagerTest, SilentServerIsAwaited) {
  for (uint32_t at_ms = 500; at_ms < 14000; at_ms += 370) {
    SCOPED_TRACE(at_ms);
    server_ = NaiveServer();
    net_memory_ = NetMemory();
    Start(RequestMemory(), 5000);
    Advise(true);
    for (const std::string& tag : TripA()) {
      bench_.in_range = {bench_.tag(tag)};
      const uint32_t before = net_robot().marking();
      bool passed = false;
      for (int i = 0; i < 30000 && !passed; ++i) {
        serves_ = harness_->now_ms < 5000 + at_ms || harness_->now_ms > 5000 + at_ms + 4000;
        Step();
        if (harness_->now_ms == 5000 + at_ms + 3000) {
          EXPECT_EQ(kStill, Wheels());
        }
        passed = net_robot().drives() && net_robot().marking() != before;
      }
      ASSERT_TRUE(passed) << tag;
      bench_.in_range.clear();
      for (int i = 0; i < 30000 && net_robot().state().tag != 0; ++i) {
        serves_ = harness_->now_ms < 5000 + at_ms || harness_->now_ms > 5000 + at_ms + 4000;
        Step();
      }
    }
    ExpectTrip(true);
  }
}

TEST_F(ForagerTest, ResetsLoseAndRepeatNothing) {
  std::mt19937 random(3);
  int resets = 0;
  for (int round = 0; round < 25; ++round) {
    SCOPED_TRACE(round);
    const bool a = round % 2 == 0;
    const size_t handled = bench_.handled.size();
    Advise(a);
    bool chosen = false;
    for (const std::string& tag : a ? TripA() : TripB()) {
      bench_.in_range = {bench_.tag(tag)};
      const uint32_t before = net_robot().marking();
      bool passed = false;
      for (int i = 0; i < 60000 && !passed; ++i) {
        Step();
        if (random() % 700 == 0) {
          Reset();
          ++resets;
        }
        passed = net_robot().drives() && net_robot().marking() != before;
      }
      ASSERT_TRUE(passed) << tag;
      chosen |= tag == "P";
      bench_.in_range.clear();
      for (int i = 0; i < 30000 && net_robot().state().tag != 0; ++i) {
        Step();
      }
    }
    EXPECT_TRUE(chosen);
    ExpectTrip(a, handled);
  }
  EXPECT_GT(resets, 100);
}

}  // namespace
}  // namespace client
}  // namespace pheromone
