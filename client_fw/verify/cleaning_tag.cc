#include "client_fw/verify/cleaning_tag.h"

#include <algorithm>
#include <optional>

namespace pheromone::verify {
namespace {

using tags::Block;
using tags::Slot;
using tags::TypeCode;
using tags::WriteOutcome;

constexpr uint32_t kEpochS = 1'138'451'200;  // of stamp 0
constexpr uint32_t kLaterS = kEpochS + 1'000;
constexpr uint64_t kNowMs = 1'000'000'000;
constexpr uint64_t kUnitMs = 1'000;
constexpr int32_t kEarlier = 100;  // whoever cleaned before
constexpr int32_t kPasserBy = 200;
// Of the predicates, as numbers of strings.
constexpr int32_t kOccupied = 1;
constexpr int32_t kCleaned = 2;
constexpr int32_t kMet = 3;

Block BlockOf(int32_t author, uint32_t time_s, int32_t predicate) {
  return {.author = author,
          .time_s = time_s,
          .subject = {static_cast<int32_t>(TypeCode::kTag), 1},
          .predicate = {0, predicate},
          .object = {static_cast<int32_t>(TypeCode::kDateTime), static_cast<int32_t>(time_s)}};
}

int32_t AuthorOf(size_t robot) {
  return static_cast<int32_t>(robot) + 1;
}

bool Is(const Slot& slot, int32_t predicate) {
  return !slot.block.is_empty() && slot.block.predicate.value == predicate;
}

}  // namespace

bool ZoneContent::is_occupied() const {
  return std::any_of(sign.begin(), sign.end(), [](int it) { return it != kNoSign; });
}

CleaningTag::CleaningTag() : now_ms_(kNowMs) {
  policy_.utc_s = kLaterS;
}

void CleaningTag::Set(const ZoneContent& content) {
  size_t used = 0;
  const auto restore = [&](const Slot& slot) { tag_.Restore(used++, slot); };
  now_ms_ = kNowMs;
  if (content.stamp > 0) {
    restore({BlockOf(kEarlier, kEpochS + static_cast<uint32_t>(content.stamp), kCleaned), 1, 0});
  }
  for (size_t robot = 0; robot < kMaxCleaners; ++robot) {
    const int left = content.sign[robot];
    if (left != kNoSign) {
      restore({BlockOf(AuthorOf(robot), kEpochS, kOccupied), 1,
               left > 0 ? kNowMs + static_cast<uint64_t>(left) * kUnitMs : 0});
    }
  }
  while (used < tag_.slots().size()) {
    restore({});
  }
  tag_.RestoreGeneration(1);
}

ZoneContent CleaningTag::Get() const {
  ZoneContent content;
  for (const Slot& slot : tag_.slots()) {
    if (Is(slot, kCleaned)) {  // several robots' may be there: the last counts
      content.stamp = std::max(content.stamp, static_cast<int>(slot.block.time_s - kEpochS));
    } else if (Is(slot, kOccupied)) {
      const uint64_t left_ms = slot.is_leased() ? slot.lease_end_ms - now_ms_ : 0;
      content.sign[static_cast<size_t>(slot.block.author - 1)] =
          static_cast<int>(left_ms / kUnitMs);
    }
  }
  return content;
}

bool CleaningTag::Claim(size_t robot, std::optional<uint16_t> expected, int lease) {
  const auto lease_ms = static_cast<uint32_t>(lease) * static_cast<uint32_t>(kUnitMs);
  return tag_.Write({.block = BlockOf(AuthorOf(robot), kEpochS, kOccupied),
                     .expected = expected,
                     .lease_ms = lease_ms,
                     .is_state = true},
                    now_ms_, policy_)
             .outcome == WriteOutcome::kDone;
}

bool CleaningTag::Stamp(size_t robot, int stamp) {
  for (size_t i = 0; i < tag_.slots().size(); ++i) {
    const Slot& slot = tag_.slots()[i];
    if (Is(slot, kOccupied) && slot.block.author == AuthorOf(robot)) {
      return tag_.Write({.block = BlockOf(AuthorOf(robot), kEpochS + static_cast<uint32_t>(stamp),
                                          kCleaned),
                         .slot = static_cast<uint8_t>(i),
                         .expected = slot.generation},
                        now_ms_, policy_)
                 .outcome == WriteOutcome::kDone;
    }
  }
  return false;
}

void CleaningTag::Wait(int time) {
  now_ms_ += static_cast<uint64_t>(time) * kUnitMs;
  tag_.Expire(now_ms_);
}

void CleaningTag::Crowd() {
  for (int32_t i = 0; i < 8; ++i) {
    tag_.Write({.block = BlockOf(kPasserBy + i, kLaterS, kMet)}, now_ms_, policy_);
  }
}

}  // namespace pheromone::verify
