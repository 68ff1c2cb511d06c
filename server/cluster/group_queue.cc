#include "server/cluster/group_queue.h"

#include <cassert>
#include <utility>

namespace pheromone::cluster {

void GroupQueue::Begin(Term term, Sequence next) {
  assert(empty());
  term_ = term;
  next_ = next;
}

void GroupQueue::Push(Sequence sequence, std::string record) {
  assert(sequence == next_ + records_.size());
  (void)sequence;
  records_.push_back(std::move(record));
}

const Group* GroupQueue::Due(uint64_t now_ms) {
  if (now_ms < Deadline()) {
    return nullptr;
  }
  if (!in_flight_) {
    Group group{.first = next_, .count = 0, .term = term_, .records = {}};
    while (!records_.empty() &&
           (group.count == 0 || group.records.size() + records_.front().size() <= group_bytes_)) {
      group.records += records_.front();
      records_.pop_front();
      ++group.count;
    }
    next_ += group.count;
    in_flight_ = std::move(group);
    begun_ms_ = now_ms;
    due_ms_ = now_ms + group_ms_;
  }
  is_appended_ = true;
  return &*in_flight_;
}

void GroupQueue::Repeat(uint64_t now_ms) {
  is_appended_ = false;
  due_ms_ = now_ms + pause_ms_;
}

Group GroupQueue::Commit() {
  assert(in_flight_);
  Group group = std::move(*in_flight_);
  in_flight_.reset();
  is_appended_ = false;
  return group;
}

uint64_t GroupQueue::Deadline() const {
  return empty() || is_appended_ ? kNever : due_ms_;
}

void GroupQueue::Encode(ByteWriter* writer) const {
  writer->U64(term_);
  writer->U64(next_);
  writer->Flag(in_flight_.has_value());
  if (in_flight_) {
    writer->U64(in_flight_->first);
    writer->U32(in_flight_->count);
    writer->U64(in_flight_->term);
    writer->Text(in_flight_->records);
    writer->Flag(is_appended_);
  }
  writer->Count(records_.size());
  for (const std::string& record : records_) {
    writer->Text(record);
  }
}

}  // namespace pheromone::cluster
