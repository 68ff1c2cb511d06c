// The time that a round takes of the channel: its turns, its openings for those without turns, and
// COMMANDs.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "server/robots/radio/testing/rounds_fixture.h"

namespace pheromone::radio {
namespace {

using testing::Halt;
using testing::Hello;
using testing::MessageOf;
using testing::RoundsTest;
using testing::Sense;
using testing::Sent;
using namespace std::chrono_literals;

// --- Clients without turns.

// Where the channel has time, it is open between rounds, and a client may begin when it likes.
TEST_F(RoundsTest, BetweenRoundsTheChannelIsOpenUntilTheNext) {
  Join(1, 3, 200ms);
  const Time from = air_.now();
  air_.AdvanceTo(from + 5s);
  size_t open = 0;
  for (const protocol::Round& round : air_.Rounds(from)) {
    open += round.turn_count == 0 && round.open_slots == protocol::kOpenUntilNextRound ? 1u : 0u;
  }
  EXPECT_GE(open, 20u);
}

// The ROUND would collide with who begins as it is sent, and everybody miss it.
TEST_F(RoundsTest, AShortOpeningForWhoContendsIsOverBeforeTheNextRound) {
  Join(1, 3, 200ms);
  const Time from = air_.now();
  for (int i = 1; i <= 5; ++i) {
    air_.contenders.push_back(Sense(200));  // seldom
    air_.AdvanceTo(from + i * 1s);
  }
  int between = 0;
  for (size_t i = 0; i + 1 < air_.sent().size(); ++i) {
    const Sent& sent = air_.sent()[i];
    const auto round = sent.round();
    if (sent.begin < from + 1s || !round || round->turn_count != 0 || round->open_slots == 0 ||
        air_.sent()[i + 1].messages[0].id == 200) {
      continue;
    }
    ++between;
    ASSERT_NE(round->open_slots, protocol::kOpenUntilNextRound);
    const Duration slots = round->open_slots * Duration(options_.slot);
    const Duration first_byte = options_.timing.turnaround + options_.timing.byte;
    EXPECT_LE(sent.end + slots + first_byte, air_.sent()[i + 1].begin);
  }
  EXPECT_GT(between, 5);
}

// An opening that nobody used does not close the channel for a client that is there.
TEST_F(RoundsTest, WhileAClientWithoutTurnsIsThereEachRoundHasAnOpening) {
  Join(1, 8, 100ms);  // more than the channel carries
  air_.contenders.push_back(Sense(200));
  while (!air_.contenders.empty()) {
    air_.AdvanceTo(air_.now() + 100ms);
  }
  const Time from = air_.now() + 500ms;
  air_.AdvanceTo(from + 3s);
  const auto rounds = air_.Rounds(from);
  EXPECT_GT(rounds.size(), 10u);
  for (const protocol::Round& round : rounds) {
    EXPECT_NE(round.open_slots, 0) << int{round.number};
  }
}

// --- How long a round lasts.

TEST_F(RoundsTest, NobodyButTheServerEndsARoundAndNotBeforeItsLastTurn) {
  Join(1, 5, 100ms);
  air_.in_turn[5] = [] { return std::nullopt; };
  const Time from = air_.now();
  air_.AdvanceTo(from + 10s);
  int ended = 0;
  int with_silence = 0;
  for (size_t i = 0; i + 1 < air_.sent().size(); ++i) {
    const Sent& sent = air_.sent()[i];
    if (sent.begin < from || !sent.round() || sent.round()->turn_count == 0) {
      continue;
    }
    // When the frame that was sent in the last turn has been read, or could have been sent.
    Time over = sent.end;
    bool last_is_heard = false;
    bool all_are_heard = true;
    for (int turn = 0; turn < sent.round()->turn_count; ++turn) {
      last_is_heard = sent.round()->turns[turn] != 5;
      all_are_heard &= last_is_heard;
      const auto bytes = static_cast<int64_t>(testing::FrameOf(Sense(1)).size());
      over = last_is_heard ? air_.TurnBegins(sent, turn) + options_.timing.turnaround +
                                 bytes * options_.timing.byte
                           : air_.TurnBegins(sent, turn + 1);
    }
    const Sent& next = air_.sent()[i + 1];
    ASSERT_GE(next.begin, over);
    if (last_is_heard && sent.round()->open_slots == 0) {
      ++ended;
      with_silence += all_are_heard ? 0 : 1;
      ASSERT_LE(next.begin, over + options_.timing.EarliestAnswer()) << "nobody sends any more";
    }
  }
  EXPECT_GT(ended, 10);
  EXPECT_GT(with_silence, 2);
}

TEST_F(RoundsTest, ATurnIsAsLongAsTheFramesThatAreSentInIt) {
  Join(1, 2, 100ms);
  const Time from = air_.now();
  air_.AdvanceTo(from + 1s);
  for (const protocol::Round& round : air_.Rounds(from)) {
    if (round.turn_count == 0) {
      continue;
    }
    const size_t bytes = testing::FrameOf(Sense(1)).size();
    EXPECT_GE(round.turn_bytes, bytes);
    EXPECT_LE(round.turn_bytes, bytes + 4);
    const Duration least = options_.timing.turnaround + round.turn_bytes * options_.timing.byte;
    EXPECT_GE(round.turn_ms * 1ms, least);
    EXPECT_LE(round.turn_ms * 1ms, least + 4ms);
  }
}

// A long frame that did not fit is asked for with a longer turn in the end.
TEST_F(RoundsTest, ARobotWhoseFrameDoesNotFitIsGivenALongerTurn) {
  Join(1, 2, 100ms);
  const protocol::Message wide =
      MessageOf(protocol::TraceRequest{2, 1, true, 0x10, {0x10101010, 0x10101010, 0x1010}});
  const size_t bytes = testing::FrameOf(wide).size();
  air_.in_turn[2] = [&]() -> std::optional<protocol::Message> {
    // What the last ROUND said is the one that is being acted upon.
    const auto round = air_.Rounds().back();
    return round.turn_bytes >= bytes ? std::optional(wide) : std::nullopt;
  };
  const Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  const std::vector<protocol::Round> rounds = air_.Rounds(from);
  EXPECT_TRUE(std::any_of(rounds.begin(), rounds.end(),
                          [&](const auto& round) { return round.turn_bytes >= bytes; }));
}

// Of the longest frame of late, not of one without any doubled byte: in a band of the map a byte of
// each pose is a DLE, and another one must still fit.
TEST_F(RoundsTest, OneMoreDoubledByteThanOfLateFits) {
  Join(1, 2, 100ms);
  const protocol::Message banded =
      MessageOf(protocol::TraceRequest{2, 1, false, 0x20, {0x1020, 0x1001, 0x0555}});
  const size_t bytes = testing::FrameOf(banded).size();
  ASSERT_GE(bytes, 17u) << "two bytes are doubled";
  air_.in_turn[2] = [&] {
    return air_.Rounds().back().turn_bytes >= bytes ? std::optional(banded) : std::nullopt;
  };
  air_.AdvanceTo(air_.now() + 2s);
  EXPECT_GT(air_.Rounds().back().turn_bytes, bytes);
}

// --- Openings.

// How much of the time is open to all, of what is reserved or open.
double OpenShare(const std::vector<protocol::Round>& rounds, std::chrono::milliseconds slot) {
  Duration turns{};
  Duration open{};
  for (const protocol::Round& round : rounds) {
    if (round.turn_count != 0) {
      turns += round.turn_count * round.turn_ms * 1ms;
      open += round.open_slots * slot;
    }
  }
  return static_cast<double>(open.count()) / static_cast<double>((turns + open).count());
}

TEST_F(RoundsTest, OpeningsThatNobodyUsesTakeLittleTime) {
  Join(1, 22, 100ms);  // always busy
  air_.AdvanceTo(air_.now() + 5s);
  const Time from = air_.now();
  air_.AdvanceTo(from + 30s);
  const std::vector<protocol::Round> rounds = air_.Rounds(from);
  EXPECT_GT(std::count_if(rounds.begin(), rounds.end(),
                          [](const auto& round) { return round.open_slots != 0; }),
            5)
      << "but there are some";
  EXPECT_LT(OpenShare(rounds, options_.slot), 0.05);
}

TEST_F(RoundsTest, ANewcomerIsAnsweredWhileTheChannelIsSaturated) {
  Join(1, 22, 100ms);
  air_.AdvanceTo(air_.now() + 5s);
  const Time from = air_.now();
  air_.in_turn.try_emplace(uint8_t{99}, [] { return Sense(99); });
  air_.contenders.push_back(Hello(99, 100ms));
  air_.AdvanceTo(from + 5s);
  EXPECT_GT(TurnsOf(99, from), 2u);
  int answered = 0;
  for (const Sent& sent : air_.sent()) {
    answered += sent.begin >= from && sent.messages[0].opcode == protocol::kHelloAnswer ? 1 : 0;
  }
  EXPECT_EQ(answered, 1);
}

TEST_F(RoundsTest, WhileOpeningsAreUsedEveryRoundHasOne) {
  Join(1, 22, 100ms);
  for (int i = 0; i < 40; ++i) {
    air_.contenders.push_back(Sense(200));
  }
  const Time begin = air_.now();
  while (air_.contenders.size() > 35) {
    air_.AdvanceTo(air_.now() + 100ms);
    ASSERT_LT(air_.now(), begin + 1min);
  }
  const Time from = air_.now();
  while (air_.contenders.size() > 5) {
    air_.AdvanceTo(air_.now() + 10ms);
    ASSERT_LT(air_.now(), from + 1min);
  }
  for (const protocol::Round& round : air_.Rounds(from)) {
    EXPECT_GT(round.open_slots, 0);
  }
}

// Robots with turns need not wait for contenders that are not there.
TEST_F(RoundsTest, ARoundFollowsTheLastAnswerToThoseWhoContend) {
  Join(1, 22, 100ms);
  const Time from = air_.now();
  for (int i = 0; i < 20; ++i) {
    air_.contenders.push_back(Sense(200));
  }
  air_.AdvanceTo(from + 20s);
  int answered = 0;
  for (const Sent& sent : air_.sent()) {
    if (sent.begin >= from && sent.messages[0].id == 200) {
      ++answered;
      EXPECT_TRUE(sent.round());
    }
  }
  EXPECT_EQ(answered, 20);
}

TEST_F(RoundsTest, WhileOneOfThoseWhoContendHasNotBeenHeardTheOpeningGoesOn) {
  Join(1, 22, 100ms);
  const Time from = air_.now();
  for (int i = 0; i < 20; ++i) {
    air_.contenders.push_back(Sense(static_cast<uint8_t>(200 + i % 2)));  // each in its turn
  }
  air_.AdvanceTo(from + 20s);
  int answered = 0;
  for (const Sent& sent : air_.sent()) {
    if (sent.begin >= from && sent.messages[0].id >= 200 && sent.messages[0].id < 255 &&
        ++answered > 1) {
      EXPECT_FALSE(sent.round());
    }
  }
  EXPECT_EQ(answered, 20);
}

// It has more to say: a second HELLO, where frames are signed, or its first request.
TEST_F(RoundsTest, AfterAnAnswerToHelloTheOpeningGoesOn) {
  Join(1, 22, 100ms);
  const Time from = air_.now();
  air_.contenders.push_back(Hello(200, 0ms));
  air_.AdvanceTo(from + 5s);
  const auto answered = std::find_if(air_.sent().begin(), air_.sent().end(), [&](const Sent& it) {
    return it.begin >= from && it.messages[0].opcode == protocol::kHelloAnswer;
  });
  ASSERT_NE(answered, air_.sent().end());
  EXPECT_FALSE(answered->round());
}

// --- COMMANDs.

// The robot that contends is not interrupted by the ROUND, which would follow the answer otherwise.
TEST_F(RoundsTest, AnAckOfWhoContendsIsAwaitedBeforeTheNextRound) {
  Join(1, 22, 100ms);
  air_.contenders.push_back(Sense(200));
  const Time from = air_.now();
  air_.channel().Send(Halt(200));
  air_.AdvanceTo(from + 5s);
  const auto sent = std::find_if(air_.sent().begin(), air_.sent().end(), [&](const Sent& it) {
    return it.begin >= from && it.messages[0].id == 200;
  });
  ASSERT_NE(sent, air_.sent().end());
  ASSERT_EQ(sent->messages.back().opcode, protocol::kCommand);
  ASSERT_NE(std::next(sent), air_.sent().end());
  EXPECT_GE(std::next(sent)->begin, sent->end + options_.response_window);
}

TEST_F(RoundsTest, ACommandPrecedesARoundThatHasATurnForItsAck) {
  Join(1, 22, 100ms);
  const Time from = air_.now();
  air_.channel().Send(Halt(7));
  air_.AdvanceTo(from + 2s);
  int commands = 0;
  for (const Sent& sent : air_.sent()) {
    if (sent.begin < from || sent.messages[0].opcode != protocol::kCommand) {
      continue;
    }
    ++commands;
    ASSERT_TRUE(sent.round()) << "others would talk over the ACK";
    const protocol::Round round = *sent.round();
    const uint8_t* const end = round.turns + round.turn_count;
    const uint8_t* const at = std::find(round.turns, end, 7);
    ASSERT_NE(at, end) << "even if more are due than a round has turns";
    // It sends what it has to in succession.
    const auto turns = std::count(round.turns, end, 7);
    EXPECT_EQ(std::count(at, std::min(at + turns, end), 7), turns);
  }
  EXPECT_EQ(commands, 1);
}

TEST_F(RoundsTest, ATurnForAnAckIsNotMissedByWhoDoesNotSendASecondFrame) {
  Join(1, 22, 100ms);
  air_.in_turn[7] = [first = true]() mutable -> std::optional<protocol::Message> {
    return std::exchange(first, false)
               ? MessageOf(protocol::CommandAck{7, 1, protocol::CommandCode::kHalt, 0})
               : Sense(7);
  };
  const Time from = air_.now();
  air_.channel().Send(Halt(7));
  air_.AdvanceTo(from + 20s);
  EXPECT_NEAR(static_cast<double>(TurnsOf(7, from)), static_cast<double>(TurnsOf(8, from)), 3.0);
}

// What a robot tells in a turn takes the place of a request for intensities (protocol/README.md,
// section 9, "Your turn").
TEST_F(RoundsTest, WhoToldAnEventIsAskedInTheNextRound) {
  Join(1, 4, 200ms);
  air_.in_turn[2] = [first = true]() mutable {
    return std::exchange(first, false)
               ? MessageOf(protocol::EventReport{2, 1, protocol::EventCode::kLoadPicked, 0})
               : Sense(2);
  };
  const Time from = air_.now();
  air_.AdvanceTo(from + 1s);
  const auto turns = air_.TurnsOf(2, from);
  ASSERT_GE(turns.size(), 3u);
  EXPECT_LT(turns[1] - turns[0], 150ms);
  EXPECT_NEAR(static_cast<double>((turns[2] - turns[1]).count()), 200e6, 30e6);
}

TEST_F(RoundsTest, NoOpeningDelaysTheAnswersOfThoseWhoToldAnEvent) {
  Join(1, 22, 100ms);
  const Time from = air_.now();
  air_.AdvanceTo(from + 60s);
  int openings = 0;
  for (const Sent& sent : air_.sent()) {
    if (sent.begin < from || !sent.round()) {
      continue;
    }
    const protocol::Round round = *sent.round();
    openings += round.open_slots != 0 ? 1 : 0;
    if (round.number % 8 <= 2) {
      EXPECT_EQ(round.open_slots, 0) << "ROUND " << int{round.number};
    }
  }
  EXPECT_GT(openings, 15) << "at least each three seconds";
}

TEST_F(RoundsTest, AnOpeningThatARobotWithTurnsUsedIsNotFollowedByAnother) {
  Join(1, 8, 100ms);
  air_.contenders.push_back(
      MessageOf(protocol::EventReport{3, 7, protocol::EventCode::kLoadPicked, 0}));
  const Time from = air_.now();
  while (!air_.contenders.empty() && air_.now() < from + 10s) {
    air_.AdvanceTo(air_.now() + 10ms);
  }
  const Time used = air_.now();
  air_.AdvanceTo(used + 600ms);
  for (const protocol::Round& round : air_.Rounds(used)) {
    EXPECT_EQ(round.open_slots, 0) << "ROUND " << int{round.number};
  }
}

TEST_F(RoundsTest, AHaltOfAllIsSentWithTheNextRound) {
  Join(1, 22, 100ms);
  const Time from = air_.now();
  air_.channel().Send(Halt(protocol::kBroadcastId));
  air_.AdvanceTo(from + 1s);
  const auto halted = std::find_if(air_.sent().begin(), air_.sent().end(), [&](const Sent& sent) {
    return sent.begin >= from && sent.messages[0].opcode == protocol::kCommand;
  });
  ASSERT_NE(halted, air_.sent().end());
  const auto first = std::find_if(air_.sent().begin(), air_.sent().end(),
                                  [&](const Sent& sent) { return sent.begin >= from; });
  EXPECT_EQ(halted->begin, first->begin);
}

}  // namespace
}  // namespace pheromone::radio
