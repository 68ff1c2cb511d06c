// Keys of robots that operators have revoked, for good: robots without one of them are not touched,
// and a robot with another key is another matter. A key is known by its robot and its fingerprint
// (server/robots/signing/fingerprint.h), so that no key is in the log.
//
// Logged state; counts into the state hash.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "server/base/bytes.h"
#include "server/base/fields.h"
#include "server/base/result.h"

namespace pheromone::engine {

struct RevokedKey {
  uint8_t id = 1;  ///< the robot's
  std::array<uint8_t, 8> fingerprint{};
  auto operator<=>(const RevokedKey&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("id", it.id, Within(1, 254));
    visit("fingerprint", it.fingerprint);
  }
};

class RevokedKeys {
 public:
  static constexpr size_t kMost = 10'000;

  bool Contains(const RevokedKey& key) const;
  /// In ascending order.
  const std::vector<RevokedKey>& keys() const { return keys_; }

  /// Whether Add may be called. Errors: no keys, an invalid ID, too many.
  Status Check(const std::vector<RevokedKey>& more) const;
  /// Some of them may be there already.
  void Add(const std::vector<RevokedKey>& more);

  /// The sum over the keys of Hash64 over 'K' and the fields.
  uint64_t hash() const { return hash_; }
  void Save(ByteWriter* writer) const { EncodeFields(keys_, writer); }
  /// Into an empty one. Invalid bytes fail the reader.
  void Restore(ByteReader* reader);

 private:
  std::vector<RevokedKey> keys_;  // in ascending order
  uint64_t hash_ = 0;
};

}  // namespace pheromone::engine
