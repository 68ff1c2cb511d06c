#include "server/operators/control/condition.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "server/operators/control/control.h"

namespace pheromone::control {
namespace {

using protocol::CommandCode;
using protocol::EventCode;

constexpr uint64_t kNowMs = 100'000;

// A robot that started at 10 s, was released at 12 s, and has driven since.
ClientView Driving() {
  ClientView client;
  client.known = true;
  client.silent_ms = 100;
  client.traffic.requests = 500;
  client.traffic.last_ms = kNowMs - 100;
  client.traffic.pose = protocol::WirePose{100, 200, 300};
  client.traffic.hello_ms = 10'000;
  client.traffic.first_pose_ms = 10'100;
  client.traffic.moved_ms = kNowMs - 100;
  client.traffic.obeyed = {CommandCode::kResume, 12'000};
  return client;
}

ClientView Told(EventCode code, uint64_t at_ms, uint64_t moved_ms) {
  ClientView client = Driving();
  client.traffic.event = {protocol::EventReport{7, 3, code, 0}, at_ms};
  client.traffic.moved_ms = moved_ms;
  return client;
}

std::string TextOf(const RobotCondition& it) {
  return std::string(NameOf(it.state)) + (it.reason.empty() ? "" : ": " + it.reason);
}

struct Case {
  std::string text;
  uint64_t since_ms;
  std::function<void(ClientView*)> change;
};

TEST(ConditionTest, SaysWhatIsKnownOfARobot) {
  const std::vector<Case> cases = {
      {"driving", 12'000, [](ClientView*) {}},
      {"silent: not heard since the server started", 0,
       [](ClientView* it) { it->silent_ms.reset(); }},
      {"silent", kNowMs - 3000,
       [](ClientView* it) {
         it->silent_ms = 3000;
         it->traffic.last_ms = kNowMs - 3000;
       }},
      {"refused: it has not said HELLO", kNowMs - 100, [](ClientView* it) { it->known = false; }},
      {"refused: unknown pheromone", 50'000,
       [](ClientView* it) {
         it->traffic.refusal = protocol::Reason::kUnknownPheromone;
         it->traffic.refused_ms = 50'000;
       }},
      {"off the map", 50'000,
       [](ClientView* it) {
         it->traffic.refusal = protocol::Reason::kOffTheMap;
         it->traffic.refused_ms = 50'000;
       }},
      {"only HELLO: again and again: it hears no answer, has no odometry or pose, or the server "
       "lacks its pheromone or version",
       10'000,
       [](ClientView* it) {
         it->traffic.obeyed.reset();
         it->traffic.moved_ms = 0;
         it->traffic.hellos = 3;
       }},
      {"halted: by the halt of all", 50'000,
       [](ClientView* it) {
         it->traffic.obeyed.reset();
         it->traffic.moved_ms = 0;
         it->traffic.hellos = 3;
         it->halt_of_all_ms = 50'000;
       }},
      {"halted: since its start", 10'000,  // it is the server that does not answer
       [](ClientView* it) {
         it->traffic.obeyed.reset();
         it->traffic.moved_ms = 0;
         it->traffic.hellos = 3;
         it->traffic.refusal = protocol::Reason::kBusy;
       }},
      {"halted: since its start", 10'000,  // the answer to its first HELLO was lost
       [](ClientView* it) {
         it->traffic.obeyed.reset();
         it->traffic.moved_ms = 0;
         it->traffic.hellos = 2;
       }},
      {"driving", 12'000,  // the log takes its time
       [](ClientView* it) { it->traffic.refusal = protocol::Reason::kBusy; }},
      {"halted: by an operator", 90'000,
       [](ClientView* it) {
         it->traffic.obeyed = {CommandCode::kHalt, 90'000};
       }},
      {"halted: since its start", 10'000,
       [](ClientView* it) {
         it->traffic.obeyed.reset();
         it->traffic.moved_ms = 0;
       }},
      {"halted: it does not know where it is", 11'000,  // a warm reset: HELLO, then that
       [](ClientView* it) {
         *it = Told(EventCode::kPoseLost, 11'000, 9'000);
         it->traffic.obeyed.reset();
       }},
      {"halted: since its start", 10'000,  // of before
       [](ClientView* it) {
         *it = Told(EventCode::kObstacle, 9'000, 9'000);
         it->traffic.obeyed.reset();
       }},
      {"halted: since its start", 95'000,  // a reset after the resume
       [](ClientView* it) {
         it->traffic.hello_ms = 95'000;
         it->traffic.moved_ms = 94'000;
       }},
      {"driving", 95'000,  // it is set to drive after a start
       [](ClientView* it) { it->traffic.hello_ms = 95'000; }},
      {"halted: by the halt of all", 95'000,
       [](ClientView* it) {
         it->halt_of_all_ms = 95'000;
         it->traffic.moved_ms = 95'900;  // it has braked
       }},
      {"halted: by the halt of all, not seen to stand yet", kNowMs - 500,
       [](ClientView* it) { it->halt_of_all_ms = kNowMs - 500; }},
      {"alarm: it was told to halt, and moves", 95'000,
       [](ClientView* it) { it->halt_of_all_ms = 95'000; }},
      {"alarm: all were halted before its start, and it moves", 96'000,
       [](ClientView* it) {
         it->halt_of_all_ms = 95'000;
         it->traffic.hello_ms = 96'000;
       }},
      {"driving", 97'000,  // the resume came after the halt
       [](ClientView* it) {
         it->halt_of_all_ms = 95'000;
         it->traffic.obeyed = {CommandCode::kResume, 97'000};
       }},
      {"at its goal", 80'000,
       [](ClientView* it) {
         it->traffic.arrived_ms = 80'000;
         it->traffic.moved_ms = 80'000;
         it->traffic.obeyed = {CommandCode::kHalt, 80'100};
       }},
      {"driving", 85'000,
       [](ClientView* it) {
         it->traffic.arrived_ms = 80'000;
         it->traffic.obeyed = {CommandCode::kResume, 85'000};
       }},
      {"going to its goal", 12'000,
       [](ClientView* it) {
         it->robot.goal = engine::Goal{{{1, 2}}, 100'000};
       }},
      {"standing: it has not told why", kNowMs - 3000,
       [](ClientView* it) { it->traffic.moved_ms = kNowMs - 3000; }},
      {"standing: it has not told a pose", 10'000,
       [](ClientView* it) {
         it->traffic.pose.reset();
         it->traffic.moved_ms = 0;
       }},
      {"alarm: battery low", 60'000,
       [](ClientView* it) { *it = Told(EventCode::kBatteryLow, 60'000, kNowMs); }},
      {"trail lost", 90'000,
       [](ClientView* it) { *it = Told(EventCode::kTrailLost, 90'000, 90'500); }},
      {"driving", 12'000,  // it has found it again
       [](ClientView* it) { *it = Told(EventCode::kTrailLost, 90'000, kNowMs); }},
      {"off the map", 90'000,
       [](ClientView* it) { *it = Told(EventCode::kOffTheMap, 90'000, 90'100); }},
      {"halted: stall or bumper", 90'000,  // and is pushed by hand
       [](ClientView* it) { *it = Told(EventCode::kObstacle, 90'000, kNowMs); }},
      {"halted: stopped by hand", 90'000,
       [](ClientView* it) { *it = Told(EventCode::kStoppedByHand, 90'000, 90'000); }},
      {"halted: it does not know where it is", 90'000,
       [](ClientView* it) { *it = Told(EventCode::kPoseLost, 90'000, 89'000); }},
      {"halted: its net has an exception", 90'000,
       [](ClientView* it) { *it = Told(EventCode::kNetException, 90'000, 89'000); }},
      {"driving", 95'000,
       [](ClientView* it) {
         *it = Told(EventCode::kObstacle, 90'000, kNowMs);
         it->traffic.obeyed = {CommandCode::kResume, 95'000};
       }},
      {"standing: it had no answers", 97'500,
       [](ClientView* it) { *it = Told(EventCode::kFailSafeStop, 97'500, 97'600); }},
      {"standing: it has not told why", 90'000,  // an old answer to a question
       [](ClientView* it) { *it = Told(EventCode::kParameterValue, 95'000, 90'000); }},
  };
  for (const Case& it : cases) {
    ClientView client = Driving();
    it.change(&client);
    const RobotCondition found = ConditionOf(client, kNowMs);
    EXPECT_EQ(TextOf(found), it.text);
    EXPECT_EQ(found.since_ms, it.since_ms) << it.text;
  }
}

// Whatever is known of it: no robot is said to drive whose pose has not changed for three seconds.
TEST(ConditionTest, NobodyDrivesWhoStands) {
  for (int code = 0; code <= static_cast<int>(protocol::kLastEvent); ++code) {
    for (int variant = 0; variant < 16; ++variant) {
      ClientView client = Driving();
      if (code != 0) {
        client.traffic.event = {protocol::EventReport{7, 3, static_cast<EventCode>(code), 0},
                                variant % 2 == 0 ? uint64_t{50'000} : uint64_t{99'000}};
      }
      client.traffic.moved_ms = kNowMs - 3001;
      if ((variant & 2) != 0) {
        client.robot.goal = engine::Goal{{{1, 2}}, 100'000};
      }
      if ((variant & 4) != 0) {
        client.halt_of_all_ms = 60'000;
      }
      if ((variant & 8) != 0) {
        client.traffic.obeyed.reset();
      }
      const RobotState state = ConditionOf(client, kNowMs).state;
      EXPECT_NE(state, RobotState::kDriving) << code << ' ' << variant;
      EXPECT_NE(state, RobotState::kToGoal) << code << ' ' << variant;
      EXPECT_NE(state, RobotState::kAlarm) << code << ' ' << variant;
    }
  }
}

}  // namespace
}  // namespace pheromone::control
