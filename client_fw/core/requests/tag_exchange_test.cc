// Requests of TAG beside those for intensities: when they are sent, repeated, refused and dropped.
#include "client_fw/core/requests/tag_exchange.h"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

#include "client_fw/core/testing/conversation_harness.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {
namespace {

using protocol::Reason;

constexpr uint16_t kTag = 31;

protocol::TagWriteRequest Claim() {
  protocol::TagWriteRequest write;
  write.tag = kTag;
  write.slot = protocol::kNoSlot;
  write.flags = protocol::kTagExpect;
  write.expected = 9;
  write.lease_s = 60;
  for (int32_t i = 0; i < protocol::kStatementWords; ++i) {
    write.words[i] = 0x01020304 * (i + 1);
  }
  return write;
}

// Until it is on the air.
void SendClaim(Harness* harness, TagExchange* exchange) {
  harness->GreetAndServe(500);
  Encode(Claim(), &exchange->message);
  harness->conversation.Ask(exchange);
  ASSERT_TRUE(harness->RunUntilSent());
  while (harness->sent.opcode != protocol::kTagWrite) {
    harness->Answer(0, 0);
    ASSERT_TRUE(harness->RunUntilSent());
  }
}

class TagExchangeTest : public testing::Test {
 protected:
  template <class Request>
  void Ask(const Request& request) {
    Encode(request, &exchange_.message);
    harness_.conversation.Ask(&exchange_);
  }

  // Answers requests for intensities until something else is sent.
  bool RunUntilTag(uint32_t limit_ms = 3000) {
    for (const uint32_t end_ms = harness_.now_ms + limit_ms; harness_.now_ms < end_ms;) {
      const int before = harness_.frames_sent;
      harness_.Step();
      if (harness_.frames_sent == before) {
        continue;
      }
      if (protocol::ServiceOf(harness_.sent.opcode) == 0x40) {
        return true;
      }
      if (harness_.sent.opcode == protocol::kHello) {
        harness_.AnswerHello();
      } else if (harness_.sent.opcode == protocol::kEvent) {
        harness_.AnswerEvent();
      } else {
        ++senses_;
        harness_.Answer(100, 100);
      }
    }
    return false;
  }

  void AnswerWrite(uint8_t seq) {
    harness_.FeedEncoded(protocol::TagWritten{kTestId, false, seq, kTag, 2, 5, 10});
  }

  Harness harness_;
  TagExchange exchange_;
  int senses_ = 0;
};

TEST_F(TagExchangeTest, AReadCarriesThePoseAndItsAnswerComesBack) {
  harness_.GreetAndServe(500);
  Ask(protocol::TagReadRequest{0, 0, 0, kTag, 3});
  ASSERT_TRUE(RunUntilTag());
  protocol::TagReadRequest sent;
  ASSERT_TRUE(Decode(harness_.sent, &sent));
  EXPECT_EQ(kTestId, sent.id);
  EXPECT_EQ(1000, sent.x);
  EXPECT_EQ(-2000, sent.y);
  EXPECT_EQ(kTag, sent.tag);
  EXPECT_EQ(3, sent.slot);
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);

  protocol::TagReadAnswer answer;
  answer.id = kTestId;
  answer.tag = kTag;
  answer.slot = 4;
  answer.words[protocol::kWordObject] = -77;
  harness_.FeedEncoded(answer);
  ASSERT_EQ(TagExchange::kAnswered, exchange_.state);
  protocol::TagReadAnswer got;
  ASSERT_TRUE(Decode(exchange_.message, &got));
  EXPECT_EQ(4, got.slot);
  EXPECT_EQ(-77, got.words[protocol::kWordObject]);
  EXPECT_EQ(1u, harness_.counters().tag_answers);
}

TEST_F(TagExchangeTest, SeveralFitIntoAPeriodAndIntensitiesComeFirst) {
  harness_.GreetAndServe(1000);
  const uint32_t begin_ms = harness_.now_ms;
  const uint32_t answers = harness_.counters().answers;
  int exchanges = 0;
  while (harness_.now_ms < begin_ms + 2000) {
    Ask(protocol::ScanRequest{0, 0, 0, 0});
    ASSERT_TRUE(RunUntilTag());
    protocol::ScanAnswer answer;
    answer.id = kTestId;
    harness_.FeedEncoded(answer);
    ASSERT_EQ(TagExchange::kAnswered, exchange_.state);
    ++exchanges;
  }
  EXPECT_GE(harness_.counters().answers - answers, 9u) << "a period is 200 ms";
  EXPECT_GT(exchanges, 30);
  EXPECT_EQ(0u, harness_.counters().fail_safe_stops);
}

