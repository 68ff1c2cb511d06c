// Rounds, seen from the air: who gets turns, how often, and what a ROUND answers. The figures that
// are tuned (how wide an opening is, what guards a turn) are not asserted, but what they are for.
#include "server/robots/radio/rounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <vector>

#include "server/robots/radio/testing/air.h"

namespace pheromone::radio {
namespace {

using testing::Air;
using testing::Halt;
using testing::Hello;
using testing::IntensitiesOf;
using testing::MessageOf;
using testing::Sense;
using testing::Sent;
using namespace std::chrono_literals;

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

  size_t TurnsOf(uint8_t id, Time since) const { return air_.TurnsOf(id, since).size(); }

  const ChannelOptions options_ = testing::Options(9'600, 2ms);
  Air air_{options_};
};

// --- Who takes part.

TEST_F(RoundsTest, ARobotAloneIsAnsweredAtOnce) {
  air_.Join(1, 100ms);
  air_.AdvanceTo(air_.now() + 2s);
  EXPECT_TRUE(air_.Rounds().empty());
}

TEST_F(RoundsTest, TwoRobotsAreGivenTurns) {
  Join(1, 2, 200ms);
  const Time from = air_.now();
  air_.AdvanceTo(from + 10s);
  EXPECT_NEAR(static_cast<double>(TurnsOf(1, from)), 50.0, 3.0);
  EXPECT_NEAR(static_cast<double>(TurnsOf(2, from)), 50.0, 3.0);
}

TEST_F(RoundsTest, ARobotWithoutAPeriodIsGivenNoTurns) {
  Join(1, 2, 200ms);
  air_.contenders.push_back(Hello(3));
  air_.AdvanceTo(air_.now() + 10s);
  EXPECT_TRUE(air_.contenders.empty());
  EXPECT_EQ(TurnsOf(3, {}), 0u);
}

TEST_F(RoundsTest, ARobotThatWantsNoTurnsAnyMoreIsGivenNone) {
  Join(1, 3, 200ms);
  air_.in_turn[3] = [] { return Hello(3, 0ms); };
  air_.AdvanceTo(air_.now() + 1s);
  const Time from = air_.now();
  air_.AdvanceTo(from + 5s);
  EXPECT_EQ(TurnsOf(3, from), 0u);
  EXPECT_GT(TurnsOf(1, from), 10u);
}

TEST_F(RoundsTest, ThereAreNoRoundsAnyMoreWhenAllHaveGone) {
  Join(1, 3, 200ms);
  for (auto& [id, message] : air_.in_turn) {
    message = [] { return std::nullopt; };
  }
  air_.AdvanceTo(air_.now() + 2min);
  const Time from = air_.now();
  air_.AdvanceTo(from + 1min);
  EXPECT_TRUE(air_.Rounds(from).empty());
  EXPECT_EQ(air_.channel().NextStart(air_.now()), kNever);
}

// A robot that lost the ROUND of a server before this one awaits it for two seconds.
TEST(Rounds, ASecondServerIsQuietWhileARobotMayAwaitTheRoundOfTheFirst) {
  ChannelOptions options = testing::Options(9'600, 2ms);
  options.quiet_start = kAwaitedRound;
  Air air(options);
  const Time start = air.now();
  air.Join(1, 100ms);
  air.AdvanceTo(start + 700ms);
  air.Join(2, 100ms);
  air.AdvanceTo(start + kAwaitedRound - 1ms);
  EXPECT_TRUE(air.Rounds().empty());
  air.AdvanceTo(start + kAwaitedRound + 1s);
  const std::vector<protocol::Round> rounds = air.Rounds();
  ASSERT_FALSE(rounds.empty());
  EXPECT_EQ(rounds.front().answer_count, 0);
  EXPECT_TRUE(std::any_of(rounds.begin(), rounds.end(),
                          [](const auto& round) { return round.turn_count == 2; }));
}

// --- What a ROUND answers.

TEST_F(RoundsTest, ARoundAnswersTheLastOneInTheOrderOfItsTurns) {
  Join(1, 5, 300ms);
  int16_t x = 0;
  for (auto& [id, message] : air_.in_turn) {
    message = [as_id = id, &x] { return Sense(as_id, ++x); };
  }
  const Time from = air_.now();
  air_.AdvanceTo(from + 5s);
  int compared = 0;
  const std::vector<protocol::Round> rounds = air_.Rounds(from);
  int16_t asked = 0;
  for (size_t i = 0; i + 1 < rounds.size(); ++i) {
    ASSERT_EQ(rounds[i + 1].answer_count, rounds[i].turn_count);
    ASSERT_EQ(rounds[i + 1].number, static_cast<uint8_t>(rounds[i].number + 1));
    for (int turn = 0; turn < rounds[i].turn_count; ++turn, ++compared) {
      const auto expected = IntensitiesOf(rounds[i].turns[turn], ++asked);
      ASSERT_EQ(rounds[i + 1].answers[turn].left, expected.left);
      ASSERT_EQ(rounds[i + 1].answers[turn].right, expected.right);
    }
  }
  EXPECT_GT(compared, 50);
  EXPECT_TRUE(air_.dropped().empty());
}

TEST_F(RoundsTest, ARobotThatWasNotHeardIsToldToSendAgain) {
  Join(1, 2, 100ms);
  air_.in_turn[2] = [] { return std::nullopt; };
  const Time from = air_.now();
  air_.AdvanceTo(from + 1s);
  const auto [first, next] = TwoRounds(from + 200ms);
  for (int i = 0; i < first.round()->turn_count; ++i) {
    const protocol::RoundAnswer answer = next.round()->answers[i];
    const bool silent = first.round()->turns[i] == 2;
    EXPECT_EQ(answer.left, silent ? protocol::kNoIntensities : IntensitiesOf(1, 0).left);
    EXPECT_EQ(answer.right, 0);
  }
}

// What was sent in a turn of the ROUND before, and was held back or read late, is no answer's cause
// in this one: its robot may send a change meanwhile, which the ROUND would acknowledge.
class ReadLate : public RoundsTest {
 protected:
  // Robot 2 is given a turn. Something of it is read `after` the ROUND has left, by a server that
  // looked for the last time at `looked`, counted from there, too. Returns whether the next ROUND
  // has intensities for it.
  bool IsAnswered(Duration after, Duration looked) {
    Join(1, 2, 200ms);
    air_.in_turn[2] = [] { return std::nullopt; };
    const Time from = air_.now();
    while (air_.TurnsOf(2, from).empty()) {
      air_.AdvanceTo(air_.now() + 1ms);
    }
    const Sent round = air_.sent().back();
    EXPECT_GT(round.end, air_.now());
    air_.HearAt(round.end + after, Sense(2, 77));
    air_.not_read_since = round.end + looked;
    air_.AdvanceTo(round.end + after);
    air_.not_read_since = std::nullopt;
    air_.AdvanceTo(from + 1s);
    const auto next = std::find_if(air_.sent().begin(), air_.sent().end(), [&](const Sent& it) {
      return it.begin > round.begin && it.round();
    });
    EXPECT_NE(next, air_.sent().end());
    const protocol::Round granted = *round.round();
    const auto* turn = std::find(granted.turns, granted.turns + granted.turn_count, 2);
    return next->round()->answers[turn - granted.turns].left != protocol::kNoIntensities;
  }
};

TEST_F(ReadLate, BeforeTheRoundHasLeft) {
  EXPECT_FALSE(IsAnswered(-4ms, -4ms));
}

TEST_F(ReadLate, ByAServerThatStoodStillWhileTheRoundLeft) {
  EXPECT_FALSE(IsAnswered(20ms, -1ms));
}

TEST_F(ReadLate, ButSentInTheTurn) {
  EXPECT_TRUE(IsAnswered(20ms, 0ms));
}

TEST_F(RoundsTest, AnErrorIsAnsweredByItsReason) {
  Join(1, 2, 100ms);
  air_.in_turn[2] = [] { return MessageOf(protocol::SenseRequest{2, 15, false, {}}); };
  const Time from = air_.now();
  air_.AdvanceTo(from + 1s);
  int errors = 0;
  for (const protocol::Round& round : air_.Rounds(from + 200ms)) {
    for (int i = 0; i < round.answer_count; ++i) {
      if (round.answers[i].left == protocol::kNoIntensities) {
        EXPECT_EQ(round.answers[i].right,
                  static_cast<int16_t>(protocol::Reason::kUnknownPheromone));
        ++errors;
      }
    }
  }
  EXPECT_GE(errors, 5);
  EXPECT_EQ(air_.channel().counters().withheld_errors, 0u);
}

TEST_F(RoundsTest, AnAnswerThatIsNoIntensitiesIsAFrameOfItsOwnBeforeTheRound) {
  Join(1, 2, 100ms);
  air_.in_turn[1] = [] { return Hello(1, 100ms); };
  air_.in_turn[2] = [] {
    return MessageOf(protocol::EventReport{2, 7, protocol::EventCode::kLoadPicked, 0});
  };
  const Time from = air_.now();
  air_.AdvanceTo(from + 1s);
  std::map<int, int> answers;
  for (size_t i = 0; i + 1 < air_.sent().size(); ++i) {
    const auto round = air_.sent()[i].round();
    if (air_.sent()[i].begin < from + 300ms || !round || round->turn_count == 0) {
      continue;
    }
    const Sent& next = air_.sent()[i + 1];
    ASSERT_EQ(next.messages.size(), round->turn_count + 1u);
    for (int turn = 0; turn < round->turn_count; ++turn) {
      const protocol::Message& own = next.messages[static_cast<size_t>(turn)];
      const uint8_t id = round->turns[turn];
      ASSERT_EQ(own.id, id);
      ASSERT_EQ(own.opcode, id == 1 ? protocol::kHelloAnswer : protocol::kEventAck);
      ASSERT_EQ(next.round()->answers[turn].left, protocol::kNoIntensities);
      ASSERT_EQ(next.round()->answers[turn].right, 0);
      ++answers[id];
    }
  }
  EXPECT_GE(answers[1], 4);
  EXPECT_GE(answers[2], 4);
}

TEST_F(RoundsTest, AnAnswerThatTakesTooLongIsLeftToTheNextRequest) {
  Join(1, 2, 200ms);
  air_.processing = 150ms;
  const Time from = air_.now();
  air_.AdvanceTo(from + 5s);
  EXPECT_GT(TurnsOf(1, from + 1s), 5u) << "the rounds go on";
  EXPECT_GT(air_.channel().counters().rounds.unanswered, 5u);
  for (const Sent& sent : air_.sent()) {
    ASSERT_TRUE(sent.begin < from || sent.round()) << "an answer nobody waits for";
  }
}

// --- Whose turn it is, and how often.

TEST_F(RoundsTest, AParkedRobotDoesNotCostWhatAFastOneDoes) {
  Join(1, 4, 200ms);
  air_.in_turn[4] = [] { return Hello(4, 2000ms); };
  air_.AdvanceTo(air_.now() + 2s);
  air_.in_turn[4] = [] { return Sense(4); };
  air_.AdvanceTo(air_.now() + 2s);
  const Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  EXPECT_NEAR(static_cast<double>(TurnsOf(4, from)), 10.0, 1.0);
  for (const uint8_t id : {uint8_t{1}, uint8_t{2}, uint8_t{3}}) {
    EXPECT_NEAR(static_cast<double>(TurnsOf(id, from)), 100.0, 5.0);
  }
}

// The turns of a saturated channel: nobody starves, and nobody has more than his share.
TEST_F(RoundsTest, FortyRobotsHaveEvenShares) {
  Join(1, 40, 100ms);
  const Time from = air_.now();
  air_.AdvanceTo(from + 60s);
  std::vector<double> shares;
  for (int id = 1; id <= 40; ++id) {
    shares.push_back(static_cast<double>(TurnsOf(static_cast<uint8_t>(id), from)));
  }
  const double mean = std::accumulate(shares.begin(), shares.end(), 0.0) / 40;
  EXPECT_GT(mean, 40.0);
  for (const double share : shares) {
    EXPECT_NEAR(share, mean, std::max(1.0, 0.03 * mean));
  }
}

TEST_F(RoundsTest, TheTurnsOfASaturatedChannelComeInTheOrderInWhichTheyAreDue) {
  Join(1, 30, 100ms);
  const Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  std::vector<uint8_t> order;
  for (const protocol::Round& round : air_.Rounds(from)) {
    order.insert(order.end(), round.turns, round.turns + round.turn_count);
  }
  ASSERT_GT(order.size(), 120u);
  for (size_t i = 30; i < order.size(); ++i) {
    const auto begin = order.begin() + static_cast<std::ptrdiff_t>(i - 30);
    const std::set<uint8_t> last(begin, begin + 30);
    ASSERT_GE(last.size(), 24u) << "of 30 turns in a row, nearly all are of different robots";
  }
}

TEST_F(RoundsTest, RobotsThatAreTooManyForARoundAreDividedEvenly) {
  Join(1, 12, 1000ms);
  air_.AdvanceTo(air_.now() + 3s);
  // All are due, since nobody was asked for as long as the channel was occupied.
  air_.HearAt(air_.now(), MessageOf(protocol::SenseAnswer{9, 1, false, 0, 0}));
  Join(13, 24, 100ms);
  for (const protocol::Round& round : air_.Rounds()) {
    ASSERT_LE(round.turn_count, protocol::kMaxTurns);
  }
  const Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  std::map<int, int> sizes;
  for (const protocol::Round& round : air_.Rounds(from)) {
    ++sizes[round.turn_count];
  }
  int small = 0;
  int all = 0;
  for (const auto& [size, count] : sizes) {
    small += size > 0 && size < 4 ? count : 0;
    all += count;
  }
  EXPECT_LT(small, all / 4) << "12 due robots are 6 and 6, and not 11 and 1";
}

TEST_F(RoundsTest, ASilentRobotIsAskedLessAndLessOftenAndForgottenAfterHalfAMinute) {
  Join(1, 3, 200ms);
  air_.in_turn[3] = [] { return std::nullopt; };
  const Time from = air_.now();
  air_.AdvanceTo(from + 90s);
  const std::vector<Time> turns = air_.TurnsOf(3, from);
  ASSERT_GT(turns.size(), 5u);
  EXPECT_LT(turns.size(), 30u) << "it would have had 450";
  EXPECT_LT(turns.back(), from + 40s);
  EXPECT_GT(turns.back(), from + 25s);
  const Duration first = turns[1] - turns[0];
  const Duration last = turns.back() - turns[turns.size() - 2];
  EXPECT_GT(last, 3 * first);
  EXPECT_LT(last, 12 * 200ms);
  EXPECT_GT(TurnsOf(1, from), 400u) << "the others do not suffer";
}

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

// --- Bad air.

TEST_F(RoundsTest, InGoodAirRoundsAreCodedOnlyForNewcomers) {
  Join(1, 8, 100ms);  // more than the channel carries
  const RoundCounters before = air_.channel().counters().rounds;
  const Time from = air_.now();
  air_.AdvanceTo(from + 60s);
  const RoundCounters after = air_.channel().counters().rounds;
  size_t open = 0;
  for (const protocol::Round& round : air_.Rounds(from)) {
    open += round.open_slots != 0 ? 1u : 0u;
  }
  EXPECT_GT(after.coded, before.coded);
  EXPECT_LT(after.coded - before.coded, open / 2);
}

TEST_F(RoundsTest, WhereRobotsDoNotReceiveThemRoundsAreCoded) {
  Join(1, 8, 200ms);
  uint64_t coded = 0;
  unsigned turn = 0;
  bool is_coded = false;
  uint64_t rounds = 0;
  for (auto& [id, message] : air_.in_turn) {
    message = [&, as_id = id]() -> std::optional<protocol::Message> {
      const RoundCounters counters = air_.channel().counters().rounds;
      if (counters.rounds != rounds) {
        is_coded = counters.coded != coded;
        coded = counters.coded;
        rounds = counters.rounds;
      }
      return is_coded || ++turn % 3 == 0 ? std::optional(Sense(as_id)) : std::nullopt;
    };
  }
  air_.AdvanceTo(air_.now() + 20s);
  const RoundCounters before = air_.channel().counters().rounds;
  air_.AdvanceTo(air_.now() + 20s);
  const RoundCounters after = air_.channel().counters().rounds;
  EXPECT_GT(after.coded - before.coded, (after.rounds - before.rounds) * 9 / 10);
}

// It is there, and its next turn may be whole.
TEST_F(RoundsTest, ATurnInWhichSomethingDamagedWasHeardIsNotMissed) {
  Join(1, 4, 200ms);
  const uint64_t missed = air_.channel().counters().rounds.missed;
  air_.damages = [](uint8_t id) { return id == 3; };
  const Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  EXPECT_EQ(air_.channel().counters().rounds.missed, missed);
  EXPECT_GE(TurnsOf(3, from), TurnsOf(1, from));
}

TEST_F(RoundsTest, ARobotThatHearsEachThirdRoundKeepsItsTurns) {
  Join(1, 4, 200ms);
  unsigned turn = 0;
  air_.in_turn[2] = [&turn]() -> std::optional<protocol::Message> {
    return ++turn % 3 == 0 ? std::optional(Sense(2)) : std::nullopt;
  };
  air_.AdvanceTo(air_.now() + 20s);
  const Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  EXPECT_GE(TurnsOf(2, from), TurnsOf(1, from));
}

// In a coded round, an answer of its own goes out twice: it is not coded.
TEST_F(RoundsTest, InBadAirAnAnswerOfItsOwnGoesOutTwice) {
  Join(1, 4, 200ms);
  for (uint8_t id = 1; id <= 4; ++id) {
    air_.in_turn[id] = [id, turn = 0]() mutable -> std::optional<protocol::Message> {
      return ++turn % 3 != 0 ? std::nullopt
             : turn % 2 == 0 ? std::optional(Hello(id, 200ms))
                             : std::optional(Sense(id));
    };
  }
  air_.AdvanceTo(air_.now() + 20s);
  size_t twice = 0;
  for (const Sent& sent : air_.sent()) {
    for (size_t i = 0; i + 2 < sent.messages.size(); ++i) {
      const bool same =
          testing::FrameOf(sent.messages[i]) == testing::FrameOf(sent.messages[i + 1]);
      twice += same && sent.messages[i].opcode == protocol::kHelloAnswer ? 1u : 0u;
    }
  }
  EXPECT_GT(twice, 10u);
}

TEST_F(RoundsTest, ARobotThatWasSilentAndIsHeardAgainHasItsTurnsAgain) {
  Join(1, 3, 200ms);
  air_.in_turn[3] = [] { return std::nullopt; };
  air_.AdvanceTo(air_.now() + 20s);
  air_.in_turn[3] = [] { return Sense(3); };
  air_.AdvanceTo(air_.now() + 5s);
  const Time from = air_.now();
  air_.AdvanceTo(from + 10s);
  EXPECT_NEAR(static_cast<double>(TurnsOf(3, from)), 50.0, 4.0);
}

TEST_F(RoundsTest, AForgottenRobotComesBackByHello) {
  Join(1, 3, 200ms);
  air_.in_turn[3] = [] { return std::nullopt; };
  air_.AdvanceTo(air_.now() + 60s);
  air_.in_turn[3] = [] { return Sense(3); };
  air_.contenders.push_back(Hello(3, 200ms));
  air_.AdvanceTo(air_.now() + 5s);
  const Time from = air_.now();
  air_.AdvanceTo(from + 5s);
  EXPECT_GT(TurnsOf(3, from), 20u);
}

// --- How long a round lasts.

TEST_F(RoundsTest, NobodyButTheServerEndsARoundAndNotBeforeItsLastTurn) {
  Join(1, 5, 100ms);
  air_.in_turn[5] = [] { return std::nullopt; };
  const Time from = air_.now();
  air_.AdvanceTo(from + 10s);
  int ended = 0;
  for (size_t i = 0; i + 1 < air_.sent().size(); ++i) {
    const Sent& sent = air_.sent()[i];
    if (sent.begin < from || !sent.round() || sent.round()->turn_count == 0) {
      continue;
    }
    // When the last frame that was sent in a turn has been read.
    Time heard = sent.end;
    bool all = true;
    for (int turn = 0; turn < sent.round()->turn_count; ++turn) {
      if (sent.round()->turns[turn] != 5) {
        heard = air_.TurnBegins(sent, turn) + options_.timing.turnaround +
                static_cast<int64_t>(testing::FrameOf(Sense(1)).size()) * options_.timing.byte;
      } else {
        all = false;
        heard = air_.TurnBegins(sent, turn + 1);
      }
    }
    const Sent& next = air_.sent()[i + 1];
    ASSERT_GE(next.begin, heard);
    if (all && sent.round()->open_slots == 0 && sent.round()->turn_count == 4) {
      ++ended;
      ASSERT_LE(next.begin, heard + 10ms) << "all were heard: nothing is waited for";
    }
  }
  EXPECT_GT(ended, 10);
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

// --- COMMANDs.

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
