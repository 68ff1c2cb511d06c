#include "server/operators/control/condition.h"

#include <algorithm>
#include <optional>

#include "server/operators/control/control.h"
#include "server/operators/control/names.h"

namespace pheromone::control {
namespace {

using protocol::CommandCode;
using protocol::EventCode;
using protocol::Reason;

// A robot that has what it needs says HELLO once, and another time if an answer was lost.
constexpr uint8_t kManyHellos = 3;

// A robot at full speed brakes and reports within that.
constexpr uint64_t kBrakingMs = 1500;

struct Stop {
  RobotState state;
  std::string reason;
  bool until_resume;  // else until it moves again
};

// What of the EVENTs makes a robot stand (protocol/README.md, "EVENT").
std::optional<Stop> StopBy(const protocol::EventReport& event) {
  switch (event.code) {
    case EventCode::kObstacle:
      return Stop{RobotState::kHalted, "stall or bumper", true};
    case EventCode::kStoppedByHand:
      return Stop{RobotState::kHalted, "stopped by hand", true};
    case EventCode::kPoseLost:
      return Stop{RobotState::kHalted, "it does not know where it is", true};
    case EventCode::kNetException:
      return Stop{RobotState::kHalted, "its net has an exception", true};
    case EventCode::kOffTheMap:
      return Stop{RobotState::kOffTheMap, "", false};
    case EventCode::kTrailLost:
      return Stop{RobotState::kTrailLost, "", false};
    case EventCode::kFailSafeStop:
      return Stop{RobotState::kStanding, "it had no answers", false};
    default:
      return std::nullopt;
  }
}

class Judge {
 public:
  Judge(const ClientView& client, uint64_t now_ms)
      : client_(client), heard_(client.traffic), now_ms_(now_ms) {
    moves_ = heard_.moved_ms != 0 && now_ms - std::min(now_ms, heard_.moved_ms) < kStandsAfterMs;
    resumed_ms_ =
        heard_.obeyed && heard_.obeyed->what == CommandCode::kResume ? heard_.obeyed->at_ms : 0;
  }

  RobotCondition Decide() const {
    if (!client_.silent_ms) {
      return Make(RobotState::kSilent, "not heard since the server started", 0);
    }
    if (*client_.silent_ms >= kSilentAfterMs) {
      return Make(RobotState::kSilent, "", heard_.last_ms);
    }
    if (!client_.known) {
      return Make(RobotState::kRefused, "it has not said HELLO", heard_.last_ms);
    }
    if (const auto refused = Refused()) {
      return *refused;
    }
    if (const auto halted = Halted()) {
      return *halted;
    }
    const auto stopped = StoppedByEvent();
    const auto started = HaltedSinceStart();
    if (stopped && (!started || stopped->since_ms >= started->since_ms)) {
      return *stopped;
    }
    if (started) {
      return *started;
    }
    return moves_ ? Moving() : Standing();
  }

 private:
  RobotCondition Make(RobotState state, std::string reason, uint64_t since_ms,
                      bool told = false) const {
    return {state, std::move(reason), since_ms, told, moves_};
  }

  // Some time after it would have stopped.
  bool MovedSince(uint64_t at_ms) const { return heard_.moved_ms > at_ms + kBrakingMs; }

  std::optional<RobotCondition> Refused() const {
    if (heard_.refusal == Reason::kNone || heard_.refusal == Reason::kBusy) {
      return std::nullopt;
    }
    const bool off = heard_.refusal == Reason::kOffTheMap;
    return Make(off ? RobotState::kOffTheMap : RobotState::kRefused,
                off ? "" : std::string(web::NameOf(heard_.refusal)), heard_.refused_ms);
  }

