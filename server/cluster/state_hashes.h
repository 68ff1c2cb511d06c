// Whether servers that have applied the same events have the same state: each notes the hash of its
// own after some of them (ClusterLog::StateHash), and hears those of the others, earlier or later.
//
//   StateHashes hashes;
//   hashes.Note(4711, own_hash);
//   hashes.Hear("b", 4711, its_hash);
//   std::optional<uint64_t> sequence = hashes.Difference("b", committed);   // told once
//
// Pure; not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace pheromone::cluster {

class StateHashes {
 public:
  /// Of how many of the newest events hashes are kept, for each server.
  static constexpr size_t kMaxHashes = 32;

  void Note(uint64_t sequence, uint64_t hash) { Keep(sequence, hash, &own_); }
  /// The newest own one up to an event; nullptr: there is none.
  const std::pair<const uint64_t, uint64_t>* Newest(uint64_t up_to) const {
    const auto after = own_.upper_bound(up_to);
    return after != own_.begin() ? &*std::prev(after) : nullptr;
  }

  /// Nothing if it is not kept (any more).
  std::optional<uint64_t> Own(uint64_t sequence) const {
    const auto found = own_.find(sequence);
    return found != own_.end() ? std::optional(found->second) : std::nullopt;
  }

  /// May be told again and again.
  void Hear(const std::string& node, uint64_t sequence, uint64_t hash) {
    Heard& its = heard_[node];
    if (sequence > its.compared) {
      Keep(sequence, hash, &its.hashes);
    }
  }
  /// An event after which that server has another state; told once for each. Only events up to
  /// `committed`: of a later number, that server may have another event than this one.
  std::optional<uint64_t> Difference(const std::string& node, uint64_t committed) {
    Heard& its = heard_[node];
    for (const auto& [sequence, hash] : its.hashes) {
      if (sequence > committed) {
        break;
      }
      const auto own = own_.find(sequence);
      if (own == own_.end() || sequence <= its.compared) {
        continue;
      }
      its.compared = sequence;
      if (own->second != hash) {
        return sequence;
      }
    }
    return std::nullopt;
  }
  /// It begins again, perhaps with another state.
  void Forget(const std::string& node) { heard_.erase(node); }

 private:
  using Hashes = std::map<uint64_t, uint64_t>;
  struct Heard {
    Hashes hashes;
    uint64_t compared = 0;  // up to this event
  };

  static void Keep(uint64_t sequence, uint64_t hash, Hashes* to) {
    (*to)[sequence] = hash;
    if (to->size() > kMaxHashes) {
      to->erase(to->begin());
    }
  }

  Hashes own_;
  std::map<std::string, Heard> heard_;
};

}  // namespace pheromone::cluster
