#include "server/cluster/testing/memory_log.h"

#include <algorithm>
#include <cassert>

namespace pheromone::cluster {

void MemoryEngine::Release() {
  const std::list<std::function<void()>> held = std::exchange(held_, {});
  for (const std::function<void()>& arrive : held) {
    arrive();
  }
}

void MemoryEngine::Wipe(std::string new_id) {
  new_id_ = std::move(new_id);
  id_.clear();
  leader_ = {};
  floor_ = 1;
  groups_.clear();
  registers_.clear();
  Publish();
}

void MemoryEngine::Forget(Sequence from) {
  groups_.erase(groups_.lower_bound(from), groups_.end());
  for (MemoryLog* const client : clients_) {
    client->is_found_ = false;
  }
  Publish();
}

Leader MemoryEngine::TakeLead(Term seen, const std::string& node) {
  if (leader_.term == seen) {
    leader_ = {++revision_, node};
    id_ = seen == 0 ? new_id_ : id_;
    Publish();
  }
  return leader_;
}

Appended MemoryEngine::Append(const Group& group) {
  assert(group.first > 0 && group.count > 0);
  const auto there = groups_.find(group.first);
  if (there != groups_.end()) {
    return there->second == group ? Appended::kCommitted : Appended::kFenced;
  }
  if (leader_.term != group.term) {
    return Appended::kFenced;
  }
  ++revision_;
  groups_.emplace(group.first, group);
  Publish();
  return Appended::kCommitted;
}

void MemoryEngine::Trim(Sequence floor) {
  if (floor <= floor_) {
    return;
  }
  ++revision_;
  floor_ = floor;
  std::erase_if(groups_,
                [&](const auto& entry) { return entry.first + entry.second.count <= floor; });
  Publish();
}

Register MemoryEngine::Set(const std::string& name, uint64_t seen, const std::string& value) {
  Register& it = registers_[name];
  if (it.revision == seen) {
    it = {++revision_, value};
  }
  return it;
}

void MemoryEngine::Publish() {
  for (MemoryLog* const client : clients_) {
    client->TellNews();
  }
}

MemoryLog::MemoryLog(MemoryEngine* engine, Post post)
    : engine_(engine), post_(std::move(post)), self_(std::make_shared<MemoryLog*>(this)) {
  engine_->clients_.push_back(this);
}

MemoryLog::~MemoryLog() {
  Stop();
  engine_->clients_.remove(this);
}

void MemoryLog::Stop() {
  *self_ = nullptr;
  news_ = nullptr;
  paused_calls_.clear();
  give_up_.clear();
}

void MemoryLog::CallBack(std::function<void()> call) {
  post_([self = self_, call = std::move(call)]() mutable {
    if (*self == nullptr) {
      return;
    }
    if ((*self)->is_paused_) {
      (*self)->paused_calls_.push_back(std::move(call));
    } else {
      call();
    }
  });
}

template <typename Outcome>
void MemoryLog::Request(std::function<Outcome()> execute, std::function<void(Outcome)> done,
                        Outcome no_answer) {
  // The first that tells ends it.
  const auto is_told = std::make_shared<bool>(false);
  const auto tell = [self = self_, is_told, done = std::move(done)](Outcome outcome) {
    if (*self != nullptr && !std::exchange(*is_told, true)) {
      (*self)->CallBack([done, outcome = std::move(outcome)] { done(outcome); });
    }
  };
  switch (is_cut_off_ ? Fault::kRequestLost : fault_) {
    case Fault::kNone:
      tell(execute());
      break;
    case Fault::kRequestLost:
      tell(std::move(no_answer));
      break;
    case Fault::kAnswerLost:
      static_cast<void>(execute());
      tell(std::move(no_answer));
      break;
    case Fault::kDelayed:
      engine_->held_.push_back([tell, execute = std::move(execute)] { tell(execute()); });
      give_up_.push_back([tell, no_answer = std::move(no_answer)] { tell(no_answer); });
      break;
    case Fault::kDoubled:
      tell(execute());
      engine_->held_.push_back([execute = std::move(execute)] { static_cast<void>(execute()); });
      break;
  }
}

void MemoryLog::GiveUp() {
  for (const std::function<void()>& tell : std::exchange(give_up_, {})) {
    tell();
  }
}

void MemoryLog::SetCutOff(bool is_cut_off) {
  if (is_cut_off && !is_cut_off_ && news_) {
    CallBack([this, followed = followed_] {
      if (followed == followed_) {
        news_(Error{"the engine does not respond"});
      }
    });
  }
  is_cut_off_ = is_cut_off;
  TellNews();
}

void MemoryLog::SetPaused(bool is_paused) {
  is_paused_ = is_paused;
  if (!is_paused) {
    for (std::function<void()>& call : std::exchange(paused_calls_, {})) {
      CallBack(std::move(call));
    }
  }
}

void MemoryLog::TakeLead(Term seen, const std::string& node,
                         std::function<void(const Result<Leader>&)> done) {
  Request<Result<Leader>>(
      [engine = engine_, seen, node] { return Result<Leader>(engine->TakeLead(seen, node)); },
      std::move(done), Error{"no answer"});
}

void MemoryLog::Append(const Group& group, std::function<void(Appended)> done) {
  Request<Appended>([engine = engine_, group] { return engine->Append(group); }, std::move(done),
                    Appended::kUnknown);
}

void MemoryLog::Trim(Sequence floor, std::function<void(const Status&)> done) {
  Request<Status>(
      [engine = engine_, floor] {
        engine->Trim(floor);
        return Ok();
      },
      std::move(done), Error{"no answer"});
}

void MemoryLog::Transfer(std::function<void(const Status&)> done) {
  ++transfers_;
  Request<Status>([] { return Ok(); }, std::move(done), Error{"no answer"});
}

void MemoryLog::ReadRegister(const std::string& name,
                             std::function<void(const Result<Register>&)> done) {
  Request<Result<Register>>(
      [engine = engine_, name] { return Result<Register>(engine->registers_[name]); },
      std::move(done), Error{"no answer"});
}

void MemoryLog::SetRegister(const std::string& name, uint64_t seen, const std::string& value,
                            std::function<void(const Result<Register>&)> done) {
  Request<Result<Register>>([engine = engine_, name, seen,
                             value] { return Result<Register>(engine->Set(name, seen, value)); },
                            std::move(done), Error{"no answer"});
}

void MemoryLog::Follow(Sequence from, std::function<void(const Result<Page>&)> news) {
  ++followed_;
  news_ = std::move(news);
  next_ = from;
  is_found_ = false;
  is_news_posted_ = false;
  TellNews();
}

// What was missed while it waits, or is paused, is in the same page.
void MemoryLog::TellNews() {
  if (!news_ || is_cut_off_ || is_news_posted_) {
    return;
  }
  is_news_posted_ = true;
  CallBack([this, followed = followed_] {
    if (followed != followed_) {
      return;
    }
    is_news_posted_ = false;
    if (!is_cut_off_) {
      const auto news = news_;  // it may call Follow
      news(Read());
    }
  });
}

Result<Page> MemoryLog::Read() {
  const std::map<Sequence, Group>& groups = engine_->groups_;
  Page page{engine_->id_, engine_->leader_, engine_->floor_, engine_->floor_, {}};
  if (!groups.empty()) {
    page.next = std::max(page.floor, groups.rbegin()->first + groups.rbegin()->second.count);
  }
  if (!is_found_ || !groups.contains(next_)) {
    next_ = std::max(next_, page.floor);
    const auto after = groups.upper_bound(next_);
    if (after != groups.begin()) {
      const Group& before = std::prev(after)->second;
      next_ = before.first + before.count > next_ ? before.first : next_;
    }
    is_found_ = true;
  }
  auto group = groups.lower_bound(next_);
  if (group != groups.end() && group->first != next_) {
    return Error{"the log has a gap at " + std::to_string(next_)};
  }
  for (; group != groups.end() && group->first == next_; ++group) {
    page.groups.push_back(group->second);
    next_ += group->second.count;
  }
  return page;
}

}  // namespace pheromone::cluster
