// The robots' keys on a signed link, and what the link asks of them (protocol/README.md, section
// 18).
#pragma once

#include <array>
#include <cstdint>
#include <map>

namespace pheromone::signing {

using Key = std::array<uint8_t, 16>;
/// By CLIENT_ID.
using Keys = std::map<uint8_t, Key>;

enum class Security : uint8_t {
  kOff,
  kAccept,  ///< signed or not: to try it; protects nothing
  kRequire,
};

}  // namespace pheromone::signing
