// Which keys of signed links an operator's revocation is about, and what is left of them.
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/core/engine/revoked_keys.h"
#include "server/robots/signing/keys.h"

namespace pheromone::daemon {

/// Keys by the names of their links.
using LinkKeys = std::map<std::string, signing::Keys>;

struct Revocation {
  std::vector<engine::RevokedKey> keys;
  std::vector<std::string> links;  ///< that have one of them
};

/// All keys that these robots have, on whatever links. Error: one of them has none.
Result<Revocation> FindKeys(const LinkKeys& keys, std::span<const uint8_t> robots);

struct SiftedKeys {
  signing::Keys valid;
  std::vector<uint8_t> revoked;  ///< the robots of the others
};
SiftedKeys Sift(const signing::Keys& keys, const engine::RevokedKeys& revoked);

}  // namespace pheromone::daemon
