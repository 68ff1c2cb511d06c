// Answers that are long and in memory: sent in portions, held once however many wait for the same
// one, and only as many at a time as the server can bear.
//
//   ShareLongBody(&response);                                // where the answer is made
//   const auto place = long_answers.Enter(client, response);  // null: it is refused
//
// ShareLongBody: any thread. LongAnswers is thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "server/operators/web/http.h"

namespace pheromone::web {

/// The bytes of a long body that are sent at a time; other requests have their turn in between.
constexpr size_t kPortionBytes = size_t{64} << 10;

/// Makes a body longer than a portion the response's content: copies of the response share it.
void ShareLongBody(Response* response);

class LongAnswers {
 public:
  struct Limits {
    size_t each_client = 8;                ///< answers that are sent to one address
    uint64_t bytes = uint64_t{256} << 20;  ///< of all that are sent, each counted once
  };

  LongAnswers() = default;
  explicit LongAnswers(const Limits& limits) : limits_(limits) {}

  /// To be kept while this content is sent; null: there are too many. `client` is an address;
  /// empty: over the Unix socket. A content that is not in memory is always let in.
  std::shared_ptr<void> Enter(const std::string& client, const std::shared_ptr<Content>& content);

 private:
  void Leave(const std::string& client, const std::shared_ptr<Content>& content);

  const Limits limits_ = {};
  std::mutex mutex_;
  uint64_t bytes_ = 0;
  std::map<std::string, size_t> by_client_;
  std::map<const Content*, size_t> by_content_;
};

}  // namespace pheromone::web
