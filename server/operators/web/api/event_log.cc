#include "server/operators/web/api/event_log.h"

#include <chrono>
#include <limits>
#include <string_view>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/operators/control/json_text.h"
#include "server/operators/control/names.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr size_t kKept = 1000;

double NowSeconds() {
  using std::chrono::milliseconds;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<double>(std::chrono::duration_cast<milliseconds>(now).count()) / 1e3;
}

}  // namespace

EventLog::EventLog(control::Control* control, Lane lane)
    : lane_(std::move(lane)), started_s_(NowSeconds()) {
  control::ListenerOptions options{.max_waiting = kKept};
  if (lane_) {
    options.wake = [this] { lane_([this] { Take(); }); };
  }
  const std::lock_guard lock(mutex_);  // another thread may be woken at once
  subscription_ = control->Subscribe(std::move(options));
}

void EventLog::Take() {
  const std::lock_guard lock(mutex_);
  control::Subscription::Taken taken = subscription_->Take();
  dropped_ += taken.dropped;
  const double now_s = NowSeconds();
  for (control::Notice& notice : taken.notices) {
    events_.push_back({++last_, now_s, std::move(notice)});
  }
  while (events_.size() > kKept) {
    events_.pop_front();
  }
}

Response EventLog::Read(Parameters* fields) {
  constexpr int64_t kMax = int64_t{1} << 53;
  const auto since = fields->Integer("since", 0, kMax, 0);
  fields->AllowOnly({"since"});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  Take();
  const std::lock_guard lock(mutex_);
  // A number that was not given yet is that of an earlier run of the server.
  const uint64_t known = static_cast<uint64_t>(*since) <= last_ ? static_cast<uint64_t>(*since) : 0;
  json::array list;
  for (const Event& event : events_) {
    if (event.number > known) {
      list.push_back(json::object{{"number", event.number},
                                  {"time_s", event.time_s},
                                  {"topic", NameOf(event.notice.topic)},
                                  {"on", event.notice.is_on},
                                  {"subject", event.notice.subject},
                                  {"text", event.notice.text}});
    }
  }
  return {.body = ToText(json::object{{"started_s", started_s_},
                                      {"next", last_},
                                      {"dropped", dropped_},
                                      {"events", std::move(list)}})};
}

}  // namespace pheromone::web
