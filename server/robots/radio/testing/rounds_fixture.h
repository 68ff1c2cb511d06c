// What tests of rounds share: robots that join a channel at 9600 baud, and what the air has of
// them.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/robots/radio/testing/air.h"

namespace pheromone::radio::testing {

class RoundsTest : public ::testing::Test {
 protected:
  /// Robots `first` to `last` join, with that period, and everything settles.
  void Join(int first, int last, std::chrono::milliseconds period) {
    for (int id = first; id <= last; ++id) {
      const auto as_id = static_cast<uint8_t>(id);
      if (id <= first + 1) {
        air_.Join(as_id, period);
      } else {  // there are rounds by now
        air_.in_turn.try_emplace(as_id, [as_id] { return Sense(as_id); });
        air_.contenders.push_back(Hello(as_id, period));
      }
    }
    for (int i = 0; i < 100 && !air_.contenders.empty(); ++i) {
      air_.AdvanceTo(air_.now() + 500ms);
    }
    ASSERT_TRUE(air_.contenders.empty());
    air_.AdvanceTo(air_.now() + 1s);
  }

  /// The first ROUND with turns since `since`, and the one after it.
  std::pair<Sent, Sent> TwoRounds(Time since) const {
    for (size_t i = 0; i + 1 < air_.sent().size(); ++i) {
      const Sent& first = air_.sent()[i];
      if (first.begin < since || !first.round() || first.round()->turn_count == 0) {
        continue;
      }
      for (size_t next = i + 1; next < air_.sent().size(); ++next) {
        if (air_.sent()[next].round()) {
          return {first, air_.sent()[next]};
        }
      }
    }
    ADD_FAILURE() << "there are no two rounds";
    return {};
  }

  /// The ROUNDs since `since` that have turns.
  std::vector<protocol::Round> RoundsWithTurns(Time since) const {
    std::vector<protocol::Round> rounds = air_.Rounds(since);
    std::erase_if(rounds, [](const auto& round) { return round.turn_count == 0; });
    return rounds;
  }

  size_t TurnsOf(uint8_t id, Time since) const { return air_.TurnsOf(id, since).size(); }

  const ChannelOptions options_ = Options(9'600, 2ms);
  Air air_{options_};
};

}  // namespace pheromone::radio::testing
