// What a ROUND answers, and what is answered by a frame of its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "server/robots/radio/testing/rounds_fixture.h"

namespace pheromone::radio {
namespace {

using testing::Air;
using testing::Hello;
using testing::IntensitiesOf;
using testing::MessageOf;
using testing::RoundsTest;
using testing::Sense;
using testing::Sent;
using namespace std::chrono_literals;

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

// Who has turns was answered in ROUNDs, and missed none. Returns how many ROUNDs had turns and an
// opening.
int OpeningsWhereAllAreAnsweredInRounds(Air* air, Time from) {
  int openings = 0;
  for (const Sent& sent : air->sent()) {
    if (sent.begin < from) {
      continue;
    }
    for (const protocol::Message& message : sent.messages) {
      EXPECT_TRUE(message.id == 200 || message.opcode == protocol::kRound) << int{message.id};
    }
    openings += sent.round() && sent.round()->turn_count != 0 && sent.round()->open_slots != 0;
  }
  EXPECT_EQ(air->channel().counters().rounds.missed, 0u);
  return openings;
}

TEST_F(RoundsTest, ATurnThatBeganLateIsAnsweredInARoundToo) {
  Join(1, 3, 300ms);
  for (int i = 0; i < 100; ++i) {
    air_.contenders.push_back(Sense(200));  // so that there are openings
  }
  air_.last_is_late = true;
  const Time from = air_.now();
  air_.AdvanceTo(from + 5s);
  EXPECT_GT(OpeningsWhereAllAreAnsweredInRounds(&air_, from), 10);
}

// Who takes its turns asks in no opening.
TEST_F(RoundsTest, ATurnThatIsHeardInTheOpeningIsAnsweredInARoundToo) {
  Join(1, 3, 300ms);
  air_.contenders.push_back(Sense(200));  // from now on each round has an opening
  air_.AdvanceTo(air_.now() + 1s);
  air_.pause = 8ms;
  const Time from = air_.now();
  air_.AdvanceTo(from + 3s);
  EXPECT_GT(OpeningsWhereAllAreAnsweredInRounds(&air_, from), 8);
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

// A robot may still await a ROUND of the server before, whose number may be that of one of these:
// it would take another robot's intensities for its own.
TEST(Rounds, AServerThatTakesOverBeginsAtOnceAndAnswersByFramesUntilNoneIsAwaited) {
  ChannelOptions options = testing::Options(9'600, 2ms);
  options.quiet_start = kAwaitedRound;
  testing::Air air(options);
  const Time start = air.now();
  for (const uint8_t id : {uint8_t{1}, uint8_t{2}, uint8_t{3}}) {
    air.in_turn[id] = [id] { return Sense(id, 7); };
  }
  air.channel().Resume({{1, 10}, {2, 10}, {3, 10}}, start);
  air.AdvanceTo(start + 5s);
  ASSERT_FALSE(air.sent().empty());
  const Sent& first = air.sent().front();
  EXPECT_LE(first.begin, start + 50ms);
  ASSERT_TRUE(first.round());
  EXPECT_EQ(first.messages.size(), 1u);
  EXPECT_EQ(first.round()->answer_count, 0);
  EXPECT_EQ(first.round()->turn_count, 3);
  int addressed = 0;
  int in_rounds = 0;
  for (size_t i = 1; i < air.sent().size(); ++i) {
    const Sent& sent = air.sent()[i];
    const auto round = sent.round();
    ASSERT_TRUE(round);
    for (int turn = 0; turn < round->answer_count; ++turn) {
      const uint8_t id = air.sent()[i - 1].round()->turns[turn];
      const protocol::RoundAnswer expected = IntensitiesOf(id, 7);
      if (sent.begin < start + kAwaitedRound) {
        EXPECT_EQ(round->answers[turn].left, protocol::kNoIntensities);
        EXPECT_EQ(round->answers[turn].right, 0);
        EXPECT_TRUE(std::any_of(sent.messages.begin(), sent.messages.end(), [&](const auto& it) {
          protocol::SenseAnswer answer;
          return Decode(it, &answer) && answer.id == id && answer.left == expected.left;
        }));
        ++addressed;
      } else {
        EXPECT_EQ(round->answers[turn].left, expected.left);
        ++in_rounds;
      }
    }
  }
  EXPECT_GT(addressed, 20);
  EXPECT_GT(in_rounds, 20);
}

TEST(Rounds, AServerThatTakesOverOneRobotOrNoneGivesNoTurns) {
  testing::Air air(testing::Options(9'600, 2ms));
  air.channel().Resume({{1, 10}}, air.now());
  air.AdvanceTo(air.now() + 5s);
  EXPECT_TRUE(air.sent().empty());
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
  air_.AdvanceTo(from + 2s);
  std::map<int, int> answers;
  for (size_t i = 0; i + 1 < air_.sent().size(); ++i) {
    const auto round = air_.sent()[i].round();
    if (air_.sent()[i].begin < from + 300ms || !round || round->turn_count == 0) {
      continue;
    }
    const Sent& next = air_.sent()[i + 1];
    // Twice before a coded ROUND, which one that says HELLO is given.
    const size_t times = (next.messages.size() - 1) / round->turn_count;
    ASSERT_TRUE(times == 1 || times == 2);
    ASSERT_EQ(next.messages.size(), times * round->turn_count + 1u);
    for (int turn = 0; turn < round->turn_count; ++turn) {
      const protocol::Message& own = next.messages[times * static_cast<size_t>(turn)];
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

// Of six turns in succession, robot 2 is silent in the third and fourth, and damaged in the last:
// it was told the answer to the second one in a ROUND that it missed.
TEST_F(RoundsTest, AnAnswerWhoseRoundWasMissedIsSaidOnceMore) {
  Join(1, 8, 100ms);  // more than the channel carries
  int16_t turn = 0;
  air_.in_turn[2] = [&turn]() -> std::optional<protocol::Message> {
    ++turn;
    return turn % 6 == 3 || turn % 6 == 4 ? std::nullopt : std::optional(Sense(2, turn));
  };
  air_.damages = [&turn](uint8_t id) { return id == 2 && turn % 6 == 0; };
  air_.in_turn[3] = [asked = 0]() mutable -> std::optional<protocol::Message> {
    return ++asked % 6 == 3
               ? std::nullopt  // of an ERROR, it is not said which request it answers
               : std::optional(MessageOf(protocol::SenseRequest{3, 9, false, {0, 0, 0}}));
  };
  const Time from = air_.now();
  air_.AdvanceTo(from + 10s);
  int said_again = 0;
  for (const Sent& sent : air_.sent()) {
    for (const protocol::Message& message : sent.messages) {
      protocol::SenseAnswer answer;
      if (sent.begin >= from && Decode(message, &answer)) {
        ASSERT_EQ(answer.id, 2);
        ASSERT_EQ(answer.right, 6 * said_again + 2);
        ++said_again;
      } else if (sent.begin >= from) {
        ASSERT_EQ(message.opcode, protocol::kRound);
      }
    }
  }
  EXPECT_GT(said_again, 5);
  EXPECT_NEAR(said_again, turn / 6.0, 1.0);
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

// Nothing answers a TRACE here: the log is stuck. A SENSE between two of them is answered.
TEST_F(RoundsTest, WhoseChangesWaitIsAskedTwiceAsOften) {
  Join(1, 2, 400ms);
  bool asks = false;
  air_.in_turn[1] = [&asks]() -> std::optional<protocol::Message> {
    asks = !asks;
    return asks ? Sense(1) : MessageOf(protocol::TraceRequest{1, 1, false, 5, {0, 0, 0}});
  };
  air_.AdvanceTo(air_.now() + 2s);
  Time from = air_.now();
  air_.AdvanceTo(from + 20s);
  EXPECT_NEAR(static_cast<double>(TurnsOf(1, from)), 100.0, 5.0);
  EXPECT_NEAR(static_cast<double>(TurnsOf(2, from)), 50.0, 3.0);

  air_.in_turn[1] = [] { return Sense(1); };
  air_.AdvanceTo(air_.now() + 3s);
  from = air_.now();
  air_.AdvanceTo(from + 20s);
  EXPECT_NEAR(static_cast<double>(TurnsOf(1, from)), 50.0, 3.0);
}

}  // namespace
}  // namespace pheromone::radio
