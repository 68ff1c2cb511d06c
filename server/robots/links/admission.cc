#include "server/robots/links/admission.h"

#include <algorithm>

namespace pheromone::links {
namespace {

using TimePoint = Admission::TimePoint;
constexpr std::chrono::nanoseconds kSecond = std::chrono::seconds(1);

// When the request after this one is expected; the time of the others if there is no limit.
TimePoint After(TimePoint expected, TimePoint now, uint32_t per_s) {
  return per_s == 0 ? now : std::max(expected, now) + kSecond / int64_t{per_s};
}

}  // namespace

Admission::Verdict Admission::Judge(uint8_t id, TimePoint now) {
  if (!Allows(id)) {
    return Verdict::kNotAllowed;
  }
  const TimePoint client = After(expected_[id], now, options_.per_client_per_s);
  const TimePoint link = After(link_expected_, now, options_.per_link_per_s);
  if (client > now + kSecond || link > now + kSecond) {
    return Verdict::kTooMany;
  }
  expected_[id] = client;
  link_expected_ = link;
  return Verdict::kWelcome;
}

}  // namespace pheromone::links