TEST_F(TagExchangeTest, AnUnansweredReadIsRepeatedWithAFreshPose) {
  harness_.GreetAndServe(500);
  Ask(protocol::TagReadRequest{0, 0, 0, kTag, 0});
  ASSERT_TRUE(RunUntilTag());
  harness_.pose.x_mm += 40;
  ASSERT_TRUE(RunUntilTag());
  protocol::TagReadRequest again;
  ASSERT_TRUE(Decode(harness_.sent, &again));
  EXPECT_EQ(1040, again.x);
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);
}

TEST_F(TagExchangeTest, AnUnansweredWriteIsRepeatedByteForByteAndARobotDrivesOn) {
  harness_.GreetAndServe(500, 100, 100);
  Ask(Claim());
  ASSERT_TRUE(RunUntilTag());
  const std::vector<uint8_t> first = harness_.wire;
  protocol::TagWriteRequest sent;
  ASSERT_TRUE(Decode(harness_.sent, &sent));
  EXPECT_EQ(1, sent.seq);
  EXPECT_EQ(1000, sent.x);
  EXPECT_EQ(Claim().words[5], sent.words[5]);
  senses_ = 0;
  for (int i = 0; i < 20; ++i) {
    harness_.pose.x_mm += 40;
    ASSERT_TRUE(RunUntilTag());
    EXPECT_EQ(first, harness_.wire);
  }
  EXPECT_GT(senses_, 3);
  EXPECT_EQ(0u, harness_.counters().fail_safe_stops);
  AnswerWrite(sent.seq);
  EXPECT_EQ(TagExchange::kAnswered, exchange_.state);
  Ask(Claim());
  ASSERT_TRUE(RunUntilTag());
  ASSERT_TRUE(Decode(harness_.sent, &sent));
  EXPECT_EQ(2, sent.seq);
}

TEST_F(TagExchangeTest, AnswersToSomethingElseAreIgnored) {
  harness_.GreetAndServe(500);
  Ask(protocol::TagReadRequest{0, 0, 0, kTag, 0});
  ASSERT_TRUE(RunUntilTag());
  protocol::TagReadAnswer other;
  other.id = kTestId;
  other.tag = kTag + 1;
  harness_.FeedEncoded(other);
  protocol::ScanAnswer scan;
  scan.id = kTestId;
  harness_.FeedEncoded(scan);
  AnswerWrite(1);
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);

  protocol::Message longer;
  other.tag = kTag;
  Encode(other, &longer);
  ++longer.length;
  harness_.Feed(longer);
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);
  EXPECT_EQ(4u, harness_.counters().late_answers);
}

TEST_F(TagExchangeTest, AWriteTakesTheAnswerWithItsSeqOnly) {
  harness_.GreetAndServe(500);
  Ask(Claim());
  ASSERT_TRUE(RunUntilTag());
  AnswerWrite(7);
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);
  ASSERT_TRUE(RunUntilTag());
  harness_.FeedEncoded(
      protocol::ErrorAnswer{kTestId, protocol::kTagWrite, Reason::kGenerationChanged, 7});
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);
}

TEST_F(TagExchangeTest, OfAResolveTheNumberMustFit) {
  harness_.GreetAndServe(500);
  Ask(protocol::ResolveRequest{0, protocol::SymbolKind::kString, 15, 2, 0});
  ASSERT_TRUE(RunUntilTag());
  protocol::ResolveAnswer answer;
  answer.id = kTestId;
  answer.kind = protocol::SymbolKind::kString;
  answer.robot = 15;
  answer.number = 3;
  answer.length = answer.count = 6;
  harness_.FeedEncoded(answer);
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);
  answer.number = 2;
  protocol::Message shorter;
  Encode(answer, &shorter);
  --shorter.length;
  harness_.Feed(shorter);
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);
  harness_.FeedEncoded(answer);
  EXPECT_EQ(TagExchange::kAnswered, exchange_.state);
}

