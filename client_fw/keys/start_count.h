// How often programs have started with a robot's key. The count is the nonce of HELLO, which must
// not be used twice with a key (protocol/README.md, section 18).
//
//   PHEROMONE_TRY(const uint16_t start, CountStarts("robot-7.key"));
//
// It is in a file beside that of the key, "robot-7.key.starts". Programs that start at once wait
// for each other. Errors name the file, what is wrong and what was expected.
#pragma once

#include <cstdint>
#include <string>

#include "server/base/result.h"

namespace pheromone::keys {

/// Claims `count` numbers in succession, from 1 to 65535, that nobody gets again; they are on the
/// disk when it returns. Returns the first. Errors: `key_file` cannot be read, there are not so
/// many numbers left, or the count cannot be kept.
Result<uint16_t> CountStarts(const std::string& key_file, uint16_t count = 1);

}  // namespace pheromone::keys
