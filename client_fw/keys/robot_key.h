// The robot's key for signed frames (protocol/README.md, section 18), and how often it was used.
//
//   Result<RobotKey> key = TakeKey("robot-7.key");     // 32 hex digits in the first line
//   parameters.key = key.value().bytes.data();
//   parameters.boot_counter = key.value().start;
//
// Each call counts a start (start_count.h). Errors name the file, what is wrong and what was
// expected.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "server/base/result.h"

namespace pheromone::keys {

struct RobotKey {
  std::array<uint8_t, 16> bytes{};
  uint16_t start = 0;           ///< from 1: another one at each call
  bool open_to_others = false;  ///< not only its owner can read the file
};

Result<RobotKey> TakeKey(const std::string& path);

}  // namespace pheromone::keys