TEST_F(TagExchangeTest, ARefusalIsTold) {
  harness_.GreetAndServe(500);
  Ask(Claim());
  ASSERT_TRUE(RunUntilTag());
  harness_.FeedEncoded(
      protocol::ErrorAnswer{kTestId, protocol::kTagWrite, Reason::kGenerationChanged, 1});
  EXPECT_EQ(TagExchange::kRefused, exchange_.state);
  EXPECT_EQ(Reason::kGenerationChanged, exchange_.reason);
  EXPECT_EQ(0u, harness_.counters().lost_traces);
  senses_ = 0;
  EXPECT_FALSE(RunUntilTag(600)) << "it is not repeated";
  EXPECT_GE(senses_, 2);
}

// A copy of the WRITE may arrive when the server accepts changes again, or when a crash has undone
// what has its number.
TEST_F(TagExchangeTest, ARefusalForTheMomentLeavesTheOutcomeOfAWriteOpen) {
  for (const Reason reason : {Reason::kSequenceReused, Reason::kReadOnly}) {
    Harness harness;
    TagExchange exchange;
    SendClaim(&harness, &exchange);
    harness.FeedEncoded(protocol::ErrorAnswer{kTestId, protocol::kTagWrite, reason, 1});
    EXPECT_EQ(TagExchange::kDropped, exchange.state);
    EXPECT_EQ(reason, exchange.reason);
  }
}

TEST_F(TagExchangeTest, ABusyServerIsAskedAgain) {
  harness_.GreetAndServe(500);
  Ask(Claim());
  ASSERT_TRUE(RunUntilTag());
  harness_.FeedEncoded(protocol::ErrorAnswer{kTestId, protocol::kTagWrite, Reason::kBusy, 1});
  EXPECT_EQ(TagExchange::kAsked, exchange_.state);
  EXPECT_TRUE(RunUntilTag());
}

TEST_F(TagExchangeTest, ANewMapDropsAWriteAndARestartDoesNot) {
  for (const uint16_t epoch : {uint16_t{9}, uint16_t{10}}) {
    Harness harness;
    TagExchange exchange;
    SendClaim(&harness, &exchange);
    harness.FeedEncoded(protocol::ErrorAnswer{kTestId, protocol::kTagWrite, Reason::kSayHello, 1});
    harness.hello.epoch = epoch;
    harness.Greet();
    EXPECT_EQ(epoch == 9 ? TagExchange::kAsked : TagExchange::kDropped, exchange.state);
  }
}

TEST_F(TagExchangeTest, AWarmResetRepeatsTheWriteAndNobodyTakesItsAnswer) {
  harness_.GreetAndServe(500);
  Ask(Claim());
  ASSERT_TRUE(RunUntilTag());
  const std::vector<uint8_t> before = harness_.wire;

  Harness after(TestParameters(), 5000, harness_.memory);
  TagExchange exchange;
  after.hello.last_seq = 0;
  after.Greet();
  Encode(protocol::ScanRequest{}, &exchange.message);
  after.conversation.Ask(&exchange);
  ASSERT_TRUE(after.RunUntilSent());
  while (after.sent.opcode != protocol::kTagWrite) {
    after.Answer(0, 0);
    ASSERT_TRUE(after.RunUntilSent());
  }
  EXPECT_EQ(before, after.wire);
  after.FeedEncoded(protocol::TagWritten{kTestId, false, 1, kTag, 2, 5, 10});
  EXPECT_EQ(TagExchange::kAsked, exchange.state);
  ASSERT_TRUE(after.RunUntilSent());
  while (after.sent.opcode != protocol::kScan) {
    after.Answer(0, 0);
    ASSERT_TRUE(after.RunUntilSent());
  }
}

TEST_F(TagExchangeTest, WhileAWriteIsPendingNoTrailIsLaid) {
  Parameters parameters = TestParameters();
  parameters.lay_trail = true;
  Harness harness(parameters);
  TagExchange exchange;
  harness.GreetAndServe(500);
  Encode(Claim(), &exchange.message);
  harness.conversation.Ask(&exchange);
  std::vector<uint8_t> opcodes;
  for (int i = 0; i < 12; ++i) {
    ASSERT_TRUE(harness.RunUntilSent());
    opcodes.push_back(harness.sent.opcode);
    if (harness.sent.opcode != protocol::kTagWrite) {
      harness.Answer(0, 0);
    }
  }
  bool pending = false;
  for (const uint8_t opcode : opcodes) {
    EXPECT_FALSE(pending && protocol::ServiceOf(opcode) == protocol::kTrace);
    pending |= opcode == protocol::kTagWrite;
  }
  EXPECT_TRUE(pending);
}

