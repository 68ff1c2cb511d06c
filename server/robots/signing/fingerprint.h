// What names a robot's key where the key itself must not be: in the log of changes, in messages.
#pragma once

#include <array>
#include <cstdint>

#include "server/robots/signing/keys.h"

namespace pheromone::signing {

using Fingerprint = std::array<uint8_t, 8>;

/// The first 8 bytes of the AES-128-CMAC under `key` of the 15 characters "key fingerprint". No
/// frame's MAC is of a text with this beginning (protocol::MacUse). It tells nothing of the key.
Fingerprint FingerprintOf(const Key& key);

}  // namespace pheromone::signing
