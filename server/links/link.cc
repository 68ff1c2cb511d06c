#include "server/links/link.h"

#include "protocol/opcodes.h"
#include "server/engine/engine.h"
#include "server/links/switchboard.h"

namespace pheromone::links {

bool LinkRecord::SetState(State state) {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const bool news = state.up != state_.up || state.reason != state_.reason ||
                    now - last_news_ > std::chrono::minutes(10);
  history_.since = state.up != state_.up ? now : history_.since;
  if (!state.up) {
    history_.last_error = state.reason;
  }
  state_ = std::move(state);
  last_news_ = news ? now : last_news_;
  return news;
}

void Link::ReportUp(const std::string& how) {
  if (record_.SetState({true, how})) {
    context_.log(Severity::kInfo, "link " + name() + ": up, " + how);
  }
}

void Link::ReportDown(const std::string& why) {
  if (record_.SetState({false, why})) {
    context_.log(Severity::kWarning, "link " + name() + ": down, " + why);
  }
}

void Link::Handle(std::span<const protocol::Message> batch,
                  std::vector<protocol::Message>* answers) {
  if (admission_.open()) {
    context_.switchboard->Handle(context_.index, batch, answers);
    return;
  }
  uint64_t not_allowed = 0;
  uint64_t too_many = 0;
  const auto now = std::chrono::steady_clock::now();
  admitted_.clear();
  for (const protocol::Message& message : batch) {
    switch (admission_.Judge(message.id, now)) {
      case Admission::Verdict::kWelcome:
        admitted_.push_back(message);
        break;
      case Admission::Verdict::kNotAllowed:
        ++not_allowed;
        break;
      case Admission::Verdict::kTooMany:
        ++too_many;
        if (message.opcode != protocol::kCommandAck && !protocol::IsFromServer(message.opcode)) {
          answers->push_back(engine::ErrorMessage(message, protocol::Reason::kBusy));
        }
        break;
    }
  }
  record_.Count([&](LinkCounters& counters) {
    counters.not_allowed += not_allowed;
    counters.too_many += too_many;
  });
  if (!admitted_.empty()) {
    context_.switchboard->Handle(context_.index, admitted_, answers);
  }
}

}  // namespace pheromone::links
