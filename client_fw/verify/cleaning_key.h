// A CleaningState in as few 64-bit words as its floor needs, so that states that differ only in
// what does not matter are equal: robots are interchangeable and, where nothing depends on the
// place, so are the ways to lay the floor onto itself.
//
//   CleaningKeys keys(world, {.symmetric = true}, /*soil_percent=*/0);
//   const auto packed = keys.Pack(state);   // packed.key, and how the floor was turned
//   const CleaningState same = keys.Unpack(packed.key.data());
//
// What is not asked for is not in the key, and as in a fresh state after Unpack.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/verify/cleaning_symmetry.h"
#include "client_fw/verify/cleaning_world.h"

namespace pheromone::verify {

/// What a search tells states apart by, besides robots and the order of time stamps.
struct KeyParts {
  bool symmetric = false;
  bool soil = false;     ///< when zones become dirtier next
  uint64_t leveled = 0;  ///< zones whose level counts, as bits; with `soil`
  bool clock = false;    ///< else the states at all times are the same
};

class CleaningKeys {
 public:
  static constexpr size_t kMaxWords = 24;
  using Key = std::array<uint64_t, kMaxWords>;  ///< the first words() of it

  struct Packed {
    Key key{};
    uint8_t way = 0;    ///< the symmetry by which the state became that of `key`
    uint8_t equal = 0;  ///< how many symmetries do
  };

  /// `soil_percent`: of the starts, from which the levels that zones can have follow.
  CleaningKeys(const CleaningWorld& world, const KeyParts& parts, int soil_percent);

  size_t words() const { return words_; }
  const std::vector<ZoneMap>& maps() const { return maps_; }

  Packed Pack(const CleaningState& state) const;
  CleaningState Unpack(const uint64_t* key) const;

  /// The zones in which robots are cleaning, as bits.
  uint64_t Cleaned(const uint64_t* key) const;

 private:
  // Some bits of a word.
  struct Place {
    uint8_t word = 0;
    uint8_t shift = 0;
    uint8_t bits = 0;

    uint64_t Get(const uint64_t* key) const {
      return key[word] >> shift & ((uint64_t{1} << bits) - 1);
    }
    void Put(uint64_t value, Key* key) const { (*key)[word] |= value << shift; }
  };

  Place Reserve(size_t wanted);
  void FindLevels(const CleaningWorld& world, int soil_percent);
  void PackAs(const CleaningState& state, const ZoneMap& map, Key* key) const;
  CleanerPhase PhaseOf(uint64_t bits) const { return static_cast<CleanerPhase>(bits & 7); }

  size_t zones_;
  size_t robots_;
  KeyParts parts_;
  bool has_asks_;
  std::vector<ZoneMap> maps_;
  size_t words_ = 1;
  uint8_t used_ = 0;  // bits of the last word
  uint8_t zone_bits_;
  uint8_t timer_bits_;
  std::array<Place, kMaxCleaners> robot_{};
  Place newest_;
  Place tick_;
  Place clock_;
  Place asks_;
  Place wanted_;
  std::array<Place, kMaxZones> rank_{};
  std::array<Place, kMaxZones> level_{};
  // By zone: the levels that it can have, and for each level in % its place among them.
  std::array<std::vector<uint8_t>, kMaxZones> levels_;
  std::array<std::array<uint8_t, kFullPercent + 1>, kMaxZones> level_code_{};
};

}  // namespace pheromone::verify
