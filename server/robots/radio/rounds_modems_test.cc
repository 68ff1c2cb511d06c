// Rounds over modems of every kind: baud rates, turnarounds, a line that keys the transmitter.
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <string>

#include "server/robots/radio/rounds.h"
#include "server/robots/radio/testing/air.h"

namespace pheromone::radio {
namespace {

using testing::Air;
using testing::MessageOf;
using testing::Sent;
using namespace std::chrono_literals;

TEST(RoundsOfModems, TurnsWorkAtEveryRateAndTurnaround) {
  for (const int64_t baud : {9'600, 38'400, 115'200}) {
    for (const Duration turnaround : {0ms, 2ms, 12ms, 20ms}) {
      SCOPED_TRACE(std::to_string(baud) + " baud, T_t " + std::to_string(turnaround.count()));
      Air air(testing::Options(baud, turnaround));
      air.Join(1, 500ms);
      air.Join(2, 500ms);
      const Time from = air.now();
      air.AdvanceTo(from + 5s);
      EXPECT_GE(air.TurnsOf(1, from).size(), 9u);
      EXPECT_EQ(air.channel().counters().rounds.missed, 0u);
      EXPECT_EQ(air.channel().counters().rounds.unanswered, 0u);
      EXPECT_TRUE(air.dropped().empty());
    }
  }
}

TEST(RoundsOfModems, AChannelThatIsTooSlowForATurnHasNoRounds) {
  for (const int64_t baud : {75, 300}) {
    Air air(testing::Options(baud, 2ms));
    air.Join(1, 5s);
    air.Join(2, 5s);
    air.AdvanceTo(air.now() + 1min);
    EXPECT_TRUE(air.Rounds().empty()) << baud;
  }
}

// At 1200 baud, 30 bytes take 250 ms.
TEST(RoundsOfModems, ATurnIsNotLongerThanARoundCanTell) {
  Air air(testing::Options(1'200, 2ms));
  const protocol::Message wide =
      MessageOf(protocol::TraceRequest{2, 1, true, 0x10, {0x10101010, 0x10101010, 0x1010}});
  air.Join(1, 1s);
  air.Join(2, 1s);
  const Time before = air.now();
  air.in_turn[2] = [&]() -> std::optional<protocol::Message> {
    return testing::FrameOf(wide).size() <= air.Rounds().back().turn_bytes ? std::optional(wide)
                                                                           : std::nullopt;
  };
  air.AdvanceTo(before + 20s);
  int compared = 0;
  for (const Sent& sent : air.sent()) {
    const auto round = sent.round();
    if (sent.begin >= before && round && round->turn_count != 0) {
      ++compared;
      const Duration frame = round->turn_bytes * testing::Options(1'200, 2ms).timing.byte;
      ASSERT_GE(round->turn_ms * 1ms, 2ms + frame);
    }
  }
  EXPECT_GT(compared, 5);
}

TEST(RoundsOfModems, AKeyedModemsBytesAreHeardWhenTheyLeave) {
  ChannelOptions options = testing::Options(9'600, 2ms);
  options.timing.keyed = true;
  options.timing.lead = 25ms;
  options.response_window =
      std::chrono::ceil<std::chrono::milliseconds>(options.timing.ResponseWindow());
  Air air(options);
  air.Join(1, 500ms);
  air.Join(2, 500ms);
  const Time from = air.now();
  air.AdvanceTo(from + 5s);
  EXPECT_GE(air.TurnsOf(1, from).size(), 9u);
  EXPECT_EQ(air.channel().counters().rounds.missed, 0u);
}

}  // namespace
}  // namespace pheromone::radio
