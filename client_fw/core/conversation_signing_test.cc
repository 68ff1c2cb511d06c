// A conversation on a signed link: protocol/README.md, section 18. The server's signatures are
// OpenSSL's.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "client_fw/core/testing/conversation_harness.h"
#include "client_fw/core/testing/naive_signer.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {
namespace {

using protocol::CommandCode;
using protocol::Message;

constexpr uint8_t kOther = 9;

Parameters SignedParameters() {
  static const NaiveSigner signer;
  Parameters parameters = TestParameters();
  parameters.key = signer.key.data();
  return parameters;
}

template <class T>
Message MessageOf(const T& what) {
  Message message;
  Encode(what, &message);
  return message;
}

protocol::Command CommandOf(uint8_t seq, CommandCode code, uint8_t id = kTestId) {
  protocol::Command command;
  command.id = id;
  command.seq = seq;
  command.code = code;
  return command;
}

/// A harness whose server signs. What Harness itself feeds is not signed.
struct SignedHarness : Harness {
  explicit SignedHarness(const Parameters& parameters = SignedParameters(),
                         const RequestMemory& remembered = RequestMemory())
      : Harness(parameters, 5000, remembered) {}

  /// Until a frame is on the air; `sent` is without what signing has added.
  bool NextFrame(uint32_t limit_ms = 3000) {
    if (!RunUntilSent(limit_ms)) {
      return false;
    }
    as_sent = sent;
    EXPECT_TRUE(signer.Open(&sent)) << "opcode " << int{sent.opcode};
    return true;
  }

  template <class T>
  Message FeedSigned(const T& what) {
    Message message = MessageOf(what);
    signer.Sign(&message);
    Feed(message);
    return message;
  }
  void FeedSigned(Message message) {
    signer.Sign(&message);
    Feed(message);
  }

  /// To the HELLO in `sent`: the greeting, and the answer to the second HELLO.
  void AnswerSignedHello() {
    ASSERT_TRUE(signer.greets);
    Feed(signer.Greeting(kTestId));
    ASSERT_FALSE(conversation.requests().greeted);
    ASSERT_TRUE(NextFrame());
    ASSERT_EQ(protocol::kHello, sent.opcode);
    ASSERT_FALSE(signer.greets);
    FeedSigned(hello);
    ASSERT_TRUE(conversation.requests().greeted);
  }

  void SignedGreet() {
    ASSERT_TRUE(NextFrame());
    AnswerSignedHello();
  }

  /// HELLO, and the answer to the first SENSE: it drives.
  void GreetAndDrive() {
    SignedGreet();
    ASSERT_TRUE(NextFrame());
    FeedSigned(AnswerToSent(0, 0));
    ASSERT_EQ(kStraight, conversation.state().wheels);
  }

  protocol::Round RoundWith(const std::vector<uint8_t>& turns) {
    protocol::Round round;
    round.number = ++number;
    round.turn_ms = 20;
    round.turn_bytes = 30;
    round.slot_ms = kTestSlotMs;
    for (const uint8_t id : turns) {
      round.turns[round.turn_count++] = id;
    }
    return round;
  }

