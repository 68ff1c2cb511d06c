#include "server/links/link.h"

#include <utility>

namespace pheromone::links {

bool LinkRecord::SetState(State state) {
  const std::lock_guard lock(mutex_);
  const bool news = state.up != state_.up || state.reason != state_.reason;
  state_ = std::move(state);
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
