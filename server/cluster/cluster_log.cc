#include "server/cluster/cluster_log.h"

#include <cassert>
#include <utility>

#include "server/base/bytes.h"
#include "server/store/journal/format.h"

namespace pheromone::cluster {

using protocol::Reason;

Reason ClusterLog::Admit() {
  {
    const std::lock_guard lock(mutex_);
    if (!leads_ || !trouble_.empty() || pending_.size() >= options_.max_pending) {
      return Reason::kBusy;
    }
  }
  return local_->Admit();
}

uint64_t ClusterLog::Append(const engine::Stamp& stamp, const engine::Event& event) {
  bool is_first = false;
  {
    const std::lock_guard lock(mutex_);
    ++appended_;
    const uint64_t interval = stamp.field_time_ms / kHashEveryMs;
    notes_hash_ = hash_interval_ && *hash_interval_ != interval;
    hash_interval_ = interval;
    if (!leads_) {
      committed_ = appended_;
      const uint64_t sequence = local_->Append(stamp, event);
      assert(sequence == appended_);
      return sequence;
    }
    is_first = collected_ == pending_.size();
    pending_.push_back({appended_, 0, stamp, event});
  }
  if (is_first) {
    options_.submitted();
  }
  return appended_;
}

bool ClusterLog::IsRotationDue() const {
  {
    const std::lock_guard lock(mutex_);
    if (notes_hash_) {
      return true;
    }
    if (rotates_) {
      return false;
    }
  }
  return local_->IsRotationDue();
}

void ClusterLog::Rotate(uint64_t state_hash) {
  const std::lock_guard lock(mutex_);
  if (std::exchange(notes_hash_, false)) {
    hashes_.push_back({appended_, state_hash});
  }
  if (rotates_ || !local_->IsRotationDue()) {
    return;
  }
  if (pending_.empty()) {
    local_->Rotate(state_hash);
  } else {
    rotates_ = true;
    pending_.push_back({0, state_hash, {}, {}});
  }
}

uint64_t ClusterLog::DurableSequence() const {
  const std::lock_guard lock(mutex_);
  return committed_;
}

bool ClusterLog::WhenDurable(uint64_t sequence, std::function<void()> done) {
  {
    const std::lock_guard lock(mutex_);
    if (sequence > committed_) {
      if (waiters_.size() >= kMaxDurableWaiters) {
        return false;
      }
      waiters_.push_back({sequence, std::move(done)});
      return true;
    }
  }
  done();
  return true;
}

std::string ClusterLog::Trouble() const {
  {
    const std::lock_guard lock(mutex_);
    if (!trouble_.empty()) {
      return trouble_;
    }
  }
  return local_->Trouble();
}

void ClusterLog::Lead() {
  const std::lock_guard lock(mutex_);
  leads_ = true;
  trouble_.clear();
}

void ClusterLog::EndLead() {
  const std::lock_guard lock(mutex_);
  leads_ = false;
}

bool ClusterLog::leads() const {
  const std::lock_guard lock(mutex_);
  return leads_;
}

void ClusterLog::SetTrouble(std::string trouble) {
  const std::lock_guard lock(mutex_);
  trouble_ = std::move(trouble);
}

// The service's lock is not held while they are encoded.
std::vector<ClusterLog::Submitted> ClusterLog::CollectSubmitted() {
  std::vector<Pending> events;
  {
    const std::lock_guard lock(mutex_);
    for (; collected_ < pending_.size(); ++collected_) {
      if (pending_[collected_].sequence != 0) {
        events.push_back(pending_[collected_]);
      }
    }
  }
  std::vector<Submitted> submitted;
  ByteWriter scratch;
  for (const Pending& it : events) {
    submitted.push_back({it.sequence, {}});
    journal::AppendEvent(it.sequence, it.stamp, it.event, &scratch, &submitted.back().record);
  }
  return submitted;
}

std::vector<ClusterLog::StateHash> ClusterLog::CollectHashes() {
  const std::lock_guard lock(mutex_);
  return std::exchange(hashes_, {});
}

void ClusterLog::Commit(uint64_t sequence) {
  std::vector<std::function<void()>> ready;
  {
    const std::lock_guard lock(mutex_);
    while (!pending_.empty() && pending_.front().sequence <= sequence) {
      const Pending& it = pending_.front();
      if (it.sequence == 0) {
        local_->Rotate(it.hash);
        rotates_ = false;
      } else {
        [[maybe_unused]] const uint64_t given = local_->Append(it.stamp, it.event);
        assert(given == it.sequence);
        committed_ = it.sequence;
      }
      pending_.pop_front();
      collected_ -= collected_ > 0 ? 1 : 0;
    }
    std::erase_if(waiters_, [&](Waiter& it) {
      const bool is_ready = it.sequence <= committed_;
      if (is_ready) {
        ready.push_back(std::move(it.done));
      }
      return is_ready;
    });
  }
  options_.committed();
  for (const auto& done : ready) {
    done();
  }
}

uint64_t ClusterLog::appended() const {
  const std::lock_guard lock(mutex_);
  return appended_;
}

}  // namespace pheromone::cluster
