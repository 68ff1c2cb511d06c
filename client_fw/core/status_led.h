// A robot's LED: steady while it drives, else so many flashes, a pause, and again.
//
//   led.Step(LedCode(conversation.state().flags, status.alarms, connected), now_ms);
//   board->set_led(led.on());
//
// | flashes | it stands because |
// |---|---|
// | 1 | it is halted: resume it |
// | 2 | the drive does not answer: cable, switch |
// | 3 | the server does not answer: radio, ID |
// | 4 | the server speaks another protocol version, or has no such pheromone |
// | 5 | of an alarm: stall, bumper, STOP button, motors |
// | 6 | it does not know where it is: give it a pose |
// | 7 | it is off the map, or has lost the trail |
//
// A flash is 256 ms of light and as much of darkness, the pause about a second more. Pure but for
// StatusLed.
#pragma once

#include <stdint.h>

#include "client_fw/core/conversation.h"

namespace pheromone {
namespace client {

/// `flags`: a set of StopFlag; `alarms`: of Alarm; `connected`: the drive reports its pose. The
/// most urgent reason if there are several.
inline uint8_t LedCode(uint8_t flags, uint8_t alarms, bool connected) {
  return !connected                                      ? uint8_t{2}
         : alarms != 0                                   ? uint8_t{5}
         : (flags & kPoseLost) != 0                      ? uint8_t{6}
         : (flags & (kWrongVersion | kTypeMissing)) != 0 ? uint8_t{4}
         : (flags & (kNoAnswerYet | kFailSafe)) != 0     ? uint8_t{3}
         : (flags & (kOffTheMap | kTrailLost)) != 0      ? uint8_t{7}
         : flags != 0                                    ? uint8_t{1}
                                                         : uint8_t{0};
}

class StatusLed {
 public:
  /// `code`: flashes; 0: steady. A new code begins after the pause.
  void Step(uint8_t code, uint16_t now_ms) {
    const uint16_t passed_ms = static_cast<uint16_t>(now_ms - began_ms_);
    uint8_t half_flashes = static_cast<uint8_t>(passed_ms >> 8);
    if (half_flashes >= 2 * code_ + kPauseHalfFlashes) {
      began_ms_ = now_ms;
      code_ = code;
      half_flashes = 0;
    }
    on_ = code_ == 0 || (half_flashes < 2 * code_ && half_flashes % 2 == 0);
  }
  bool on() const { return on_; }

 private:
  enum : uint8_t { kPauseHalfFlashes = 4 };

  uint16_t began_ms_ = 0;
  uint8_t code_ = 0;
  bool on_ = false;
};

}  // namespace client
}  // namespace pheromone
