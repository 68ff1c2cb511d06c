#include "server/core/engine/service/held_answers.h"

#include <algorithm>

namespace pheromone::engine {
namespace {

bool Same(const protocol::Message& a, const protocol::Message& b) {
  return a.id == b.id && a.opcode == b.opcode && a.length == b.length &&
         std::equal(a.data, a.data + a.length, b.data);
}

}  // namespace

std::optional<HeldAnswers::Dropped> HeldAnswers::Hold(const Outgoing& answer) {
  if (answer.link >= links_.size()) {
    links_.resize(size_t{answer.link} + 1);
  }
  if (links_[answer.link] == nullptr) {
    links_[answer.link] = std::make_unique<std::array<Slot, 256>>();
  }
  const uint32_t place = Place(answer.link, answer.message.id);
  Slot& slot = At(place);
  std::optional<Dropped> dropped;
  if (slot.held) {
    // It keeps its place, even for another HELLO, which is a new change with the same answer: else
    // a robot that repeats it faster than the disk syncs would never be answered.
    if (Same(slot.answer.message, answer.message)) {
      slot.answer.asker = answer.asker;
      return Dropped{answer, true};
    }
    dropped = Dropped{slot.answer, false};
    Unlink(&slot);
  }
  slot.held = true;
  slot.answer = answer;
  slot.due = std::max(answer.durable_at, last_ != kNone ? At(last_).due : 0);
  slot.previous = last_;
  slot.next = kNone;
  (last_ != kNone ? At(last_).next : first_) = place;
  last_ = place;
  ++count_;
  return dropped;
}

std::optional<HeldAnswers::Dropped> HeldAnswers::Drop(LinkIndex link, uint8_t id) {
  if (link >= links_.size() || links_[link] == nullptr) {
    return std::nullopt;
  }
  Slot& slot = At(Place(link, id));
  if (!slot.held) {
    return std::nullopt;
  }
  Unlink(&slot);
  return Dropped{slot.answer, false};
}

void HeldAnswers::Unlink(Slot* slot) {
  (slot->previous != kNone ? At(slot->previous).next : first_) = slot->next;
  (slot->next != kNone ? At(slot->next).previous : last_) = slot->previous;
  slot->held = false;
  --count_;
}

void HeldAnswers::Release(uint64_t durable, std::vector<Outgoing>* out) {
  while (true) {
    Slot* const slot = first_ != kNone ? &At(first_) : nullptr;
    const bool is_command =
        !commands_.empty() && (slot == nullptr || commands_.front().durable_at < slot->due);
    const uint64_t due = is_command        ? commands_.front().durable_at
                         : slot != nullptr ? slot->due
                                           : 0;
    if ((!is_command && slot == nullptr) || due > durable) {
      return;
    }
    if (is_command) {
      out->push_back(commands_.front());
      commands_.pop_front();
    } else {
      out->push_back(slot->answer);
      Unlink(slot);
    }
  }
}

}  // namespace pheromone::engine
