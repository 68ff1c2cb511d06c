// The unique ID by which a robot's program defines itself in the server's table of robots (SYMBOL;
// protocol/README.md, section 16): what it is, and the robot's ID in three digits.
#pragma once

#include <stdint.h>

#include "client_fw/core/requests/tag_data.h"
#include "protocol/byte_order.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {

/// DATA of a SYMBOL, but for its seq, for "cleaner-" and 7: robot "cleaner-007", with any free
/// number. Returns its length.
inline uint8_t PutRobotName(const char* what, uint8_t id, uint8_t* data) {
  data[kSymbolKind] = static_cast<uint8_t>(protocol::SymbolKind::kRobot);
  protocol::PutI32(data + kSymbolNumber, 0);
  uint8_t length = kSymbolText;
  for (; *what != 0; ++what) {
    data[length++] = static_cast<uint8_t>(*what);
  }
  data[length++] = static_cast<uint8_t>('0' + id / 100);
  data[length++] = static_cast<uint8_t>('0' + id / 10 % 10);
  data[length++] = static_cast<uint8_t>('0' + id % 10);
  return length;
}

}  // namespace client
}  // namespace pheromone
