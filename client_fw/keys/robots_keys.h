// The keys of robots that run in one program, from a file as the server has it
// (server/robots/signing/keys_file.h).
//
//   PHEROMONE_TRY(const RobotsKeys keys, TakeKeys("robots.keys", {7, 8}));
//   parameters.key = keys.keys.at(7).data();           // `keys` outlives the robot
//   parameters.boot_counter = keys.first_start;
//
// Starts are counted for all robots of the file together, "robots.keys.starts".
#pragma once

#include <cstdint>
#include <set>
#include <string>

#include "server/base/result.h"
#include "server/robots/signing/keys.h"

namespace pheromone::keys {

struct RobotsKeys {
  signing::Keys keys;        ///< of all robots of the file
  uint16_t first_start = 0;  ///< of those that were claimed (start_count.h)
};

/// `starts`: how many are claimed; more than one if one key is used by several robots, on different
/// links. Errors: those of KeysFile and CountStarts; a robot of `ids` has no key, and then no start
/// was counted.
Result<RobotsKeys> TakeKeys(const std::string& path, const std::set<uint8_t>& ids,
                            uint16_t starts = 1);

}  // namespace pheromone::keys
