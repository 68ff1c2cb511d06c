#include "server/core/tags/tag.h"

#include <algorithm>
#include <cassert>

namespace pheromone::tags {
namespace {

bool IsSameFact(const Block& a, const Block& b) {
  return a.author == b.author && a.subject == b.subject && a.predicate == b.predicate;
}

}  // namespace

int64_t AgeKey(const Block& block, int64_t utc_s) {
  const int64_t time_s = block.time_s;
  return time_s > utc_s + kMaxAheadS ? -1 : time_s;
}

bool Policy::IsPrivileged(int32_t author) const {
  return std::binary_search(privileged.begin(), privileged.end(), author);
}

size_t Tag::used() const {
  return static_cast<size_t>(std::count_if(
      slots_.begin(), slots_.end(), [](const Slot& slot) { return !slot.block.is_empty(); }));
}

size_t Tag::leased() const {
  return static_cast<size_t>(std::count_if(slots_.begin(), slots_.end(),
                                           [](const Slot& slot) { return slot.is_leased(); }));
}

std::optional<size_t> Tag::SlotFor(const WriteRequest& request, const Policy& policy) const {
  const auto begin = slots_.begin();
  if (request.is_state) {
    const auto same = std::find_if(begin, slots_.end(), [&](const Slot& slot) {
      return IsSameFact(slot.block, request.block);
    });
    if (same != slots_.end()) {
      return same - begin;
    }
  }
  const auto empty =
      std::find_if(begin, slots_.end(), [](const Slot& slot) { return slot.block.is_empty(); });
  if (empty != slots_.end()) {
    return empty - begin;
  }
  std::optional<size_t> oldest;
  for (size_t i = 0; i < slots_.size(); ++i) {
    if (!policy.IsProtected(slots_[i]) &&
        (!oldest ||
         AgeKey(slots_[i].block, policy.utc_s) < AgeKey(slots_[*oldest].block, policy.utc_s))) {
      oldest = i;
    }
  }
  return oldest;
}

Written Tag::Write(const WriteRequest& request, uint64_t now_ms, const Policy& policy) {
  assert(CheckBlock(request.block).ok() && request.lease_ms <= kMaxLeaseMs);
  if (request.slot && *request.slot >= slots_.size()) {
    return {WriteOutcome::kNoSuchSlot};
  }
  if (request.expected &&
      *request.expected != (request.slot ? slots_[*request.slot].generation : generation_)) {
    return {WriteOutcome::kGenerationChanged};
  }
  const int32_t author = request.block.author;
  const bool is_privileged = policy.IsPrivileged(author);
  const std::optional<size_t> chosen = request.slot ? *request.slot : SlotFor(request, policy);
  if (!chosen) {
    return {WriteOutcome::kFull};
  }
  const Slot& slot = slots_[*chosen];
  const bool is_own = slot.block.author == author;
  if (request.slot && !slot.block.is_empty() && !is_own && !is_privileged &&
      policy.IsProtected(slot)) {
    return {WriteOutcome::kProtected};
  }
  const bool is_record = request.block.is_net_record();
  const bool was_protected = policy.IsProtected(slot) && (is_record || !slot.block.is_net_record());
  if ((is_privileged || request.lease_ms > 0) && !was_protected) {
    size_t others = 0;
    for (size_t i = 0; i < slots_.size(); ++i) {
      others += i != *chosen && !slots_[i].block.is_empty() && policy.IsProtected(slots_[i]);
    }
    if (others >= quota() + (is_record ? 1 : 0)) {
      return {WriteOutcome::kFull};
    }
  }
  const bool drops = !slot.block.is_empty() && !IsSameFact(slot.block, request.block);
  Set(*chosen, request.block, request.lease_ms > 0 ? now_ms + request.lease_ms : 0);
  return {WriteOutcome::kDone, static_cast<uint8_t>(*chosen), drops};
}

WriteOutcome Tag::Erase(uint8_t slot, int32_t author, std::optional<uint16_t> expected,
                        const Policy& policy) {
  if (slot >= slots_.size()) {
    return WriteOutcome::kNoSuchSlot;
  }
  const Slot& present = slots_[slot];
  if (expected && *expected != present.generation) {
    return WriteOutcome::kGenerationChanged;
  }
  if (present.block.is_empty()) {
    return WriteOutcome::kDone;
  }
  if (present.block.author != author && !policy.IsPrivileged(author)) {
    return WriteOutcome::kProtected;
  }
  Set(slot, {}, 0);
  return WriteOutcome::kDone;
}

void Tag::Expire(uint64_t now_ms) {
  for (size_t i = 0; i < slots_.size(); ++i) {
    if (slots_[i].is_leased() && slots_[i].lease_end_ms <= now_ms) {
      Set(i, {}, 0);
    }
  }
}

std::optional<uint64_t> Tag::NextExpiry() const {
  std::optional<uint64_t> next;
  for (const Slot& slot : slots_) {
    if (slot.is_leased() && (!next || slot.lease_end_ms < *next)) {
      next = slot.lease_end_ms;
    }
  }
  return next;
}

void Tag::Set(size_t slot, const Block& block, uint64_t lease_end_ms) {
  Slot& it = slots_[slot];
  it = {block, static_cast<uint16_t>(it.generation + 1), lease_end_ms};
  ++generation_;
}

}  // namespace pheromone::tags
