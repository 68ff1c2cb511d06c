// What operators did, in words, for the events of a server: "painted "trail" at (3, 6)".
//
//   OperatorActions actions;
//   if (auto notice = actions.Note("/api/v1/halt", body, answer, from, now_ms)) {
//     control->Announce(*notice);
//   }
//
// A stroke of a brush comes as many requests: only the first one is told. Recordings and other
// configurations are told by the server itself. Thread-safe.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include <boost/json/object.hpp>

#include "server/operators/control/notices.h"

namespace pheromone::web {

class OperatorActions {
 public:
  /// Of the same words, without their place, within this time of each other only the first is told.
  static constexpr uint64_t kPauseMs = 2000;

  /// `body` is that of a request to `path` which succeeded with `answer`; `from` is where it came
  /// from; `now_ms` never decreases. Nothing: there is nothing to tell.
  std::optional<control::Notice> Note(std::string_view path, const boost::json::object& body,
                                      const boost::json::object& answer, std::string from,
                                      uint64_t now_ms);

 private:
  std::mutex mutex_;
  std::string last_;
  uint64_t last_ms_ = 0;
};

}  // namespace pheromone::web
