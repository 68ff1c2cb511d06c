#include "server/links/link.h"

#include <utility>

namespace pheromone::links {

bool LinkRecord::SetState(State state) {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  const bool news = state.up != state_.up || state.reason != state_.reason ||
                    now - last_news_ > std::chrono::minutes(10);
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

}  // namespace pheromone::links
