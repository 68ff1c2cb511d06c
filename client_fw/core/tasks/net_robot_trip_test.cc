// Round trips of a robot with a net: each record has its effect once, whatever happens on the way.
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "client_fw/core/testing/net_robot_harness.h"

namespace pheromone {
namespace client {
namespace {

// The records of two round trips, in spite of what happens on the way.
class NetRobotTripTest : public NetRobotTest {
 protected:
  // Calls `happens` after each turn of the robot, with its number, before anything is served.
  void DriveTrips(const std::function<void(int)>& happens) {
    int turn = 0;
    for (const bool a : {true, false}) {
      bool chosen = false;
      for (const std::string& tag : a ? TripA() : TripB()) {
        if (tag == "P" && !chosen) {
          chosen = true;
          Advise(a ? protocol::kNetAdviceA : protocol::kNetAdviceB);
        }
        bench_.in_range = {bench_.tag(tag)};
        const uint32_t before = robot_->marking();
        bool passed = false;
        for (int i = 0; i < 1500 && !passed; ++i) {
          Turn();
          happens(turn++);
          if (Asks()) {
            bench_.Serve(robot_->exchange());
          }
          if (now_ms_ % kPaceMs == kPaceMs / 2) {
            bench_.Act();
          }
          passed = robot_->drives() && robot_->marking() != before;
        }
        ASSERT_TRUE(passed) << tag;
        bench_.in_range.clear();
        Run(600);
      }
    }
    turns_ = turn;
  }

  void ExpectAllToldOnce() {
    std::vector<std::string> expected = kToldOfA;
    expected.insert(expected.end(), kToldOfB.begin(), kToldOfB.end());
    EXPECT_EQ(expected, Told());
    EXPECT_EQ(At(1), robot_->marking());
    EXPECT_EQ(2, robot_->state().trips);
    EXPECT_EQ(0u, robot_->counters().exceptions);
    EXPECT_EQ(800, bench_.source);
  }

  void Again() {
    bench_ = NaiveBench();
    memory_ = NetMemory();
    Start();
  }

  int turns_ = 0;
};

// What a reset does to a WRITE under way: the conversation repeats it until it is answered, to
// nobody (request_memory.h); with its memory lost, it may not have reached the server.
TEST_F(NetRobotTripTest, ResetAtAnyTurnLosesAndRepeatsNothing) {
  DriveTrips([](int) {});
  ExpectAllToldOnce();
  const int turns = turns_;
  for (const bool executed : {true, false}) {
    for (int at = 0; at < turns; ++at) {
      SCOPED_TRACE((executed ? "executed, turn " : "not executed, turn ") + std::to_string(at));
      Again();
      DriveTrips([&](int turn) {
        if (turn == at) {
          if (Asks() && executed) {
            bench_.Serve(robot_->exchange());
          }
          Start();
        }
      });
      ExpectAllToldOnce();
      if (HasFailure()) {
        return;
      }
    }
  }
}

// The state that was being written is lost; what depends on it has not been sent.
TEST_F(NetRobotTripTest, ResetWhileTheMemoryIsWrittenLosesAndRepeatsNothing) {
  DriveTrips([](int) {});
  const int turns = turns_;
  int torn = 0;
  for (int at = 0; at < turns; ++at) {
    SCOPED_TRACE(at);
    Again();
    uint16_t version = robot_->state().version;
    DriveTrips([&](int turn) {
      const bool saved = version != robot_->state().version;
      if (turn == at && saved) {
        ++torn;
        memory_.states[robot_->state().version & 1].marking ^= 0x8000;
        Start();
      }
      version = robot_->state().version;
    });
    ExpectAllToldOnce();
    if (HasFailure()) {
      return;
    }
  }
  EXPECT_GT(torn, 40);
}

TEST_F(NetRobotTripTest, WritesWithUnknownOutcomeAreMadeOnce) {
  for (const bool executed : {true, false}) {
    for (int which = 0; which < 24; ++which) {
      SCOPED_TRACE((executed ? "executed, write " : "not executed, write ") +
                   std::to_string(which));
      Again();
      int writes = 0;
      DriveTrips([&](int) {
        if (Asks() && robot_->exchange()->message.opcode == protocol::kTagWrite &&
            writes++ == which) {
          if (executed) {
            bench_.Serve(robot_->exchange());
          }
          robot_->exchange()->state = TagExchange::kDropped;
        }
      });
      ExpectAllToldOnce();
      if (HasFailure()) {
        return;
      }
    }
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