  std::optional<RobotCondition> Halted() const {
    if (heard_.arrived_ms > resumed_ms_ && !client_.robot.goal) {
      return Make(RobotState::kAtGoal, "", heard_.arrived_ms);
    }
    if (heard_.obeyed && heard_.obeyed->what == CommandCode::kHalt) {
      return Make(RobotState::kHalted, "by an operator", heard_.obeyed->at_ms, true);
    }
    // Nobody acknowledges the halt of all: who stands has heard it, or stood anyway.
    const uint64_t halt_ms = client_.halt_of_all_ms.value_or(0);
    if (halt_ms > resumed_ms_ && client_.halt_of_all_ms && !MovedSince(halt_ms)) {
      const bool is_braking = moves_ && now_ms_ < halt_ms + kBrakingMs;
      return Make(RobotState::kHalted,
                  is_braking ? "by the halt of all, not seen to stand yet" : "by the halt of all",
                  halt_ms);
    }
    return std::nullopt;
  }

  // Each start halts a robot, unless it is set otherwise: then it has moved.
  std::optional<RobotCondition> HaltedSinceStart() const {
    if (heard_.hello_ms <= resumed_ms_ || MovedSince(heard_.hello_ms) || moves_) {
      return std::nullopt;
    }
    if (heard_.hellos >= kManyHellos && heard_.refusal != Reason::kBusy) {
      return Make(
          RobotState::kOnlyHello,
          "again and again: it hears no answer, has no odometry or pose, or the server lacks "
          "its pheromone or version",
          heard_.hello_ms);
    }
    return Make(RobotState::kHalted, "since its start", heard_.hello_ms);
  }

  std::optional<RobotCondition> StoppedByEvent() const {
    if (!heard_.event) {
      return std::nullopt;
    }
    const uint64_t at_ms = heard_.event->at_ms;
    const std::optional<Stop> stop = StopBy(heard_.event->what);
    if (!stop || (stop->until_resume ? resumed_ms_ > at_ms : MovedSince(at_ms))) {
      return std::nullopt;
    }
    return Make(stop->state, stop->reason, at_ms, true);
  }

  RobotCondition Moving() const {
    if (const uint64_t halt_ms = client_.halt_of_all_ms.value_or(0); halt_ms > resumed_ms_) {
      return heard_.hello_ms > halt_ms
                 ? Make(RobotState::kAlarm, "all were halted before its start, and it moves",
                        heard_.hello_ms)
                 : Make(RobotState::kAlarm, "it was told to halt, and moves", halt_ms);
    }
    if (heard_.event && heard_.event->what.code == EventCode::kBatteryLow) {
      return Make(RobotState::kAlarm, "battery low", heard_.event->at_ms, true);
    }
    return Make(client_.robot.goal ? RobotState::kToGoal : RobotState::kDriving, "",
                std::max(resumed_ms_, heard_.hello_ms));
  }

  RobotCondition Standing() const {
    if (!heard_.pose) {
      return Make(RobotState::kStanding, "it has not told a pose", heard_.hello_ms);
    }
    return Make(RobotState::kStanding, "it has not told why",
                std::max(heard_.moved_ms, heard_.first_pose_ms));
  }

  const ClientView& client_;
  const engine::RobotTraffic& heard_;
  uint64_t now_ms_;
  bool moves_;
  uint64_t resumed_ms_;
};

}  // namespace

RobotCondition ConditionOf(const ClientView& client, uint64_t now_ms) {
  return Judge(client, now_ms).Decide();
}

std::string_view NameOf(RobotState state) {
  switch (state) {
    case RobotState::kDriving:
      return "driving";
    case RobotState::kToGoal:
      return "going to its goal";
    case RobotState::kAtGoal:
      return "at its goal";
    case RobotState::kStanding:
      return "standing";
    case RobotState::kHalted:
      return "halted";
    case RobotState::kTrailLost:
      return "trail lost";
    case RobotState::kOffTheMap:
      return "off the map";
    case RobotState::kRefused:
      return "refused";
    case RobotState::kOnlyHello:
      return "only HELLO";
    case RobotState::kAlarm:
      return "alarm";
    case RobotState::kSilent:
      break;
  }
  return "silent";
}

bool IsHeld(RobotState state) {
  return state == RobotState::kHalted || state == RobotState::kAtGoal;
}

}  // namespace pheromone::control
