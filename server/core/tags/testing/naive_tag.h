// The rules of a tag's memory, restated as a sorted list of what may be dropped. Shares no code
// with the tag under test.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "server/core/tags/tag.h"

namespace pheromone::tags::testing {

struct NaiveSlot {
  std::optional<Block> block;
  uint64_t lease_end_ms = 0;
  uint64_t changes = 0;
};

struct NaiveTag {
  std::vector<NaiveSlot> slots;
  uint64_t changes = 0;
  std::set<int32_t> privileged;

  bool IsProtected(const NaiveSlot& slot) const {
    return slot.block && (slot.lease_end_ms > 0 || privileged.count(slot.block->author) > 0);
  }

  void Put(size_t slot, std::optional<Block> block, uint64_t lease_end_ms) {
    slots[slot].block = block;
    slots[slot].lease_end_ms = lease_end_ms;
    ++slots[slot].changes;
    ++changes;
  }

  WriteOutcome Write(const WriteRequest& request, uint64_t now_ms, int64_t utc_s, size_t* at) {
    if (request.slot && *request.slot >= slots.size()) {
      return WriteOutcome::kNoSuchSlot;
    }
    const uint64_t generation = request.slot ? slots[*request.slot].changes : changes;
    if (request.expected && generation % 65'536 != *request.expected) {
      return WriteOutcome::kGenerationChanged;
    }
    // What may be written to, the best first: rank, time, slot.
    std::vector<std::tuple<int, int64_t, size_t>> choices;
    for (size_t i = 0; i < slots.size(); ++i) {
      const NaiveSlot& slot = slots[i];
      if (request.slot) {
        if (*request.slot == i) {
          choices.emplace_back(0, 0, i);
        }
      } else if (slot.block && request.is_state && slot.block->author == request.block.author &&
                 slot.block->subject == request.block.subject &&
                 slot.block->predicate == request.block.predicate) {
        choices.emplace_back(0, 0, i);
      } else if (!slot.block) {
        choices.emplace_back(1, 0, i);
      } else if (!IsProtected(slot)) {
        const int64_t time_s = slot.block->time_s;
        choices.emplace_back(2, time_s - utc_s > 86'400 ? -1 : time_s, i);
      }
    }
    if (choices.empty()) {
      return WriteOutcome::kFull;
    }
    *at = std::get<2>(*std::min_element(choices.begin(), choices.end()));
    const NaiveSlot& slot = slots[*at];
    const bool writer_is_privileged = privileged.count(request.block.author) > 0;
    if (IsProtected(slot) && slot.block->author != request.block.author && !writer_is_privileged) {
      return WriteOutcome::kProtected;
    }
    if (writer_is_privileged || request.lease_ms > 0) {
      std::vector<NaiveSlot> after = slots;
      after[*at] = {request.block, 1, 0};
      const bool is_record = request.block.subject.space == -32;
      const auto count = [&](const std::vector<NaiveSlot>& of, bool with_records) {
        return std::count_if(of.begin(), of.end(), [&](const NaiveSlot& it) {
          return IsProtected(it) && (with_records || it.block->subject.space != -32);
        });
      };
      const auto limit = static_cast<ptrdiff_t>(slots.size() * 6 / 8 + (is_record ? 1 : 0));
      if (count(after, true) > limit && count(after, is_record) > count(slots, is_record)) {
        return WriteOutcome::kFull;
      }
    }
    Put(*at, request.block, request.lease_ms > 0 ? now_ms + request.lease_ms : 0);
    return WriteOutcome::kDone;
  }

  WriteOutcome Erase(size_t slot, int32_t author, std::optional<uint16_t> expected) {
    if (slot >= slots.size()) {
      return WriteOutcome::kNoSuchSlot;
    }
    if (expected && slots[slot].changes % 65'536 != *expected) {
      return WriteOutcome::kGenerationChanged;
    }
    if (!slots[slot].block) {
      return WriteOutcome::kDone;
    }
    if (slots[slot].block->author != author && privileged.count(author) == 0) {
      return WriteOutcome::kProtected;
    }
    Put(slot, std::nullopt, 0);
    return WriteOutcome::kDone;
  }

  void Expire(uint64_t now_ms) {
    for (size_t i = 0; i < slots.size(); ++i) {
      if (slots[i].lease_end_ms > 0 && slots[i].lease_end_ms <= now_ms) {
        Put(i, std::nullopt, 0);
      }
    }
  }
};

}  // namespace pheromone::tags::testing
