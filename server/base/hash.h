// The hash that makes two states comparable: each live object contributes Hash64 of its kind, key
// and canonical value, and the state's hash is the sum of the contributions modulo 2^64. A sum can
// be kept up to date object by object, and does not depend on where or in which order the objects
// are stored.
//
// The step is the finaliser of SplitMix64 (Steele, Lea and Flood 2014), chained: h starts at 0, and
// each word w turns it into mix(h + w + 0x9E3779B97F4A7C15). It distinguishes states, but is not
// cryptographic: collisions can be constructed.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string_view>

namespace pheromone {

inline uint64_t HashStep(uint64_t hash, uint64_t word) {
  uint64_t z = hash + word + 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

inline uint64_t Hash64(std::initializer_list<uint64_t> words) {
  uint64_t hash = 0;
  for (const uint64_t word : words) {
    hash = HashStep(hash, word);
  }
  return hash;
}

/// The hash of a text: of its length and its bytes.
inline uint64_t HashText(std::string_view text) {
  uint64_t hash = HashStep(0, text.size());
  for (const char c : text) {
    hash = HashStep(hash, static_cast<unsigned char>(c));
  }
  return hash;
}

}  // namespace pheromone
