#include "server/core/engine/service/service.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace pheromone::engine {
namespace {

using protocol::Message;
using protocol::Reason;

// Whether this answers a request of the kind whose answers wait; a robot has one in flight.
bool AnswersAChange(const Engine& engine, const Message& message) {
  protocol::ErrorAnswer error;
  return engine.GoesThroughLog(protocol::Decode(message, &error) ? error.refused_opcode
                                                                 : message.opcode);
}

// Whether a server that has not followed everything yet would refuse so: the robot may have said
// HELLO, or used the number before, at another server a moment ago.
bool SeemsBehind(std::span<const Outgoing> answers) {
  protocol::ErrorAnswer error;
  return !answers.empty() && protocol::Decode(answers.back().message, &error) &&
         (error.reason == Reason::kSayHello || error.reason == Reason::kSequenceReused);
}

}  // namespace

Service::Service(OrderedLog* log, ReadClock read_clock, uint64_t start_ms, Engine engine)
    : log_(log), read_clock_(std::move(read_clock)), clock_(start_ms), engine_(std::move(engine)) {}

// An observer that throws, for lack of memory for instance, is detached.
template <typename Tell>
void Service::TellObservers(Tell&& tell) {
  for (size_t i = 0; i < observers_.size();) {
    Observer* const observer = observers_[i];
    try {
      tell(observer);
      ++i;
    } catch (...) {
      std::erase(observers_, observer);
      observer->OnFailure();
    }
  }
}

void Service::NotifyOfBatch(const Stamp& stamp, LinkIndex link, std::span<const Message> messages,
                            std::span<const Observer::Outcome> outcomes,
                            std::span<const Outgoing> sent) {
  TellObservers(
      [&](Observer* observer) { observer->OnBatch(stamp, link, messages, outcomes, sent); });
}

void Service::Handle(LinkIndex link, std::span<const Message> messages, std::vector<Outgoing>* out,
                     std::span<const Asker> askers) {
  assert(askers.size() <= 1 || askers.size() == messages.size());
  const std::lock_guard lock(mutex_);
  const Stamp stamp = StampNow();
  const size_t before = out->size();
  std::vector<Observer::Outcome> outcomes;
  std::vector<Message> kept;  // if some were forwarded: observers see those when they are followed
  const Asker nobody{};
  for (size_t i = 0; i < messages.size(); ++i) {
    const size_t first = out->size();
    const Asker& asker = askers.empty() ? nobody : askers[askers.size() == 1 ? 0 : i];
    const std::optional<Observer::Outcome> outcome =
        HandleOne(stamp, link, messages[i], asker, out);
    for (size_t answer = first; answer < out->size(); ++answer) {
      (*out)[answer].asker = asker;
    }
    if (forward_ && outcome) {
      kept.push_back(messages[i]);
    }
    if (!observers_.empty() && outcome) {
      outcomes.push_back(*outcome);
    }
  }
  if (!outcomes.empty()) {
    const std::span<const Message> seen = forward_ ? kept : messages;
    NotifyOfBatch(stamp, link, seen, outcomes, std::span(*out).subspan(before));
  }
  NoticeArrivals(stamp, link, messages, out);
  HoldBack(out, before);
}

// After the batch, so that observers see its messages before the events that they cause. If the log
// refuses one, the robot's next request repeats it.
void Service::NoticeArrivals(const Stamp& stamp, LinkIndex link, std::span<const Message> messages,
                             std::vector<Outgoing>* out) {
  for (const Message& message : messages) {
    const std::optional<GoalEnded> arrival = engine_.Arrival(stamp, link, message);
    if (arrival && !(forward_ && forward_(*arrival))) {
      (void)Change(stamp, *arrival, out);
    }
  }
}

