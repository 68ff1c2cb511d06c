// A robot's parameters before it starts: its ID, the behaviour of its link, its start pose, and how
// it steers. The server adds its own in HELLO's answer.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/angle.h"
#include "client_fw/core/base/outlined.h"
#include "client_fw/core/signing/signing.h"
#include "client_fw/core/steering/settings.h"

namespace pheromone {
namespace client {

/// The time of `bytes` on a line of `baud`, ten bits each, in whole ms, rounded up: at least 1.
PHEROMONE_OUTLINED constexpr uint16_t BytesMs(uint16_t bytes, uint32_t baud) {
  return static_cast<uint16_t>((uint32_t{10000} * bytes + baud - 1u) / baud);
}

/// Settings can be changed over the radio, the rest cannot.
struct Parameters : Settings {
  uint8_t id = 1;                 ///< CLIENT_ID, 1-254
  Pose start = Pose{0, 0, 0};     ///< the pose on the map where odometry starts
  uint16_t boot_counter = 0;      ///< the nonce of HELLO: another one after each power-up
  bool pose_lost = false;         ///< a reset has lost the pose: stand until one is given
  uint8_t gap_timeout_ms = 20;    ///< longest silence inside a frame; 0 on links without gaps
  uint8_t first_window_ms = 100;  ///< response window until HELLO's answer gives the server's
  uint8_t adapter_ms = 0;         ///< for how long our adapter may hold back what it received
  uint32_t baud = 9600;           ///< of the radio, 300 to 4 000 000
  bool wide = false;              ///< 32-bit coordinates
  bool buffered_link = false;     ///< pty, TCP, UDP, USB: answers may be late, so resynchronise
  uint8_t firmware_version = 1;   ///< sent in HELLO
  bool rounds = true;             ///< asks for turns, where the server grants them
#if PHEROMONE_SIGNING
  const uint8_t* key = nullptr;  ///< the robot's, 16 bytes; null: frames are not signed
#else
  static constexpr const uint8_t* key = nullptr;
#endif
};

}  // namespace client
}  // namespace pheromone
