#include "client_fw/experiments/channel/delivery.h"

#include <algorithm>

namespace pheromone::swarm {

DeliveryRecord::DeliveryRecord(const Rules& rules)
    : rules_(rules), last_answer_ms_(rules.from_ms) {}

void DeliveryRecord::StartClock(int64_t ms) {
  if (clock_runs_) {
    PassOver(ms - 1);
  }
  clock_runs_ = true;
  next_due_ms_ = ms;
}

void DeliveryRecord::OnAnswer(int64_t ms) {
  if (ms >= rules_.from_ms && ms <= rules_.to_ms) {
    ++answers_;
    longest_gap_ms_ = std::max(longest_gap_ms_, ms - last_answer_ms_);
    last_answer_ms_ = ms;
  }
  if (!clock_runs_) {
    return;
  }
  if (next_due_ms_ > ms) {
    MakeGood(ms);
    return;
  }
  if (Counts(next_due_ms_)) {
    ++due_;
    delivered_ += ms - next_due_ms_ <= rules_.deadline_ms ? 1 : 0;
    latencies_ms_.push_back(ms - next_due_ms_);
  }
  next_due_ms_ += rules_.period_ms;
  PassOver(ms);
}

void DeliveryRecord::Finish() {
  if (clock_runs_) {
    PassOver(rules_.to_ms);
  }
  longest_gap_ms_ = std::max(longest_gap_ms_, rules_.to_ms - last_answer_ms_);
}

bool DeliveryRecord::Counts(int64_t due_ms) const {
  return due_ms >= rules_.from_ms && due_ms + rules_.deadline_ms <= rules_.to_ms;
}

// Requests due until then are lost.
void DeliveryRecord::PassOver(int64_t until_ms) {
  for (; next_due_ms_ <= until_ms; next_due_ms_ += rules_.period_ms) {
    if (Counts(next_due_ms_)) {
      ++due_;
      lost_ms_.push_back(next_due_ms_);
    }
  }
}

void DeliveryRecord::MakeGood(int64_t ms) {
  if (!lost_ms_.empty() && ms - lost_ms_.back() <= rules_.deadline_ms) {
    ++delivered_;
    lost_ms_.pop_back();
  }
}

}  // namespace pheromone::swarm
