// What a robot is doing, as far as it is known: one word, with the reason and since when. Computed
// here only; dashboard, pheromonectl, API, stream and metrics show it alike.
//
//   const RobotCondition condition = ConditionOf(client, now_ms);
//   NameOf(condition.state); condition.reason;
//
// A robot tells little: EVENTs, and the acknowledgement of *halt* and *resume*. The rest follows
// from its poses: whoever has not moved for three seconds is not driving, whatever was told.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace pheromone::control {

struct ClientView;

enum class RobotState : uint8_t {
  kDriving,
  kToGoal,     ///< it drives to its goal
  kAtGoal,     ///< it has arrived there, and stands
  kStanding,   ///< it has not told why
  kHalted,     ///< until a resume
  kTrailLost,  ///< it stands
  kOffTheMap,  ///< and stands
  kRefused,    ///< its requests are answered with ERROR
  kOnlyHello,  ///< it says nothing else since its start
  kAlarm,      ///< it drives, but something is wrong
  kSilent,
};
constexpr RobotState kLastRobotState = RobotState::kSilent;

struct RobotCondition {
  RobotState state = RobotState::kSilent;
  std::string reason;     ///< may be empty
  uint64_t since_ms = 0;  ///< field time
  bool told = false;      ///< by the robot; else the server has concluded it
  bool moves = false;     ///< its pose has changed within the last three seconds
};

constexpr uint64_t kStandsAfterMs = 3000;
constexpr uint64_t kSilentAfterMs = 3000;

/// `now_ms`: field time.
RobotCondition ConditionOf(const ClientView& client, uint64_t now_ms);

/// "driving", "halted", ...
std::string_view NameOf(RobotState state);
/// It stands, and only an operator or another robot changes that.
bool IsHeld(RobotState state);

}  // namespace pheromone::control
