// What a drive tells the robot besides its pose: what is in the way, whether somebody has stopped
// it, how full the battery is. Plain data.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

/// Each of these halts the robot until a resume.
enum Alarm : uint8_t {
  kStallAlarm = 0x01,
  kBumperAlarm = 0x02,
  kStopButtonAlarm = 0x04,
  kMotorsOffAlarm = 0x08,  ///< the motors were switched off while the robot used them
  kPoseLostAlarm = 0x10,   ///< odometry could not go on after a warm reset
};

/// Nothing in reach of a sonar, or no sonar.
constexpr uint16_t kNoRange = 0xFFFF;

struct DriveStatus {
  uint8_t alarms;         ///< a set of Alarm
  uint8_t battery_100mv;  ///< 0: unknown
  uint16_t bumpers;       ///< the drive's own word of stalls and bumpers
  uint16_t front_mm;      ///< to what is ahead
};

constexpr DriveStatus kNothingToTell = {0, 0, 0, kNoRange};

}  // namespace client
}  // namespace pheromone