TEST_F(TagExchangeTest, WithoutAPoseOnlyTablesAreAsked) {
  harness_.GreetAndServe(500);
  harness_.pose_known = false;
  Ask(protocol::ScanRequest{});
  EXPECT_FALSE(RunUntilTag(1000));
  Ask(protocol::SymbolRequest{0, 0, protocol::SymbolKind::kString, 1, 1, {'a'}});
  EXPECT_TRUE(RunUntilTag(1000));
}

// A channel on which the server grants turns.
class TagTurnTest : public TagExchangeTest {
 protected:
  void Grant(const std::vector<protocol::RoundAnswer>& answers, uint8_t turn_bytes,
             uint8_t turns = 1, uint8_t open_slots = 0) {
    protocol::Round round;
    round.number = ++number_;
    round.turn_ms = 60;
    round.turn_bytes = turn_bytes;
    round.slot_ms = kTestSlotMs;
    round.open_slots = open_slots;
    round.turns[0] = kTestId;
    round.turn_count = turns;
    for (const protocol::RoundAnswer& answer : answers) {
      round.answers[round.answer_count++] = answer;
    }
    harness_.FeedEncoded(round);
  }

  uint8_t number_ = 40;
};

TEST_F(TagTurnTest, EverySecondTurnIsForTags) {
  harness_.Greet();
  Grant({}, 100);
  Ask(Claim());
  std::vector<protocol::RoundAnswer> answers;
  std::vector<bool> tags;
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(harness_.RunUntilSent(100));
    tags.push_back(harness_.sent.opcode == protocol::kTagWrite);
    if (tags.back()) {
      AnswerWrite(harness_.sent.data[0]);
      EXPECT_EQ(TagExchange::kAnswered, exchange_.state);
      Ask(Claim());
      answers = {{protocol::kNoIntensities, 0}};
    } else {
      answers = {{100, 100}};
    }
    harness_.Run(50);
    Grant(answers, 100);
  }
  EXPECT_EQ((std::vector<bool>{false, true, false, true, false, true, false, true}), tags);
}

TEST_F(TagTurnTest, WhatIsTooLongForATurnWaitsForAnOpeningAndDoesNotTakeTheTurn) {
  harness_.Greet();
  Grant({}, 24);
  Ask(Claim());
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(harness_.RunUntilSent(100));
    EXPECT_EQ(protocol::kSense, protocol::ServiceOf(harness_.sent.opcode));
    harness_.Run(50);
    Grant({{100, 100}}, 24);
  }
  ASSERT_TRUE(harness_.RunUntilSent(100));
  harness_.Run(50);
  Grant({{100, 100}}, 24, 0, 8);
  ASSERT_TRUE(harness_.RunUntilSent(200));
  EXPECT_EQ(protocol::kTagWrite, harness_.sent.opcode);
}

// A robot that has a turn in every round once awaited the answer to that turn in every opening: on
// a full channel it could never write on a tag.
TEST_F(TagTurnTest, WhatIsTooLongForATurnIsSentInTheOpeningAfterATurnLeftOut) {
  harness_.Greet();
  Grant({}, 24, 1, 8);
  Ask(Claim());
  for (int i = 0; i < 4; ++i) {  // nobody answers; every second turn is for intensities
    ASSERT_TRUE(harness_.RunUntilSent(100)) << i;
    EXPECT_EQ(protocol::kSense, protocol::ServiceOf(harness_.sent.opcode));
    harness_.Run(50);
    Grant({{100, 100}}, 24, 1, 8);
    ASSERT_TRUE(harness_.RunUntilSent(300)) << i;
    EXPECT_EQ(protocol::kTagWrite, harness_.sent.opcode);
    harness_.Run(200);
    Grant({{protocol::kNoIntensities, 0}}, 24, 1, 8);
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
