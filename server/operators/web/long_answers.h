// Answers that are long and in memory: sent in portions, held once however many wait for the same
// one, and only as many at a time as the server can bear.
//
//   ShareLongBody(&response);                                       // where the answer is made
//   const auto place = long_answers.Enter(client, response.content);  // null: it is refused
//
// ShareLongBody: any thread. LongAnswers is thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/operators/web/http.h"

namespace pheromone::web {

/// The bytes of a long body that are sent at a time; other requests have their turn in between.
constexpr size_t kPortionBytes = size_t{64} << 10;

/// Makes a body longer than a portion the response's content: copies of the response share it.
void ShareLongBody(Response* response);

class LongAnswers {
 public:
  struct Limit {
    uint64_t bytes = 0;  ///< of the contents, each counted once
    size_t answers = 0;  ///< each takes its turn on the thread that also serves a halt
  };
  struct Limits {
    uint64_t least = uint64_t{1} << 20;  ///< what is smaller is not counted
    Limit each_client = {uint64_t{64} << 20, 8};
    Limit all = {uint64_t{256} << 20, 16};
  };

  LongAnswers() = default;
  explicit LongAnswers(const Limits& limits) : limits_(limits) {}

  /// To be kept while this content is sent; null: there are too many. `client` is a text that tells
  /// clients apart. What is small, or not in memory, is always let in, and so is one content alone.
  std::shared_ptr<void> Enter(const std::string& client, const std::shared_ptr<Content>& content);

 private:
  // What is held, how often, and its bytes.
  class Held {
   public:
    bool Fits(const Content* content, const Limit& limit) const;
    void Add(const Content* content);
    void Remove(const Content* content);
    bool empty() const { return times_.empty(); }

   private:
    std::map<const Content*, size_t> times_;
    uint64_t bytes_ = 0;
    size_t answers_ = 0;
  };

  void Leave(const std::string& client, const Content* content);

  const Limits limits_ = {};
  std::mutex mutex_;
  Held all_;
  std::map<std::string, Held> by_client_;
};

}  // namespace pheromone::web