// Nothing: the message was forwarded.
std::optional<Observer::Outcome> Service::HandleOne(const Stamp& stamp, LinkIndex link,
                                                    const Message& message, const Asker& asker,
                                                    std::vector<Outgoing>* out) {
  ++counters_.requests;
  Observer::Outcome outcome;
  const size_t before = out->size();
  Traffic::Fate fate = Traffic::Fate::kAnswered;
  Reason refusal = Reason::kNone;
  switch (engine_.Classify(link, message)) {
    case Handling::kIgnore:
      ++counters_.ignored;
      traffic_.Count(link, message, stamp.field_time_ms, Traffic::Fate::kIgnored);
      return outcome;
    case Handling::kAnswer:
      engine_.Answer(stamp, link, message, out);
      if (forward_ && SeemsBehind(std::span(*out).subspan(before)) &&
          IsForwarded({link, message}, asker)) {
        out->resize(before);
        traffic_.Count(link, message, stamp.field_time_ms, fate);
        return std::nullopt;
      }
      // Only the answer to a repeated change depends on an event of the log.
      if (out->size() > before && out->back().durable_at != 0) {
        outcome.refused = RefusalOfRepeat(out->back());
        if (outcome.refused != Reason::kNone) {
          out->back() = {link, 0, ErrorMessage(message, outcome.refused)};
        } else {
          ++counters_.repeats;
          fate = Traffic::Fate::kRepeated;
        }
      }
      break;
    case Handling::kChange: {
      const RequestReceived received{link, message};
      if (IsForwarded(received, asker)) {
        traffic_.Count(link, message, stamp.field_time_ms, fate);
        return std::nullopt;
      }
      outcome.refused = Change(stamp, received, out);
      if (outcome.refused != Reason::kNone) {
        out->push_back({link, 0, ErrorMessage(message, outcome.refused)});
      } else {
        outcome.sequence = engine_.sequence();
      }
      break;
    }
  }
  for (size_t i = before; i < out->size(); ++i) {
    protocol::ErrorAnswer error;
    const Outgoing& sent = (*out)[i];
    if (protocol::Decode(sent.message, &error)) {
      ++counters_.errors[std::min<size_t>(static_cast<size_t>(error.reason), kReasons - 1)];
      fate = Traffic::Fate::kRefused;
      refusal = error.reason;
    } else {
      ++counters_.answers;
    }
  }
  traffic_.Count(link, message, stamp.field_time_ms, fate, refusal);
  if (asker.is_forwarded) {
    traffic_.NoteForwarded(link, message.id);
  }
  return outcome;
}

// While the log does not accept changes, it is unknown when this answer's change becomes durable.
// Busy, whatever the log's reason is: the change was made, and any other reason would tell the
// robot that it was not (protocol/README.md, section 7).
Reason Service::RefusalOfRepeat(const Outgoing& answer) {
  const bool waits = answer.durable_at > log_->DurableSequence();
  return waits && log_->Admit() != Reason::kNone ? Reason::kBusy : Reason::kNone;
}

Reason Service::Change(const Stamp& stamp, const Event& event, std::vector<Outgoing>* out) {
  const Reason refused = log_->Admit();
  if (refused == Reason::kNone) {
    (void)Order(stamp, event, out);
    put_off_ms_ = 0;
    WakeIfEarlier();
  }
  return refused;
}

// Appends and applies it; returns its sequence number.
uint64_t Service::Order(const Stamp& stamp, const Event& event, std::vector<Outgoing>* out) {
  ++counters_.changes;
  if (log_->IsRotationDue() && engine_.configured()) {
    log_->Rotate(engine_.StateHash());
  }
  const size_t before = out->size();
  const uint64_t sequence = AppendAndApply(stamp, event, out);
  for (const field::FinishedWork& it : engine_.finished()) {
    if (const auto awaited = awaited_works_.find(it.id); awaited != awaited_works_.end()) {
      awaited->second = it;
    }
  }
  if (!observers_.empty() && !std::holds_alternative<RequestReceived>(event)) {
    TellObservers([&](Observer* observer) {
      observer->OnEvent(sequence, stamp, event, std::span(*out).subspan(before));
    });
  }
  if (revoked_ && std::holds_alternative<KeysRevoked>(event)) {
    revoked_();
  }
  if (const auto* ended = std::get_if<GoalEnded>(&event); ended != nullptr && ended->reached) {
    traffic_.NoteArrival(ended->link, ended->id, stamp.field_time_ms);
    if (arrived_) {
      arrived_(*ended);
    }
  }
  return sequence;
}

// If log and state differed, robots would be told of changes that were never made. An exception in
// between, such as out of memory, ends the process, and a restart continues from the log.
uint64_t Service::AppendAndApply(const Stamp& stamp, const Event& event,
                                 std::vector<Outgoing>* out) noexcept {
  const uint64_t sequence = log_->Append(stamp, event);
  if (std::holds_alternative<FieldEdited>(event) || std::holds_alternative<EditReversed>(event) ||
      std::holds_alternative<ConfigChanged>(event)) {
    awaited_works_.emplace(sequence, std::nullopt);
  }
  engine_.Apply(sequence, stamp, event, out);
  log_->Account(engine_.cost());
  return sequence;
}

