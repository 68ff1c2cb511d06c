// The memory of one virtual RFID tag: slots of one block each, what is dropped when they are full,
// leases, and writing on condition.
//
//   Tag tag(8);
//   const Written written = tag.Write({.block = block, .expected = seen_generation, .lease_ms =
//   60'000}, now, policy); if (written.outcome == WriteOutcome::kGenerationChanged) ...  // another
//   robot was first
//
// The paper's two rules (Tammet, Vain and Kuusik 2006, section 3.4) are that blocks of privileged
// authors are never dropped, and of the others the oldest first. Added are
//  - leases: until its lease ends, a block cannot be dropped; then it is erased. In the paper the
//    sign "occupied" (section 4.3) is a block like any other, which eight newer ones evict, and one
//    whose robot breaks down stays for ever;
//  - generations: numbers that change with each slot and each tag. Reading and then writing is a
//    race between two robots; a write that names the generation it has read is not;
//  - a quota: privileged and leased blocks together leave room for others.
//
// Pure; one thread at a time. Times are field time in milliseconds, but for the authors' clocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/core/tags/block.h"

namespace pheromone::tags {

constexpr size_t kDefaultSlots = 8;  ///< the paper's 256 bytes
constexpr size_t kMaxSlots = 64;
constexpr uint32_t kMaxLeaseMs = 3'600'000;
/// A time stamp further ahead of the server's clock counts as the oldest: a robot whose clock runs
/// wild must not keep its blocks for ever.
constexpr int64_t kMaxAheadS = 86'400;
/// Of eight slots, how many privileged and leased blocks may take.
constexpr size_t kProtectedOfEight = 6;

/// By which blocks are dropped, the lowest first: the time of writing, or -1 if that is too far
/// ahead of the server's clock.
int64_t AgeKey(const Block& block, int64_t utc_s);

struct Slot {
  Block block;
  uint16_t generation = 0;    ///< of the slot: one more with each change; wraps
  uint64_t lease_end_ms = 0;  ///< 0: no lease
  bool operator==(const Slot&) const = default;

  bool is_leased() const { return lease_end_ms != 0; }
};

/// What a write depends on beside the tag.
struct Policy {
  int64_t utc_s = 0;                    ///< the server's clock
  std::span<const int32_t> privileged;  ///< authors whose blocks are never dropped; sorted

  bool IsPrivileged(int32_t author) const;
  /// Leased or privileged.
  bool IsProtected(const Slot& slot) const {
    return slot.is_leased() || IsPrivileged(slot.block.author);
  }
};

struct WriteRequest {
  Block block;
  std::optional<uint8_t> slot{};  ///< empty: chosen by the policy
  /// The write is done only if this is the generation of the slot, if one is named, else of the
  /// tag.
  std::optional<uint16_t> expected{};
  uint32_t lease_ms = 0;  ///< 0: none
  bool is_state = false;  ///< replaces the author's block of the same subject and predicate
};

enum class WriteOutcome : uint8_t {
  kDone,
  kGenerationChanged,  ///< it was written to since
  kProtected,          ///< the slot's block is privileged, or leased, and another author's
  kFull,               ///< nothing may be dropped, or the quota of protected blocks is used up:
                       ///< of net records with one slot more
  kNoSuchSlot,
};

struct Written {
  WriteOutcome outcome = WriteOutcome::kDone;
  uint8_t slot = 0;      ///< if done
  bool dropped = false;  ///< whether another fact was dropped for it
};

class Tag {
 public:
  Tag() : Tag(kDefaultSlots) {}
  /// `slots` from 1 to kMaxSlots.
  explicit Tag(size_t slots) : slots_(slots) {}

  const std::vector<Slot>& slots() const { return slots_; }
  uint16_t generation() const { return generation_; }
  size_t used() const;
  size_t leased() const;
  /// How many privileged and leased blocks it takes; a record of a net may be one more, so that
  /// notes cannot block a net's tag.
  size_t quota() const { return slots_.size() * kProtectedOfEight / 8; }

  /// Writes a block that CheckBlock accepts. Where no slot is named: the block that `is_state`
  /// replaces, else the first empty slot, else that of the oldest block which is neither privileged
  /// nor leased, of equals the first. Leases that have ended count as such only after Expire.
  Written Write(const WriteRequest& request, uint64_t now_ms, const Policy& policy);

  /// Erases a slot for an author: its own block, or any if the author is privileged. An empty slot
  /// stays as it is.
  WriteOutcome Erase(uint8_t slot, int32_t author, std::optional<uint16_t> expected,
                     const Policy& policy);

  /// Erases the blocks whose lease has ended.
  void Expire(uint64_t now_ms);
  /// When the next lease ends; empty if there is none.
  std::optional<uint64_t> NextExpiry() const;

  /// Slots that are taken away must be empty.
  void Resize(size_t slots) { slots_.resize(slots); }

  /// Sets a slot to what it was, when a state is restored.
  void Restore(size_t slot, const Slot& content) { slots_[slot] = content; }
  void RestoreGeneration(uint16_t generation) { generation_ = generation; }

  bool operator==(const Tag&) const = default;

 private:
  std::optional<size_t> SlotFor(const WriteRequest& request, const Policy& policy) const;
  void Set(size_t slot, const Block& block, uint64_t lease_end_ms);

  std::vector<Slot> slots_;
  uint16_t generation_ = 0;
};

}  // namespace pheromone::tags
