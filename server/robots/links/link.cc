#include "server/robots/links/link.h"

#include "protocol/opcodes.h"
#include "server/core/engine/engine.h"
#include "server/robots/links/link_router.h"

namespace pheromone::links {

Error InternalError(const std::exception_ptr& thrown) {
  try {
    std::rethrow_exception(thrown);
  } catch (const std::exception& error) {
    return Error{std::string("internal error: ") + error.what()};
  } catch (...) {
    return Error{"internal error: unknown exception"};
  }
}

std::string ToText(const LinkNotice& notice) {
  return notice.source + ": " + notice.what + (notice.why.empty() ? "" : ", " + notice.why) +
         (notice.then.empty() ? "" : "; " + notice.then);
}

bool LinkRecord::SetUp(const std::string& how, const std::string& address) {
  const std::lock_guard lock(mutex_);
  const bool news = Set(true, how, address);
  state_.failed_attempts = 0;
  return news;
}

bool LinkRecord::SetDown(const std::string& why, bool attempt_failed) {
  const std::lock_guard lock(mutex_);
  const bool news = Set(false, why);
  state_.failed_attempts += attempt_failed ? 1u : 0u;
  return news;
}

bool LinkRecord::Set(bool up, const std::string& reason, const std::string& address) {
  const TimePoint now = std::chrono::steady_clock::now();
  const bool another = up != state_.up || last_news_ == TimePoint();
  const bool news =
      another || reason != state_.reason || now - last_news_ > std::chrono::minutes(10);
  state_.since = another ? now : state_.since;
  state_.up = up;
  state_.reason = reason;
  state_.address = address;
  if (!up) {
    state_.last_error = reason;
  }
  state_.next_attempt.reset();
  state_.silent = false;
  last_news_ = news ? now : last_news_;
  return news;
}

void LinkRecord::SetNextAttempt(TimePoint at) {
  const std::lock_guard lock(mutex_);
  if (!state_.up) {
    state_.next_attempt = at;
  }
}

void LinkRecord::SetSilent(bool silent) {
  const std::lock_guard lock(mutex_);
  state_.silent = silent;
}

LinkRole Link::role() const {
  const bool may_send = context_.permit == nullptr || context_.permit->Allows();
  return may_send ? LinkRole::kServes : LinkRole::kStandby;
}

std::string Link::owner() const {
  if (context_.permit != nullptr) {
    return context_.permit->owner();
  }
  return config_.on.size() == 1 ? config_.on[0] : "";
}

void Link::Tell(Severity severity, const std::string& what, const std::string& why,
                const std::string& then) const {
  context_.log({severity, "link " + name(), what, why, then});
}

void Link::ReportUp(const std::string& how, const std::string& address) {
  if (record_.SetUp(how, address)) {
    Tell(Severity::kInfo, "up", how, "");
  }
}

void Link::ReportDown(const std::string& why) {
  if (record_.SetDown(why)) {
    Tell(Severity::kWarning, "down", why, "retrying");
  }
}

void Link::ReportFailure(const std::string& why) {
  if (record_.SetDown(why, true)) {
    Tell(Severity::kWarning, "down", why, "retrying");
  }
}

void Link::ReportError(const Error& error, const std::string& consequence) {
  Tell(Severity::kWarning, error, "", consequence);
}

void Link::ReportSilence(std::chrono::seconds since) {
  record_.SetSilent(true);
  Tell(Severity::kWarning, "nothing received for " + std::to_string(since.count()) + " s", "",
       "check the modem and the robots");
}

void Link::ReportHeardAgain() {
  record_.SetSilent(false);
  Tell(Severity::kInfo, "receiving again", "", "");
}

void Link::Handle(std::span<const protocol::Message> batch, std::span<const engine::Asker> askers,
                  std::vector<engine::Outgoing>* answers) {
  if (admission_.open()) {
    context_.router->Handle(context_.index, batch, askers, answers);
    return;
  }
  uint64_t not_allowed = 0;
  uint64_t too_many = 0;
  const auto now = std::chrono::steady_clock::now();
  admitted_.clear();
  askers_.clear();
  for (size_t i = 0; i < batch.size(); ++i) {
    const protocol::Message& message = batch[i];
    const engine::Asker& asker = askers[askers.size() == 1 ? 0 : i];
    switch (admission_.Judge(message.id, now)) {
      case Admission::Verdict::kWelcome:
        admitted_.push_back(message);
        askers_.push_back(asker);
        break;
      case Admission::Verdict::kNotAllowed:
        ++not_allowed;
        TurnAway(message, protocol::Reason::kNone);
        break;
      case Admission::Verdict::kTooMany:
        ++too_many;
        if (message.opcode != protocol::kCommandAck && !protocol::IsFromServer(message.opcode)) {
          answers->push_back(
              {context_.index, 0, engine::ErrorMessage(message, protocol::Reason::kBusy), asker});
          TurnAway(message, protocol::Reason::kBusy);
        } else {
          TurnAway(message, protocol::Reason::kNone);
        }
        break;
    }
  }
  record_.Count([&](LinkCounters& counters) {
    counters.not_allowed += not_allowed;
    counters.too_many += too_many;
  });
  if (!admitted_.empty()) {
    context_.router->Handle(context_.index, admitted_, askers_, answers);
  }
}

bool Link::IsTooLate(const engine::Outgoing& outgoing) {
  const LinkRecord::TimePoint asked{std::chrono::nanoseconds(outgoing.asker.asked_ns)};
  if (!outgoing.asker.known() || std::chrono::steady_clock::now() - asked <= kLongestWait) {
    return false;
  }
  record_.Count([](LinkCounters& counters) { ++counters.late_answers; });
  Drop(outgoing.message);
  return true;
}

// `answer`: the reason of the ERROR that it gets, if it gets one.
void Link::TurnAway(const protocol::Message& message, protocol::Reason answer) {
  if (context_.tap != nullptr) {
    context_.tap->Rejected(context_.index, message, answer);
  }
}

void Link::Drop(const protocol::Message& message) {
  if (context_.tap != nullptr) {
    context_.tap->Dropped(context_.index, message);
  }
}

void Link::CountUndeliverable(const protocol::Message& message) {
  record_.Count([](LinkCounters& counters) { ++counters.undeliverable; });
  Drop(message);
}

}  // namespace pheromone::links
