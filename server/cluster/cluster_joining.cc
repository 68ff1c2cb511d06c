// To which log a server belongs, and whose state it has: the part of Cluster for servers that join,
// begin a log anew, or have diverged.
#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "server/cluster/cluster.h"

namespace pheromone::cluster {
namespace {

constexpr uint64_t kBetweenJoinsMs = 500;  // after one that did not succeed

}  // namespace

// A new log whose first event comes after those of the journal. True: the page is of before.
bool Cluster::Found(const Page& page) {
  if (!founds_) {
    return false;
  }
  const bool is_new = page.id.empty() && page.leader.term == 0;
  if (is_new && page.floor < replica_.committed() + 1) {
    log_->Trim(replica_.committed() + 1, [this](const Status& begun) {
      if (is_stopped_) {
        return;
      }
      if (!begun.ok()) {
        const std::lock_guard lock(mutex_);
        view_.trouble = begun.error();
      }
      Follow();
    });
    return true;
  }
  founds_ = is_new;
  if (!is_new && page.id != settings_.id) {
    replica_.Bar(LogGap::kOtherLog);
  }
  return false;
}

// False: this process ends.
bool Cluster::NoteId() {
  if (noted_id_ == replica_.id() || replica_.gap() == LogGap::kOtherLog) {
    return true;
  }
  const Status noted = parts_.on_id(replica_.id());
  if (!noted.ok()) {
    parts_.restart("the cluster's ID could not be written beside the journal: " +
                   std::string(noted.error()));
    Stop();
    return false;
  }
  noted_id_ = replica_.id();
  return true;
}

void Cluster::NoteHashes() {
  for (const ClusterLog::StateHash& it : parts_.log->CollectHashes()) {
    hashes_.Note(it.sequence, it.hash);
  }
}

// The leader's state is the one that counts: with two servers there is no majority that could say
// which of them is wrong.
void Cluster::Compare(const std::string& from, const Heartbeat& beat) {
  NoteHashes();
  if (beat.hashed != 0) {
    hashes_.Hear(from, beat.hashed, beat.hash);
  }
  const std::string& leader = replica_.leader().node;
  const bool is_leaders = from == leader && from != settings_.node;
  if (!is_leaders && !parts_.log->leads()) {
    return;
  }
  const auto sequence = hashes_.Difference(from, replica_.committed());
  if (!sequence) {
    return;
  }
  const std::string after = " after event " + std::to_string(*sequence);
  if (!is_leaders) {
    ++divergences_;
    parts_.warn("divergence: node " + from + " has another state than this one" + after +
                "; it takes this one's");
  } else if (replica_.gap() == LogGap::kNone) {
    DropState("node " + from + ", which leads, has another state than this one" + after);
    // So that the leader counts it, too: this process may end before its next heartbeat.
    parts_.send(from, Heartbeat{.term = replica_.leader().term,
                                .is_healthy = false,
                                .next = replica_.committed() + 1,
                                .hashed = *sequence,
                                .hash = *hashes_.Own(*sequence)});
  }
}

// What the log has further makes this state no better.
void Cluster::DropState(const std::string& why) {
  ++divergences_;
  parts_.warn("divergence: " + why + "; this state is dropped, and the leader's taken");
  to_apply_.clear();
  replica_.Bar(LogGap::kDiverged);
}

// Takes a state, if one is needed: for a divergence that of the leader. Otherwise rather that of a
// follower, which has less to do.
void Cluster::Join(uint64_t now_ms) {
  receiver_.Continue(now_ms);
  const LogGap gap = replica_.gap();
  if ((gap != LogGap::kTrimmed && gap != LogGap::kDiverged) || parts_.folder == nullptr ||
      receiver_.is_busy() || now_ms < join_ms_) {
    return;
  }
  const Sequence least = std::max(floor_, parts_.log->appended() + 1) - 1;
  std::vector<std::string> candidates;
  for (const bool leads : {false, true}) {
    for (const auto& [node, beat] : told_) {
      if (beat.leads == leads && beat.next > least && (leads || gap == LogGap::kTrimmed)) {
        candidates.push_back(node);
      }
    }
  }
  join_ms_ = now_ms + kBetweenJoinsMs;
  if (candidates.empty()) {
    join_trouble_ = "no server is connected that has a state to give";
    return;
  }
  const auto last = std::find(candidates.begin(), candidates.end(), join_asked_);
  join_asked_ = last == candidates.end() || std::next(last) == candidates.end() ? candidates.front()
                                                                                : *std::next(last);
  receiver_.Begin(join_asked_, least, now_ms);
}

void Cluster::OnJoined(const Result<uint64_t>& sequence) {
  if (is_stopped_) {
    return;
  }
  if (sequence.ok() && sequence.value() + 1 < floor_) {
    join_trouble_ = "the log was trimmed beyond the state that came";
  } else if (sequence.ok()) {
    parts_.restart("took the state after event " + std::to_string(sequence.value()) + " from " +
                   join_asked_);
    Stop();
    return;
  } else {
    join_trouble_ = sequence.error();
  }
  join_ms_ = parts_.now_ms() + kBetweenJoinsMs;
}

std::string Cluster::DescribeTransfer() const {
  if (receiver_.is_busy()) {
    return "takes the state of " + receiver_.from() + ": " +
           std::to_string(receiver_.bytes() >> 10) + " KiB so far";
  }
  if (!sender_.to().empty()) {
    return "gives its state to " + sender_.to();
  }
  return join_trouble_.empty() ? "" : "will take a state: " + join_trouble_;
}

}  // namespace pheromone::cluster
