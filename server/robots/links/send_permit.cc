#include "server/robots/links/send_permit.h"

#include <algorithm>
#include <utility>

namespace pheromone::links {
namespace {

constexpr std::chrono::milliseconds kDriverDelay{20};

}  // namespace

SendPermit::SendPermit(Now now_ms) : now_ms_(now_ms) {}

bool SendPermit::Allows(std::chrono::nanoseconds lasting) const {
  return EndOf(lasting) <= until_ms_;
}

bool SendPermit::Claim(std::chrono::nanoseconds lasting) {
  const uint64_t end_ms = EndOf(lasting);
  if (end_ms > until_ms_) {
    return false;
  }
  in_use_until_ms_ = std::max(in_use_until_ms_.load(), end_ms);
  return end_ms <= until_ms_;
}

uint64_t SendPermit::in_use_until_ms() const {
  return is_held_ ? UINT64_MAX : in_use_until_ms_.load();
}

void SendPermit::Set(uint64_t until_ms, const std::string& owner) {
  until_ms_ = until_ms;
  bool is_news = false;
  {
    const std::lock_guard lock(mutex_);
    const bool allows = Allows();
    is_news = allows != allowed_ || owner != owner_;
    allowed_ = allows;
    owner_ = owner;
  }
  if (is_news && on_change_) {
    on_change_();
  }
}

std::string SendPermit::owner() const {
  const std::lock_guard lock(mutex_);
  return owner_;
}

void SendPermit::OnChange(std::function<void()> call) {
  on_change_ = std::move(call);
}

uint64_t SendPermit::EndOf(std::chrono::nanoseconds lasting) const {
  const auto needed = std::chrono::ceil<std::chrono::milliseconds>(lasting) + kDriverDelay;
  return now_ms_() + static_cast<uint64_t>(needed.count());
}

}  // namespace pheromone::links
