// Requests that a client has abandoned. An answer to one is late: the client must not use it, but
// it is not an error.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>

namespace pheromone::bench {

/// A request of a client, as far as the arena tells its answer from others.
struct Asked {
  size_t pose = 0;
  uint8_t seq = 0;
};

class GivenUp {
 public:
  void Add(const Asked& asked) {
    given_up_.push_back(asked);
    if (given_up_.size() > kMax) {
      given_up_.pop_front();
    }
  }

  /// Whether one of them was answered, by `is_answer_to(asked)`. That one is then removed: a second
  /// answer to it is an error.
  template <typename IsAnswerTo>
  bool Take(IsAnswerTo&& is_answer_to) {
    const auto found = std::find_if(given_up_.begin(), given_up_.end(), is_answer_to);
    if (found == given_up_.end()) {
      return false;
    }
    given_up_.erase(found);
    return true;
  }

 private:
  static constexpr size_t kMax = 255;  // a seq means one request

  std::deque<Asked> given_up_;
};

}  // namespace pheromone::bench
