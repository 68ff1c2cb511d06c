// What a robot is told before it starts: its own number, how its link behaves, where it stands, and
// how it is to steer. The server adds its own part in HELLO's answer.
#pragma once

#include <stdint.h>

#include "client_fw/core/angle.h"
#include "client_fw/core/steering.h"

namespace pheromone {
namespace client {

struct Parameters {
  uint8_t id = 1;    ///< CLIENT_ID, 1-254
  uint8_t type = 1;  ///< pheromone followed, and left behind if lay_trail; 1-15
  Law law = Law::kDifferential;
  int16_t speed_mm_s = 200;       ///< K of the law, 0 to kMaxSpeedMmS
  Pose start = Pose{0, 0, 0};     ///< where on the map odometry began
  uint16_t boot_counter = 0;      ///< the nonce of HELLO: another one after each power-up
  uint16_t period_ms = 200;       ///< one exchange each, 1 to 30 000
  uint16_t fail_safe_ms = 500;    ///< longest drive without an answer; over period_ms, to 30 000
  uint16_t gap_timeout_ms = 20;   ///< longest silence inside a frame; 0 on links without gaps
  uint8_t first_window_ms = 100;  ///< response window until HELLO tells the server's
  bool wide = false;              ///< 32-bit coordinates
  bool lay_trail = false;         ///< TRACE instead of SENSE
  bool buffered_link = false;     ///< pty, TCP, UDP, USB: answers may be late, so resynchronise
  uint8_t firmware_version = 1;   ///< told in HELLO
  uint8_t capabilities = 0;       ///< told in HELLO
};

}  // namespace client
}  // namespace pheromone
