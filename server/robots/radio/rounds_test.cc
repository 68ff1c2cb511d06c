// Rounds, seen from the air: who gets turns, and how often, in good air and bad. The figures that
// are tuned (how wide an opening is, what guards a turn) are not asserted, but what they are for.
#include "server/robots/radio/rounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <vector>

#include "server/robots/radio/testing/rounds_fixture.h"

namespace pheromone::radio {
namespace {

using testing::Air;
using testing::Hello;
using testing::MessageOf;
using testing::RoundsTest;
using testing::Sense;
using testing::Sent;
using namespace std::chrono_literals;

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

// One ROUND for all costs less than one for each: the time between is open to others.
TEST_F(RoundsTest, RobotsThatHaveFallenOutOfStepAreAskedTogetherAgain) {
  Join(1, 4, 200ms);
  air_.in_turn[4] = [turn = 0]() mutable {
    return ++turn % 5 == 0 ? std::nullopt : std::optional(Sense(4));
  };
  air_.AdvanceTo(air_.now() + 20s);
  air_.in_turn[4] = [] { return Sense(4); };
  air_.AdvanceTo(air_.now() + 60s);
  const Time from = air_.now();
  air_.AdvanceTo(from + 10s);
  const std::vector<protocol::Round> rounds = RoundsWithTurns(from);
  const auto together = std::count_if(rounds.begin(), rounds.end(),
                                      [](const auto& round) { return round.turn_count == 4; });
  EXPECT_NEAR(static_cast<double>(together), 50, 2);
  EXPECT_LE(static_cast<std::ptrdiff_t>(rounds.size()) - together, 2);
}

// It is not asked whenever the others are.
TEST_F(RoundsTest, WhoWishesLessIsAskedLess) {
  Join(1, 7, 200ms);
  Join(8, 8, 340ms);
  const Time from = air_.now();
  air_.AdvanceTo(from + 60s);
  EXPECT_LT(static_cast<double>(TurnsOf(8, from)), 1.05 * 60'000 / 340);
  EXPECT_GT(static_cast<double>(TurnsOf(8, from)), 0.95 * 60'000 / 340);
}

// There is a ROUND with turns and one with their answers, in turn. EVENTs are told in those turns
// whose ROUND's number is a multiple of 8, and openings are few.
TEST_F(RoundsTest, EventsCanBeToldInTurnsWhereEachSecondRoundHasNone) {
  Join(1, 6, 200ms);
  for (int shift = 0; shift < 8; ++shift) {
    // Who misses a ROUND is asked at once: the ROUNDs with turns have other numbers then.
    const auto in_turn = air_.in_turn;
    for (auto& [id, message] : air_.in_turn) {
      message = [] { return std::nullopt; };
    }
    air_.AdvanceTo(air_.now() + 200ms);
    air_.in_turn = in_turn;
    air_.AdvanceTo(air_.now() + 1s);
    const Time from = air_.now();
    air_.AdvanceTo(from + 10s);
    const std::vector<protocol::Round> rounds = RoundsWithTurns(from);
    const auto for_events = std::count_if(rounds.begin(), rounds.end(), [](const auto& round) {
      return round.number % protocol::kEventRounds == 0;
    });
    EXPECT_GE(for_events * 6, static_cast<std::ptrdiff_t>(rounds.size())) << shift;
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
  EXPECT_GT(open, 10u);
  EXPECT_NEAR(static_cast<double>(after.coded - before.coded), static_cast<double>(open) / 2, 1);
}

// Of ROUNDs that are not coded, robots receive every third one.
class BadAirTest : public RoundsTest {
 protected:
  void SetUp() override {
    Join(1, 8, 200ms);
    Worsen();
  }

  void Worsen() {
    for (auto& [id, message] : air_.in_turn) {
      message = [this, as_id = id]() -> std::optional<protocol::Message> {
        return Receives() ? std::optional(Sense(as_id)) : std::nullopt;
      };
    }
    air_.AdvanceTo(air_.now() + 20s);
  }

  double TurnsARound(Time since) const {
    double turns = 0;
    const std::vector<protocol::Round> rounds = air_.Rounds(since);
    for (const protocol::Round& round : rounds) {
      turns += round.turn_count;
    }
    return turns / static_cast<double>(rounds.size());
  }

 private:
  bool Receives() {
    const RoundCounters counters = air_.channel().counters().rounds;
    if (counters.rounds != counters_.rounds) {
      is_coded_ = counters.coded != counters_.coded;
      counters_ = counters;
    }
    return is_coded_ || ++turn_ % 3 == 0;
  }

  RoundCounters counters_;
  bool is_coded_ = false;
  unsigned turn_ = 0;
};

TEST_F(BadAirTest, OpeningsWidenWhileNewcomersCollide) {
  const Time from = air_.now();
  air_.contenders.assign(20, Hello(99, 200ms));
  air_.contenders_collide = true;
  air_.AdvanceTo(from + 60s);
  ASSERT_TRUE(air_.contenders.empty());
  int widest = 0;
  for (const protocol::Round& round : air_.Rounds(from)) {
    widest = std::max(widest, round.turn_count != 0 ? int{round.open_slots} : 0);
  }
  EXPECT_GE(widest, 16);
}

TEST_F(BadAirTest, WhereRobotsDoNotReceiveThemRoundsAreCoded) {
  const RoundCounters before = air_.channel().counters().rounds;
  air_.AdvanceTo(air_.now() + 20s);
  const RoundCounters after = air_.channel().counters().rounds;
  EXPECT_GT(after.coded - before.coded, (after.rounds - before.rounds) * 9 / 10);
}

TEST_F(BadAirTest, ARoundHasAsManyTurnsAsItCan) {
  Join(9, 16, 200ms);
  Worsen();
  const Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  EXPECT_GT(TurnsARound(from), 10.5) << "of 11";
}

TEST_F(BadAirTest, WhereHalfOfTheRequestsAreDamagedRoundsAreShorter) {
  Join(9, 16, 200ms);
  air_.damages = [turn = 0](uint8_t) mutable { return ++turn % 2 == 0; };
  Worsen();
  const Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  EXPECT_NEAR(TurnsARound(from), 8, 0.5) << "two rounds in equal parts";
}

// In good air each round has one then (WhileOpeningsAreUsedEveryRoundHasOne).
TEST_F(RoundsTest, WhereRequestsAreDamagedDamageInOpeningsIsNotTakenForCollisions) {
  Join(1, 8, 200ms);
  air_.damages = [turn = 0](uint8_t) mutable { return ++turn % 3 == 0; };
  air_.AdvanceTo(air_.now() + 20s);
  const Time from = air_.now();
  air_.contenders.assign(100, Hello(99, 200ms));
  air_.contenders_collide = true;
  air_.AdvanceTo(from + 15s);
  ASSERT_FALSE(air_.contenders.empty());
  const std::vector<protocol::Round> rounds = air_.Rounds(from);
  const auto open = std::count_if(rounds.begin(), rounds.end(),
                                  [](const auto& round) { return round.open_slots != 0; });
  EXPECT_LT(open * 5, static_cast<std::ptrdiff_t>(rounds.size()) * 2);
}

// The answer to its HELLO may have been lost: it takes turns from the ROUNDs that arrive.
TEST_F(RoundsTest, WhoSaysHelloAgainIsAskedByCodedRounds) {
  Join(1, 8, 200ms);
  air_.in_turn[8] = [] { return Hello(8, 200ms); };
  air_.AdvanceTo(air_.now() + 1s);
  const Time from = air_.now();
  const uint64_t before = air_.channel().counters().rounds.coded;
  air_.AdvanceTo(from + 20s);
  EXPECT_GE(air_.channel().counters().rounds.coded - before, TurnsOf(8, from));
}

TEST_F(RoundsTest, WhoseRequestsAreLostIsAskedMoreOften) {
  Join(1, 2, 400ms);
  std::minstd_rand random;
  for (const uint8_t id : {uint8_t{1}, uint8_t{2}}) {
    air_.in_turn[id] = [id, &random] {
      return random() % 4 == 0 ? std::nullopt : std::optional(Sense(id));
    };
  }
  air_.AdvanceTo(air_.now() + 20s);
  const Time from = air_.now();
  air_.AdvanceTo(from + 40s);
  // Three turns in 3 * 300 ms, and the fourth at once.
  EXPECT_NEAR(static_cast<double>(TurnsOf(1, from)), 178.0, 12.0);
}

TEST_F(RoundsTest, WhoMissedTwoIsAskedByCodedRounds) {
  Join(1, 8, 200ms);
  RoundCounters last = air_.channel().counters().rounds;
  std::vector<bool> coded;
  air_.in_turn[8] = [&]() -> std::optional<protocol::Message> {
    const RoundCounters counters = air_.channel().counters().rounds;
    coded.push_back(counters.coded != last.coded);
    last = counters;
    return coded.back() ? std::optional(Sense(8)) : std::nullopt;
  };
  const Time from = air_.now();
  air_.AdvanceTo(from + 30s);
  for (size_t i = 2; i < coded.size(); ++i) {
    ASSERT_TRUE(coded[i] || coded[i - 1] || coded[i - 2]) << i;
  }
  EXPECT_GT(TurnsOf(1, from), 110u) << "of 150";
}

// Two in succession of eight, after which coded ones are tried.
TEST_F(RoundsTest, RoundsThatAllHaveMissedSayNothingOfTheAir) {
  Join(1, 8, 200ms);
  for (auto& [id, message] : air_.in_turn) {
    message = [this, as_id = id]() -> std::optional<protocol::Message> {
      return air_.channel().counters().rounds.rounds % 8 < 2 ? std::nullopt
                                                             : std::optional(Sense(as_id));
    };
  }
  air_.AdvanceTo(air_.now() + 20s);
  const RoundCounters before = air_.channel().counters().rounds;
  air_.AdvanceTo(air_.now() + 20s);
  const RoundCounters after = air_.channel().counters().rounds;
  EXPECT_LT(after.coded - before.coded, (after.rounds - before.rounds) / 3);
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
    air_.in_turn[id] = [id, turn = int{id}]() mutable -> std::optional<protocol::Message> {
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

}  // namespace
}  // namespace pheromone::radio
