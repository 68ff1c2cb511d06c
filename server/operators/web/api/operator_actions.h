// What operators did, and what was refused to whom, in words, for the events of a server: "painted
// "trail" at (3, 6)", "paint: refused, found an invalid token".
//
//   OperatorActions actions;
//   if (auto notice = actions.Note("/api/v1/halt", body, answer, from, now_ms)) {
//     control->Announce(*notice);
//   }
//
// A stroke of a brush comes as many requests, each of which continues the one before: only the
// first is told. Of refusals, each client's first one is told, and further ones are counted for a
// while: who tries many tokens fills no log. Recordings and other configurations are told by the
// server itself. Thread-safe.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include <boost/json/object.hpp>

#include "server/operators/control/notices.h"

namespace pheromone::web {

class OperatorActions {
 public:
  /// Of requests that continue an edit or change nothing, of the same operator and in the same
  /// words without their place, within this time of each other only the first is told.
  static constexpr uint64_t kPauseMs = 2000;

  /// `body` is that of a request to `path` which succeeded with `answer`; `from` is where it came
  /// from; the times of several threads may come in another order. Nothing: there is nothing to
  /// tell.
  std::optional<control::Notice> Note(std::string_view path, const boost::json::object& body,
                                      const boost::json::object& answer, std::string from,
                                      uint64_t now_ms);

  /// Of each client, one refusal in so long is told.
  static constexpr uint64_t kRefusalMs = 10'000;
  static constexpr uint64_t kForgetMs = 100'000;  ///< then nobody asks how many were not told
  static constexpr size_t kMaxReason = 200;       ///< bytes
  static constexpr size_t kMaxClients = 256;
  static constexpr int kMaxRefusals = 32;  ///< told in that time, of all clients

  /// A request to `path` was answered with `status`, for this reason: a notice that is off.
  std::optional<control::Notice> NoteRefusal(std::string_view path, int status,
                                             const std::string& why, const std::string& from,
                                             uint64_t now_ms);

  /// Of whom a refusal is remembered.
  size_t clients() const {
    const std::lock_guard lock(mutex_);
    return refused_.size();
  }

 private:
  struct Refused {
    uint64_t told_ms = 0;
    uint64_t untold = 0;
  };

  mutable std::mutex mutex_;
  std::map<std::string, Refused> refused_;  // by client
  uint64_t refusals_since_ms_ = 0;
  int refusals_told_ = 0;
  std::string last_;  // a stroke, and whose
  std::string last_from_;
  uint64_t last_ms_ = 0;
};

}  // namespace pheromone::web
