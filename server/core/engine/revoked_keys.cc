#include "server/core/engine/revoked_keys.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <string>

#include "server/base/hash.h"

namespace pheromone::engine {

Status RevokedKeys::Check(const std::vector<RevokedKey>& more) const {
  if (more.empty()) {
    return Error{"found no key to revoke, expected at least one"};
  }
  if (keys_.size() + more.size() > kMost) {
    return Error{std::to_string(keys_.size()) + " keys are revoked already, expected at most " +
                 std::to_string(kMost) + " with " + std::to_string(more.size()) +
                 " more: take this one out of the keys files instead"};
  }
  return CheckFields(more, "keys");
}

bool RevokedKeys::Contains(const RevokedKey& key) const {
  return std::binary_search(keys_.begin(), keys_.end(), key);
}

void RevokedKeys::Add(const std::vector<RevokedKey>& more) {
  std::vector<RevokedKey> fresh;
  std::copy_if(more.begin(), more.end(), std::back_inserter(fresh),
               [this](const RevokedKey& key) { return !Contains(key); });
  std::sort(fresh.begin(), fresh.end());
  fresh.erase(std::unique(fresh.begin(), fresh.end()), fresh.end());
  for (const RevokedKey& key : fresh) {
    hash_ += fields::HashInto(HashStep(0, 'K'), key);
  }
  const auto old = static_cast<std::ptrdiff_t>(keys_.size());
  keys_.insert(keys_.end(), fresh.begin(), fresh.end());
  std::inplace_merge(keys_.begin(), keys_.begin() + old, keys_.end());
}

void RevokedKeys::Restore(ByteReader* reader) {
  std::vector<RevokedKey> keys;
  DecodeFields(reader, &keys);
  if (!reader->ok() || keys.empty()) {
    return;
  }
  reader->Check(Check(keys));
  if (std::adjacent_find(keys.begin(), keys.end(), std::greater_equal<>()) != keys.end()) {
    reader->Fail("revoked keys that are not in ascending order");
  }
  Add(keys);
}

}  // namespace pheromone::engine