  NaiveSigner signer;
  Message as_sent;
  uint8_t number = 40;
};

TEST(SignedConversationTest, HelloBeginsASessionInWhichItDrives) {
  SignedHarness harness;
  harness.GreetAndDrive();
  for (int i = 0; i < 300; ++i) {  // more than the counters' low byte holds
    ASSERT_TRUE(harness.NextFrame());
    harness.FeedSigned(harness.AnswerToSent(100, 200));
    ASSERT_EQ(200, harness.conversation.state().p_right);
  }
  EXPECT_EQ(0u, harness.counters().forged);
  EXPECT_EQ((std::vector<uint16_t>{0}), harness.signer.hellos);
}

TEST(SignedConversationTest, WithoutAKeyNothingIsAdded) {
  Harness harness;
  ASSERT_TRUE(harness.RunUntilSent());
  EXPECT_EQ(4, harness.sent.length);
}

TEST(SignedConversationTest, AServerThatDoesNotSignIsIgnored) {
  SignedHarness harness;
  for (int i = 1; i <= 3; ++i) {
    ASSERT_TRUE(harness.NextFrame());
    harness.AnswerHello();
    EXPECT_FALSE(harness.conversation.requests().greeted);
    EXPECT_EQ(static_cast<unsigned>(i), harness.counters().forged);
  }
  EXPECT_EQ((std::vector<uint16_t>{0, 1, 2}), harness.signer.hellos);
  harness.SignedGreet();
}

TEST(SignedConversationTest, NoAnswerIsForgedOrRepeated) {
  SignedHarness harness;
  harness.GreetAndDrive();
  ASSERT_TRUE(harness.NextFrame());
  harness.Answer(5000, -5000);
  harness.AnswerError(protocol::Reason::kSayHello);
  EXPECT_EQ(0, harness.conversation.state().p_left);
  EXPECT_EQ(2u, harness.counters().forged);
  EXPECT_EQ(0u, harness.counters().errors);
  Message answer = harness.AnswerToSent(300, 400);
  harness.signer.Sign(&answer);
  harness.Feed(answer);
  EXPECT_EQ(300, harness.conversation.state().p_left);
  ASSERT_TRUE(harness.NextFrame());
  harness.FeedSigned(harness.AnswerToSent(1, 2));
  ASSERT_TRUE(harness.NextFrame());
  harness.Feed(answer);  // to a request like this one
  EXPECT_EQ(1, harness.conversation.state().p_left);
  EXPECT_EQ(3u, harness.counters().forged);
}

TEST(SignedConversationTest, NoCommandIsForgedOrRepeated) {
  SignedHarness harness;
  harness.GreetAndDrive();
  harness.FeedEncoded(CommandOf(1, CommandCode::kHalt));
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
  const Message halt = harness.FeedSigned(CommandOf(1, CommandCode::kHalt));
  EXPECT_EQ(kHalted, harness.conversation.state().flags);
  ASSERT_TRUE(harness.NextFrame(17));
  protocol::CommandAck ack;
  ASSERT_TRUE(Decode(harness.sent, &ack));
  EXPECT_EQ(CommandCode::kHalt, ack.code);

  const Message resume = harness.FeedSigned(CommandOf(2, CommandCode::kResume));
  EXPECT_EQ(0, harness.conversation.state().flags);
  harness.FeedSigned(CommandOf(3, CommandCode::kHalt));
  EXPECT_EQ(3u, harness.counters().commands);
  harness.Feed(resume);
  harness.Feed(halt);
  EXPECT_EQ(3u, harness.counters().commands);
  EXPECT_EQ(0u, harness.counters().repeated_commands);
  EXPECT_EQ(kHalted, harness.conversation.state().flags);
  EXPECT_EQ(3u, harness.counters().forged);
}

TEST(SignedConversationTest, AHaltToAllIsObeyedIfTheGroupsKeySignsIt) {
  SignedHarness harness;
  harness.GreetAndDrive();
  harness.FeedEncoded(CommandOf(1, CommandCode::kHalt, protocol::kBroadcastId));
  EXPECT_EQ(0, harness.conversation.state().flags);
  EXPECT_EQ(1u, harness.counters().forged);
  const Message halt = harness.FeedSigned(CommandOf(1, CommandCode::kHalt, protocol::kBroadcastId));
  EXPECT_EQ(kHalted, harness.conversation.state().flags);
  harness.FeedSigned(CommandOf(2, CommandCode::kResume));
  EXPECT_EQ(0, harness.conversation.state().flags);
  harness.Feed(halt);
  EXPECT_EQ(0, harness.conversation.state().flags) << "repeated by somebody";
  EXPECT_EQ(2u, harness.counters().forged);
}

// Every robot of the link has the group's key.
TEST(SignedConversationTest, NoOtherCommandToAllIsObeyedThoughTheGroupsKeySignsIt) {
  SignedHarness harness;
  harness.GreetAndDrive();
  harness.FeedSigned(CommandOf(1, CommandCode::kHalt));
  EXPECT_EQ(kHalted, harness.conversation.state().flags);
  harness.FeedSigned(CommandOf(2, CommandCode::kResume, protocol::kBroadcastId));
  EXPECT_EQ(kHalted, harness.conversation.state().flags);
  EXPECT_EQ(0u, harness.counters().forged);
  harness.FeedSigned(CommandOf(3, CommandCode::kResume));
  EXPECT_EQ(0, harness.conversation.state().flags);
}

TEST(SignedConversationTest, ALinkThatTakesUnsignedFramesHaltsAllWithoutASignature) {
  SignedHarness harness;
  harness.signer.accepts_unsigned = true;
  harness.GreetAndDrive();
  harness.FeedEncoded(CommandOf(1, CommandCode::kHalt, protocol::kBroadcastId));
  EXPECT_EQ(kHalted, harness.conversation.state().flags);
  harness.FeedEncoded(CommandOf(2, CommandCode::kResume));
  EXPECT_EQ(kHalted, harness.conversation.state().flags);
}

TEST(SignedConversationTest, ARepeatedTraceHasItsDataAndACounterOfItsOwn) {
  Parameters parameters = SignedParameters();
  parameters.lay_trail = true;
  SignedHarness harness(parameters);
  harness.SignedGreet();
  ASSERT_TRUE(harness.NextFrame());
  const Message first = harness.sent;
  const Message first_as_sent = harness.as_sent;
  EXPECT_EQ(protocol::kTrace | 2, first.opcode);
  ASSERT_TRUE(harness.NextFrame());
  EXPECT_EQ(first.opcode, harness.sent.opcode);
  ASSERT_EQ(first.length, harness.sent.length);
  EXPECT_TRUE(std::equal(first.data, first.data + first.length, harness.sent.data));
  EXPECT_NE(first_as_sent.data[first.length], harness.as_sent.data[first.length]);
  harness.FeedSigned(harness.AnswerToSent(1, 2));
  EXPECT_EQ(0, harness.memory.opcode);
}

TEST(SignedConversationTest, FramesOfAndToOthersAreHeardAsEver) {
  SignedHarness harness;
  harness.GreetAndDrive();
  harness.FeedEncoded(protocol::SenseAnswer{kOther, 2, false, 1, 1});
  harness.FeedEncoded(protocol::SenseRequest{kOther, 2, false, {0, 0, 0}});
  EXPECT_EQ(2u, harness.counters().heard);
  harness.FeedEncoded(protocol::SenseRequest{kTestId, 2, false, {0, 0, 0}});
  EXPECT_EQ(1u, harness.counters().own_id_heard);
  EXPECT_EQ(0u, harness.counters().forged);
}

// It was restarted, and has no session with us: it is silent. Others have said HELLO already, so
// that its frames to them are heard. For 8 s the air may be bad: HELLO takes two exchanges.
TEST(SignedConversationTest, AServerThatHasForgottenUsIsGreetedThoughItIsHeard) {
  SignedHarness harness;
  harness.GreetAndDrive();
  harness.signer = NaiveSigner();
  harness.signer.group_key[0] = 99;
  const uint32_t from_ms = harness.now_ms;
  do {
    ASSERT_LT(harness.now_ms - from_ms, 10'000u);
    harness.Step();
    if (harness.now_ms % 100 == 0 && !harness.leaving) {
      harness.FeedEncoded(protocol::SenseAnswer{kOther, 2, false, 1, 1});
    }
  } while (harness.leaving || harness.sent.opcode != protocol::kHello);
  EXPECT_GE(harness.now_ms - from_ms, 7900u);
  ASSERT_TRUE(harness.signer.Open(&harness.sent));
  harness.AnswerSignedHello();
  ASSERT_TRUE(harness.NextFrame());
  harness.FeedSigned(harness.AnswerToSent(0, 0));
  EXPECT_EQ(kStraight, harness.conversation.state().wheels);
}

TEST(SignedConversationTest, AGreetingIsTakenOnceAndAlsoLate) {
  SignedHarness harness;
  ASSERT_TRUE(harness.NextFrame());
  harness.Run(110);  // the window is over
  EXPECT_EQ(1u, harness.counters().timeouts);
  const Message greeting = harness.signer.Greeting(kTestId);
  harness.Feed(greeting);
  ASSERT_TRUE(harness.NextFrame());
  EXPECT_FALSE(harness.signer.greets);
  harness.Feed(greeting);
  EXPECT_EQ(1u, harness.counters().forged) << "the session would begin again";
  harness.FeedSigned(harness.hello);
  ASSERT_TRUE(harness.conversation.requests().greeted);
  ASSERT_TRUE(harness.NextFrame());
  harness.Feed(greeting);
  EXPECT_EQ(1u, harness.counters().late_answers);
  harness.FeedSigned(harness.AnswerToSent(7, 8));
  EXPECT_EQ(7, harness.conversation.state().p_left) << "the session goes on";
}

TEST(SignedConversationTest, ASecondHelloIsRepeatedThreeTimesThenAFirstOneFollows) {
  SignedHarness harness;
  for (uint16_t number = 0; number < 3; ++number) {
    ASSERT_TRUE(harness.NextFrame());
    ASSERT_TRUE(harness.signer.greets);
    EXPECT_EQ(number, harness.signer.hellos.back());
    harness.Feed(harness.signer.Greeting(kTestId));
    for (int i = 0; i < 4; ++i) {
      ASSERT_TRUE(harness.NextFrame());
      EXPECT_EQ(protocol::kHello, harness.sent.opcode);
      EXPECT_EQ(4, harness.sent.length);
      ASSERT_FALSE(harness.signer.greets);
    }
  }
  harness.GreetAndDrive();
}

TEST(SignedConversationTest, WheneverHelloIsAskedForItBeginsWithTheFirst) {
  SignedHarness harness;
  harness.GreetAndDrive();
  ASSERT_TRUE(harness.NextFrame());
  harness.FeedSigned(
      protocol::ErrorAnswer{kTestId, harness.sent.opcode, protocol::Reason::kSayHello, 0});
  harness.GreetAndDrive();
  EXPECT_EQ((std::vector<uint16_t>{0, 1}), harness.signer.hellos);
}

// Numbers of HELLO.

TEST(SignedConversationTest, NumbersOfHelloGoOnAfterAWarmResetAndBeginAnewWithAnotherNonce) {
  SignedHarness before;
  ASSERT_TRUE(before.NextFrame());
  ASSERT_TRUE(before.NextFrame());
  before.SignedGreet();
  EXPECT_EQ((std::vector<uint16_t>{0, 1, 2}), before.signer.hellos);

  RequestMemory kept = before.memory;
  ASSERT_TRUE(Restore(&kept));
  SignedHarness after(SignedParameters(), kept);
  after.SignedGreet();
  EXPECT_EQ((std::vector<uint16_t>{3}), after.signer.hellos);

  Parameters switched_on = SignedParameters();
  ++switched_on.boot_counter;
  SignedHarness another(switched_on, after.memory);
  ASSERT_TRUE(another.NextFrame());
  EXPECT_EQ((std::vector<uint16_t>{0}), another.signer.hellos);
  EXPECT_EQ(switched_on.boot_counter, another.signer.client_nonce);
}

// Whenever the reset comes: from the first byte on the number is used.
TEST(SignedConversationTest, ANumberIsSealedBeforeItIsSent) {
  SignedHarness harness;
  for (uint16_t number = 0; number < 3; ++number) {
    while (harness.conversation.tx_size() == 0) {
      harness.Step();
    }
    RequestMemory kept = harness.memory;
    ASSERT_TRUE(Restore(&kept));
    EXPECT_EQ(number + 1, kept.hellos_signed);
    RequestMemory damaged = harness.memory;  // in the middle of the next change
    ++damaged.seq;
    ASSERT_TRUE(Restore(&damaged));
    EXPECT_EQ(number + 1, damaged.hellos_signed);
    ASSERT_TRUE(harness.RunUntilSent());
    while (harness.conversation.tx_size() != 0) {
      harness.Step();
    }
  }
}

RequestMemory After(uint16_t hellos) {
  RequestMemory memory = RequestMemory();
  memory.in_use = true;
  memory.nonce = SignedParameters().boot_counter;
  memory.hellos_signed = hellos;
  Seal(&memory);
  return memory;
}

TEST(SignedConversationTest, AfterManyHellosTheyAreSaidSeldom) {
  SignedHarness quick(SignedParameters(), After(4000));
  quick.Run(20'000);
  EXPECT_GE(quick.counters().hellos, 20u);

  SignedHarness seldom(SignedParameters(), After(4096));
  seldom.Run(100'000);
  EXPECT_GE(seldom.counters().hellos, 100u / 14);
  EXPECT_LE(seldom.counters().hellos, 1 + 100u / 6);
  // Also beside a server that grants turns to others.
  SignedHarness beside(SignedParameters(), After(4096));
  for (int i = 0; i < 1000; ++i) {
    beside.FeedEncoded(beside.RoundWith({}));
    beside.Run(100);
  }
  EXPECT_LE(beside.counters().hellos, 1 + 100u / 6);
}

TEST(SignedConversationTest, WithoutANumberThereIsNoHello) {
  SignedHarness harness(SignedParameters(), After(65534));
  ASSERT_TRUE(harness.NextFrame());
  EXPECT_EQ((std::vector<uint16_t>{65534}), harness.signer.hellos);
  harness.Run(200'000);
  EXPECT_EQ(1, harness.frames_sent);
}

// Rounds.

TEST(SignedConversationTest, ATurnIsTakenAndAnsweredIfRoundsAreSigned) {
  SignedHarness harness;
  harness.SignedGreet();
  harness.FeedSigned(harness.RoundWith({kTestId}));
  ASSERT_TRUE(harness.NextFrame(20));
  harness.SentSense();
  protocol::Round answering = harness.RoundWith({kOther});
  answering.answers[answering.answer_count++] = {500, -600};
  protocol::Round forged = answering;
  forged.answers[0] = {-500, 600};
  harness.FeedEncoded(forged);
  harness.FeedSigned(answering);
  EXPECT_EQ(500, harness.conversation.state().p_left);
  EXPECT_EQ(1u, harness.counters().forged);
  EXPECT_EQ(2u, harness.counters().rounds);
  EXPECT_EQ(1u, harness.counters().turns);
}

TEST(SignedConversationTest, TurnsOfARoundThatIsNotSignedAreNotTaken) {
  SignedHarness harness;
  harness.GreetAndDrive();
  const Message heard = harness.FeedSigned(harness.RoundWith({kTestId}));
  ASSERT_TRUE(harness.NextFrame(20));
  harness.Run(50);
  harness.Feed(heard);
  harness.FeedEncoded(harness.RoundWith({kTestId}));
  EXPECT_FALSE(harness.RunUntilSent(20));
  EXPECT_EQ(2u, harness.counters().forged);
  EXPECT_EQ(1u, harness.counters().rounds);
}

// Before HELLO is answered the group's key is not known.
TEST(SignedConversationTest, WhoHasNoSessionKeepsOutOfTheTurnsOfOthers) {
  for (const bool rounds_are_signed : {true, false}) {
    SignedHarness harness;
    for (int i = 0; i < 20; ++i) {
      const protocol::Round round = harness.RoundWith({kOther, 3, 4});
      if (rounds_are_signed) {
        harness.FeedSigned(round);
      } else {
        harness.FeedEncoded(round);
      }
      harness.Run(61);  // three turns
    }
    EXPECT_EQ(0, harness.frames_sent);
    EXPECT_EQ(0u, harness.counters().forged);
    EXPECT_EQ(20u, harness.counters().rounds);
    protocol::Round open = harness.RoundWith({kOther});
    open.open_slots = 8;
    harness.FeedSigned(open);
    ASSERT_TRUE(harness.NextFrame(20 + 8 * kTestSlotMs + 20));
    harness.AnswerSignedHello();
  }
}

TEST(SignedConversationTest, WithoutASessionNoTurnIsTakenAndNoAnswerBelieved) {
  SignedHarness harness;
  harness.FeedEncoded(harness.RoundWith({kTestId}));
  EXPECT_FALSE(harness.RunUntilSent(20));
  ASSERT_TRUE(harness.NextFrame());
  EXPECT_TRUE(harness.signer.greets);
  protocol::Round answering = harness.RoundWith({});
  answering.answers[answering.answer_count++] = {500, -600};
  harness.FeedEncoded(answering);
  EXPECT_EQ(0, harness.conversation.state().p_left);
  EXPECT_EQ(kStill, harness.conversation.state().wheels);
  EXPECT_EQ(0u, harness.counters().answers);
}

// Lengths.

TEST(SignedConversationTest, ANameOnATagIsRefusedIfItsFrameHasNoRoomForASignature) {
  SignedHarness harness;
  harness.GreetAndDrive();
  TagExchange exchange;
  protocol::SymbolRequest symbol;
  symbol.kind = protocol::SymbolKind::kString;
  for (const uint8_t length : {uint8_t{53}, uint8_t{54}}) {
    Encode(symbol, &exchange.message);
    for (uint8_t i = 0; i < length; ++i) {
      exchange.message.data[exchange.message.length++] = 'a';
    }
    harness.conversation.Ask(&exchange);
    EXPECT_EQ(length == 53 ? TagExchange::kAsked : TagExchange::kRefused, exchange.state);
    while (exchange.state == TagExchange::kAsked) {
      ASSERT_TRUE(harness.NextFrame());
      if (harness.sent.opcode != protocol::kSymbol) {
        harness.FeedSigned(harness.AnswerToSent(1, 1));
        continue;
      }
      EXPECT_EQ(protocol::kMaxData, harness.as_sent.length);
      protocol::SymbolAnswer answer;
      answer.id = kTestId;
      answer.seq = harness.sent.data[0];
      answer.number = 8;
      harness.FeedSigned(answer);
      EXPECT_EQ(TagExchange::kAnswered, exchange.state);
    }
  }
  EXPECT_EQ(protocol::Reason::kBadLength, exchange.reason);
}

// Of ten robots each takes 28 ms for 26 bytes at 9600 baud, or 38 ms for 36, and 36 ms for the
// window and two slots; two slots less in all: 634 or 734 ms.
TEST(SignedConversationTest, ContentionPeriodsAreLongEnoughForWhatIsAdded) {
  for (const bool is_signed : {false, true}) {
    Parameters parameters = SignedParameters();
    parameters.period_ms = 700;
    if (!is_signed) {
      parameters.key = nullptr;
    }
    SignedHarness harness(parameters);
    ASSERT_TRUE(harness.RunUntilSent());
    if (is_signed) {
      ASSERT_TRUE(harness.signer.Open(&harness.sent));
      harness.AnswerSignedHello();
    } else {
      harness.AnswerHello();
    }
    bool congested = false;
    for (uint32_t i = 0; i < 12'000; ++i) {
      harness.Step();
      congested = congested || (harness.conversation.requests().greeted &&  // it knows the window
                                harness.conversation.congested());
      if (i % 50 == 0) {
        harness.FeedEncoded(
            protocol::SenseRequest{static_cast<uint8_t>(20 + i / 50 % 9), 2, false, {0, 0, 0}});
      }
    }
    EXPECT_EQ(is_signed, congested);
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
