#include "server/cluster/replica.h"

#include <algorithm>
#include <utility>

namespace pheromone::cluster {

std::string_view TextOf(LogGap gap) {
  switch (gap) {
    case LogGap::kTrimmed:
      return "the cluster's log no longer has the events that come next here: this server takes "
             "the state of another one and starts again";
    case LogGap::kRewound:
      return "the cluster's log lacks events that were applied here: it was lost, or an older one "
             "restored; this server answers queries only: see pheromoned(8), CLUSTER";
    case LogGap::kOtherLog:
      return "etcd has the log of another cluster, or was wiped; this server answers queries only: "
             "see pheromoned(8), CLUSTER";
    case LogGap::kDiverged:
      return "the state here is not the leader's: this server takes the leader's and starts again";
    case LogGap::kNone:
      break;
  }
  return "";
}

Replica::Replica(ReplicaSettings settings, Sequence next, uint64_t now_ms)
    : id_(settings.id),
      election_(std::move(settings), now_ms),
      queue_(election_.settings()),
      next_(next),
      follow_from_(std::max<Sequence>(next, 2) - 1) {}

void Replica::OnHeartbeat(const std::string& from, const Heartbeat& heartbeat, uint64_t now_ms) {
  election_.OnHeartbeat(from, heartbeat, now_ms);
}

void Replica::OnPage(const Page& page, uint64_t now_ms) {
  if (is_deposed_) {
    return;
  }
  if (!IsSameLog(page)) {
    Bar(LogGap::kOtherLog);
    return;
  }
  if (!page_next_ && gap_ == LogGap::kNone) {
    CheckFirst(page);
  }
  for (const Group& group : page.groups) {
    if (is_deposed_ || gap_ != LogGap::kNone) {
      break;
    }
    Receive(group, page.leader, now_ms);
  }
  if (gap_ != LogGap::kNone) {
    Bar(gap_);
  }
  const Term known = election_.leader().term;
  election_.OnLeader(page.leader, now_ms);
  if (page.leader.term > known && !queue_.empty()) {
    is_deposed_ = true;  // the page has all that there ever will be of earlier terms
  }
  has_caught_up_ =
      role() == Role::kCatchesUp && (has_caught_up_ || page.leader.term == election_.leader().term);
}

void Replica::Bar(LogGap gap) {
  gap_ = gap;
  is_deposed_ = is_deposed_ || !queue_.empty();
  election_.Bar();
}

// A log without an ID is empty.
bool Replica::IsSameLog(const Page& page) {
  if (id_.empty()) {
    id_ = page.id;
  }
  return page.id == id_;
}

void Replica::CheckFirst(const Page& page) {
  const Sequence begin = page.groups.empty() ? next_ : page.groups.front().first;
  if (page.floor > next_ || begin > next_) {
    gap_ = LogGap::kTrimmed;
  } else if (next_ > 1 && page.floor < next_ &&
             (page.groups.empty() || begin + page.groups.front().count < next_)) {
    gap_ = LogGap::kRewound;  // the last event that was applied is neither there nor trimmed
  }
  page_next_ = begin;
}

void Replica::Receive(const Group& group, const Leader& leader, uint64_t now_ms) {
  if (group.first != *page_next_) {
    gap_ = group.first > *page_next_ ? LogGap::kTrimmed : LogGap::kRewound;
    return;
  }
  page_next_ = group.first + group.count;
  if (*page_next_ <= next_) {
    return;  // applied before, or committed by the answer to its append
  }
  election_.OnProgress(now_ms);
  if (queue_.in_flight() == group) {
    CommitOwn();
  } else if (!queue_.empty() ||
             (role() == Role::kLeads && leader.term == election_.leader().term)) {
    is_deposed_ = true;  // another one's, where only this daemon should write
  } else {
    ready_.push_back(group);
    next_ = *page_next_;
  }
}

void Replica::CommitOwn() {
  ready_.push_back(queue_.Commit());
  ++ready_own_;
  next_ = ready_.back().first + ready_.back().count;
}

void Replica::OnLead(const Result<Leader>& leader, uint64_t now_ms) {
  election_.OnLead(leader, now_ms);
}

void Replica::OnAppended(Appended outcome, uint64_t now_ms) {
  is_appending_ = false;
  if (is_deposed_ || !queue_.in_flight()) {
    return;  // a page was first; another group was not begun meanwhile
  }
  switch (outcome) {
    case Appended::kCommitted:
      election_.OnProgress(now_ms);
      CommitOwn();
      break;
    case Appended::kFenced:
      is_deposed_ = true;
      break;
    case Appended::kUnknown:
      queue_.Repeat(now_ms);
      break;
  }
}

void Replica::Submit(Sequence sequence, std::string record) {
  if (role() == Role::kLeads) {
    queue_.Push(sequence, std::move(record));
  } else {
    is_deposed_ = true;
  }
}

Replica::Actions Replica::Next(uint64_t now_ms) {
  Actions actions;
  actions.committed = std::exchange(ready_, {});
  actions.own = std::exchange(ready_own_, 0);
  actions.is_deposed = is_deposed_;
  if (is_deposed_) {
    return actions;
  }
  if (std::exchange(has_caught_up_, false)) {
    election_.OnCaughtUp();
    queue_.Begin(election_.leader().term, next_);
  }
  actions.take_lead = election_.Ask(now_ms);
  if (role() == Role::kLeads && !is_appending_) {
    if (const Group* const group = queue_.Due(now_ms)) {
      actions.append = *group;
      is_appending_ = true;
    }
  }
  actions.heartbeat =
      election_.NextHeartbeat(queue_.empty(), queue_.in_flight_since_ms(), next_, now_ms);
  return actions;
}

uint64_t Replica::Deadline() const {
  if (!ready_.empty() || has_caught_up_) {
    return 0;
  }
  if (is_deposed_) {
    return kNever;
  }
  return std::min(election_.Deadline(), is_appending_ ? kNever : queue_.Deadline());
}

void Replica::Encode(ByteWriter* writer) const {
  election_.Encode(writer);
  queue_.Encode(writer);
  writer->U64(next_);
  writer->U64(follow_from_);
  writer->U64(page_next_.value_or(0));
  writer->Flag(is_appending_);
  writer->Flag(has_caught_up_);
  writer->Flag(is_deposed_);
  writer->U8(static_cast<uint8_t>(gap_));
  writer->Count(ready_.size());  // Next was called: none
}

}  // namespace pheromone::cluster