// A configuration change may have put the engine a little ahead of the clock.
Stamp Service::StampNow() {
  Stamp stamp = clock_.Read(read_clock_());
  stamp.field_time_ms = std::max(stamp.field_time_ms, engine_.field_time_ms());
  return stamp;
}

void Service::WakeIfEarlier() {
  const std::optional<uint64_t> deadline = engine_.NextDeadline();
  if (deadline && *deadline < awaited_ms_) {
    awaited_ms_ = *deadline;
    if (wake_) {
      wake_();
    }
  }
}

size_t Service::Observe(std::span<const PoseObserved> observations) {
  const std::lock_guard lock(mutex_);
  const Stamp stamp = StampNow();
  std::vector<Outgoing> none;
  size_t taken = 0;
  for (const PoseObserved& it : observations) {
    const bool known = engine_.SaidHello(it.link, it.id);
    const bool is_taken =
        known && ((forward_ && forward_(it)) || Change(stamp, it, &none) == Reason::kNone);
    taken += is_taken ? 1u : 0u;
  }
  counters_.observations += taken;
  counters_.observations_refused += observations.size() - taken;
  return taken;
}

std::optional<LinkIndex> Service::FindLink(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  const std::vector<LinkSettings>& links = engine_.config().links;
  const auto found = std::find_if(links.begin(), links.end(),
                                  [name](const LinkSettings& it) { return it.name == name; });
  return found != links.end() ? std::optional(static_cast<LinkIndex>(found - links.begin()))
                              : std::nullopt;
}

void Service::AdvanceIfDue(std::vector<Outgoing>* out) {
  const std::lock_guard lock(mutex_);
  const Stamp stamp = StampNow();
  const std::optional<uint64_t> deadline = engine_.NextDeadline();
  if (!deadline || std::max(*deadline, put_off_ms_) > stamp.field_time_ms) {
    return;
  }
  const size_t before = out->size();
  if (Change(stamp, Advance{}, out) != Reason::kNone) {
    put_off_ms_ = stamp.field_time_ms + kPutOffMs;
  }
  HoldBack(out, before);
}

std::optional<uint64_t> Service::MillisecondsToDeadline() {
  const std::lock_guard lock(mutex_);
  const std::optional<uint64_t> deadline = engine_.NextDeadline();
  awaited_ms_ = deadline ? std::max(*deadline, put_off_ms_) : UINT64_MAX;
  if (!deadline) {
    return std::nullopt;
  }
  const uint64_t now_ms = StampNow().field_time_ms;
  return awaited_ms_ > now_ms ? awaited_ms_ - now_ms : 0;
}

// Holds back for Release what may not be sent yet. An answer that is sent at once shows that the
// robot has abandoned its earlier request.
void Service::HoldBack(std::vector<Outgoing>* out, size_t from) {
  const uint64_t durable = log_->DurableSequence();
  size_t end = from;
  for (size_t i = from; i < out->size(); ++i) {
    const Outgoing& it = (*out)[i];
    if (it.durable_at > durable) {
      if (it.message.opcode == protocol::kCommand) {
        held_.HoldCommand(it);
      } else {
        Drop(held_.Hold(it));
      }
      continue;
    }
    if (held_.answers() != 0 && AnswersAChange(engine_, it.message)) {
      Drop(held_.Drop(it.link, it.message.id));
    }
    if (end != i) {
      (*out)[end] = it;
    }
    ++end;
  }
  out->resize(end);
}

void Service::Drop(const std::optional<HeldAnswers::Dropped>& dropped) {
  if (dropped) {
    TellObservers([&](Observer* observer) {
      observer->OnDropped(dropped->answer.link, dropped->answer.message, dropped->repeated);
    });
  }
}

void Service::Release(std::vector<Outgoing>* out) {
  const std::lock_guard lock(mutex_);
  held_.Release(log_->DurableSequence(), out);
}

size_t Service::held_answers() const {
  const std::lock_guard lock(mutex_);
  return held_.answers();
}

void Service::Thaw::operator()(FrozenState* frozen) const {
  {
    const std::lock_guard lock(service->mutex_);
    frozen->LetGo();
  }
  delete frozen;  // frees memory without the lock
}

bool Service::CopySome(FrozenState* frozen, std::string* to) {
  if (frozen->CopyConfig(to)) {
    return true;
  }
  const std::lock_guard lock(mutex_);
  return frozen->CopySome(to);
}

ServiceCounters Service::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

uint64_t Service::StateHash() const {
  const std::lock_guard lock(mutex_);
  return engine_.StateHash();
}

}  // namespace pheromone::engine
