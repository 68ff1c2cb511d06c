#include "server/cluster/election.h"

#include <algorithm>
#include <utility>

namespace pheromone::cluster {
namespace {

// A leader that hands over and is not relieved for so many suspect_ms admits events again.
constexpr uint64_t kRelief = 3;
// A leader without an answer from the log for so many suspect_ms says that it does not lead. Longer
// than the engine needs after a crash: a leader that is relieved loses what is uncommitted.
constexpr uint64_t kPatience = 30;

}  // namespace

Election::Election(ReplicaSettings settings, uint64_t now_ms)
    : settings_(std::move(settings)), awake_ms_(now_ms), sign_ms_(now_ms), beat_ms_(now_ms) {}

void Election::OnHeartbeat(const std::string& from, const Heartbeat& heartbeat, uint64_t now_ms) {
  if (from == settings_.node ||
      std::find(settings_.nodes.begin(), settings_.nodes.end(), from) == settings_.nodes.end()) {
    return;
  }
  peers_[from] = {.heard_ms = now_ms, .is_healthy = heartbeat.is_healthy};
  if (heartbeat.term < leader_.term) {
    return;  // it does not know the leader yet
  }
  if (heartbeat.leads) {
    sign_ms_ = now_ms;
    is_vacant_ = false;
    has_heard_leader_ = true;
  } else if (from == leader_.node && heartbeat.term == leader_.term) {
    if (!is_vacant_) {
      is_vacant_ = true;
      sign_ms_ = now_ms;
    }
    successor_ = heartbeat.successor;
  }
}

void Election::OnLeader(const Leader& leader, uint64_t now_ms) {
  if (!knows_leader_) {
    knows_leader_ = true;
    sign_ms_ = now_ms;
  }
  if (leader.term <= leader_.term) {
    return;
  }
  leader_ = leader;
  const bool is_own = has_asked_ && !is_barred_ && leader.node == settings_.node;
  role_ = is_own ? Role::kCatchesUp : Role::kFollows;
  has_asked_ = false;
  sign_ms_ = now_ms;
  has_heard_leader_ = false;
  is_vacant_ = false;
  hands_over_ = false;
  own_successor_.clear();
  vacated_ms_.reset();
}

void Election::OnLead(const Result<Leader>& now_leading, uint64_t now_ms) {
  is_asking_ = false;
  ask_again_ms_ = now_ms + settings_.heartbeat_ms;
  if (role_ != Role::kTakes) {
    return;  // pages have told more
  }
  role_ = Role::kFollows;
  if (now_leading.ok()) {
    OnLeader(now_leading.value(), now_ms);
  }
}

void Election::Bar() {
  is_barred_ = true;
  role_ = Role::kFollows;
}

void Election::OnCaughtUp() {
  if (role_ == Role::kCatchesUp) {
    role_ = Role::kLeads;
  }
}

void Election::StepDown(const std::string& successor) {
  if (role_ == Role::kLeads && settings_.nodes.size() > 1) {
    hands_over_ = true;
    own_successor_ = successor;
  }
}

std::optional<Term> Election::Ask(uint64_t now_ms) {
  if (now_ms > awake_ms_ + settings_.suspect_ms / 2) {
    sign_ms_ = std::max(sign_ms_, now_ms);
  }
  awake_ms_ = now_ms;
  if (now_ms < TakeoverMs()) {
    return std::nullopt;
  }
  role_ = Role::kTakes;
  has_asked_ = true;
  is_asking_ = true;
  return leader_.term;
}

std::optional<Heartbeat> Election::NextHeartbeat(bool is_drained, uint64_t waits_since_ms,
                                                 Sequence next, uint64_t now_ms) {
  if (settings_.nodes.size() < 2) {
    return std::nullopt;
  }
  if (role_ == Role::kLeads) {
    const bool should_not_lead = !is_healthy_ && HasHealthyPeer(now_ms);
    hands_over_ = hands_over_ || should_not_lead;
    if (vacated_ms_ && now_ms >= *vacated_ms_ + kRelief * settings_.suspect_ms) {
      vacated_ms_.reset();
      hands_over_ = should_not_lead;
    }
    if (hands_over_ && is_drained && !vacated_ms_) {
      vacated_ms_ = now_ms;
    }
  }
  const bool is_stuck =
      waits_since_ms != kNever && now_ms >= waits_since_ms + kPatience * settings_.suspect_ms;
  const bool leads =
      (role_ == Role::kCatchesUp || role_ == Role::kLeads) && !vacated_ms_ && !is_stuck;
  if (now_ms < beat_ms_ && leads == has_told_lead_) {
    return std::nullopt;
  }
  beat_ms_ = now_ms + settings_.heartbeat_ms;
  has_told_lead_ = leads;
  return Heartbeat{.term = leader_.term,
                   .leads = leads,
                   .is_healthy = is_healthy_,
                   .next = next,
                   .successor = own_successor_};
}

uint64_t Election::Deadline() const {
  uint64_t deadline = TakeoverMs();
  if (settings_.nodes.size() > 1) {
    deadline = std::min(deadline, beat_ms_);
  }
  return deadline;  // what happens after vacated_ms_ waits for the next heartbeat
}

uint64_t Election::TakeoverMs() const {
  if (role_ != Role::kFollows || !knows_leader_ || is_asking_ || !is_healthy_ || is_barred_) {
    return kNever;
  }
  uint64_t wait_ms = 0;
  // Of a cluster of one, and after a restart, nobody else is to be waited for.
  if (settings_.nodes.size() > 1 && leader_.node != settings_.node) {
    if (!is_vacant_ || (!successor_.empty() && successor_ != settings_.node)) {
      wait_ms =
          (has_heard_leader_ || leader_.term == 0 ? settings_.suspect_ms : settings_.meet_ms) +
          TurnMs();
    } else if (successor_.empty()) {
      wait_ms = TurnMs();
    }
  }
  return std::max(sign_ms_ + wait_ms, ask_again_ms_);
}

uint64_t Election::TurnMs() const {
  uint64_t turn_ms = 0;
  for (const std::string& node : settings_.nodes) {
    if (node == settings_.node) {
      break;
    }
    const auto peer = peers_.find(node);
    if (node != leader_.node && peer != peers_.end() && peer->second.is_healthy &&
        peer->second.heard_ms + settings_.suspect_ms >= sign_ms_) {
      turn_ms += settings_.heartbeat_ms;
    }
  }
  return turn_ms;
}

bool Election::HasHealthyPeer(uint64_t now_ms) const {
  return std::any_of(peers_.begin(), peers_.end(), [&](const auto& peer) {
    return peer.second.is_healthy && peer.second.heard_ms + settings_.suspect_ms >= now_ms;
  });
}

void Election::Encode(ByteWriter* writer) const {
  writer->U8(static_cast<uint8_t>(role_));
  writer->U64(leader_.term);
  writer->Text(leader_.node);
  for (const bool flag : {knows_leader_, is_healthy_, is_barred_, has_asked_, is_asking_,
                          hands_over_, vacated_ms_.has_value()}) {
    writer->Flag(flag);
  }
}

}  // namespace pheromone::cluster
