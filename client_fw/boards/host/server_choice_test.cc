// A client with several servers, in a time of the test's own: frames are made and expected by the
// rules of protocol/README.md, section 8.
#include "client_fw/boards/host/server_choice.h"

#include <gtest/gtest.h>

#include <iterator>
#include <vector>

#include "client_fw/boards/host/testing/server_frames.h"

namespace pheromone::client {
namespace {

Bytes Ping() {  // after a pad byte, as a client resynchronises
  protocol::Message ping;
  ping.id = kTestId;
  ping.opcode = protocol::kPing;
  ping.length = 1;
  ping.data[0] = 9;
  Bytes bytes = FrameOf(ping);
  bytes.insert(bytes.begin(), 0x00);
  return bytes;
}
Bytes Acknowledgement() {
  return FrameOf(protocol::CommandAck{kTestId, 1, protocol::CommandCode::kHalt, 0});
}

class ServerChoiceTest : public testing::Test {
 protected:
  explicit ServerChoiceTest(size_t servers = 2) : choice_(servers, kTestId) {}

  void Exchange(const Bytes& request, const Bytes& answer) {
    choice_.OnSent(request, now_ms_);
    choice_.OnReceived(answer, now_ms_);
  }
  // The time from now to the next move; -1: none within ten seconds.
  int64_t UntilMove() {
    for (const int64_t since_ms = now_ms_; now_ms_ < since_ms + 10'000; ++now_ms_) {
      if (choice_.Move(now_ms_)) {
        return now_ms_ - since_ms;
      }
    }
    return -1;
  }
  Bytes Unanswered() const {
    const auto bytes = choice_.unanswered();
    return {bytes.begin(), bytes.end()};
  }
  Bytes Inquiry() {
    const auto bytes = choice_.TakeInquiry(now_ms_);
    return {bytes.begin(), bytes.end()};
  }
  // With the second server, after the first one was greeted, and has gone.
  void ComeFromTheFirst() {
    Exchange(Hello(), Greeting(3));
    choice_.OnRefused();
    ASSERT_TRUE(choice_.Move(now_ms_));
    ASSERT_EQ(1u, choice_.server());
  }

  int64_t now_ms_ = 1000;
  ServerChoice choice_;
};

TEST_F(ServerChoiceTest, StaysWhereItIsAnswered) {
  for (int16_t i = 0; i < 100; ++i) {
    Exchange(Sense(i), Sensed());
    now_ms_ += 200;
    ASSERT_FALSE(choice_.Move(now_ms_));
  }
  EXPECT_EQ(-1, UntilMove());  // whoever asks nothing misses no answer
  EXPECT_EQ(0u, choice_.server());
}

TEST_F(ServerChoiceTest, GoesOnAfterASilenceWithWhatWasSentLast) {
  Exchange(Sense(1), Sensed());
  now_ms_ += 200;
  choice_.OnSent(Sense(2), now_ms_);
  now_ms_ += 101;
  choice_.OnSent(Ping(), now_ms_);
  EXPECT_EQ(150 - 101, UntilMove());
  EXPECT_EQ(1u, choice_.server());
  EXPECT_EQ(Ping(), Unanswered());
  choice_.OnReceived(FrameOf(protocol::EventAck{kTestId, 1}), now_ms_);  // any frame of the server
  EXPECT_TRUE(choice_.unanswered().empty());
  EXPECT_EQ(-1, UntilMove());
}

TEST_F(ServerChoiceTest, AChangeAloneMayTakeItsTime) {
  choice_.OnSent(Trace(4), now_ms_);
  EXPECT_EQ(-1, UntilMove());
  choice_.OnReceived(Traced(4), now_ms_);
  choice_.OnSent(Trace(5), now_ms_);
  now_ms_ += 120;
  choice_.OnSent(Ping(), now_ms_);  // but not this
  EXPECT_EQ(40, UntilMove());
}

TEST_F(ServerChoiceTest, AnAcknowledgementIsNotAnswered) {
  Exchange(Sense(1), Sensed());
  choice_.OnSent(Acknowledgement(), now_ms_);
  EXPECT_EQ(-1, UntilMove());
}

TEST_F(ServerChoiceTest, ARefusalIsAReasonToGoOnAtOnce) {
  choice_.OnSent(Trace(4), now_ms_);
  choice_.OnRefused();
  EXPECT_EQ(0, UntilMove());
  EXPECT_EQ(Trace(4), Unanswered());  // byte for byte
}

class ThreeServersTest : public ServerChoiceTest {
 protected:
  ThreeServersTest() : ServerChoiceTest(3) {}
};

TEST_F(ThreeServersTest, AListThatIsSilentIsTriedMoreAndMoreSlowly) {
  choice_.OnSent(Sense(1), now_ms_);
  const int64_t expected_ms[] = {150, 150, 150, 300, 300, 300, 600, 600, 600, 600};
  for (size_t i = 0; i < std::size(expected_ms); ++i) {
    EXPECT_EQ(expected_ms[i], UntilMove()) << i;
    EXPECT_EQ((i + 1) % 3, choice_.server());
    EXPECT_EQ(i + 1, choice_.moves());
  }
  choice_.OnReceived(Sensed(), now_ms_);
  choice_.OnSent(Sense(2), now_ms_);
  EXPECT_EQ(150, UntilMove());
}

TEST_F(ThreeServersTest, AListThatRefusesIsTriedAtOnceOnce) {
  choice_.OnSent(Sense(1), now_ms_);
  for (const int64_t expected_ms : {0, 0, 0, 300, 300, 300, 600, 600}) {
    choice_.OnRefused();
    EXPECT_EQ(expected_ms, UntilMove());
  }
}

TEST_F(ServerChoiceTest, WhatIsNoFrameOfTheServerForThisClientIsNoAnswer) {
  choice_.OnSent(Sense(1), now_ms_);
  choice_.OnReceived(Sensed(kTestId + 1), now_ms_);
  choice_.OnReceived(Sense(1), now_ms_);  // an echo
  Bytes damaged = Sensed();
  damaged[damaged.size() - 3] ^= 1;
  choice_.OnReceived(damaged, now_ms_);
  EXPECT_EQ(150, UntilMove());
}

TEST_F(ServerChoiceTest, TheBeginningFromOneServerIsNotJoinedToTheRestFromAnother) {
  const Bytes answer = Sensed();
  choice_.OnSent(Sense(1), now_ms_);
  choice_.OnReceived({answer.data(), 4}, now_ms_);
  EXPECT_EQ(150, UntilMove());
  choice_.OnReceived({answer.data() + 4, answer.size() - 4}, now_ms_);
  EXPECT_EQ(150, UntilMove());
}

TEST_F(ServerChoiceTest, AServerThatAnswersOnlyQueriesIsLeftWithAChangeThatWaits) {
  const int64_t begin_ms = now_ms_;
  while (!choice_.Move(now_ms_) && now_ms_ < begin_ms + 10'000) {
    Exchange(Trace(4), Refusal(4, protocol::Reason::kBusy));
    Exchange(Sense(1), Sensed());
    now_ms_ += 100;
  }
  EXPECT_EQ(begin_ms + 1100, now_ms_);  // at the first repetition after a second
  EXPECT_EQ(1u, choice_.server());
  Exchange(Trace(4), Traced(4));
  for (uint8_t seq = 5; seq < 100; ++seq) {  // a new change has a second of its own
    Exchange(Trace(seq), seq % 2 == 0 ? Traced(seq) : Refusal(seq, protocol::Reason::kMapFull));
    now_ms_ += 100;
    ASSERT_FALSE(choice_.Move(now_ms_));
  }
}

TEST_F(ServerChoiceTest, AServerThatAnswersTheLastRepetitionIsNotLeft) {
  const int64_t begin_ms = now_ms_;
  for (; now_ms_ < begin_ms + 1000; now_ms_ += 100) {
    Exchange(Trace(4), Refusal(4, protocol::Reason::kBusy));
    ASSERT_FALSE(choice_.Move(now_ms_));
  }
  Exchange(Trace(4), Traced(4));
  EXPECT_EQ(-1, UntilMove());
}

TEST_F(ServerChoiceTest, AServerThatIsReadOnlyIsLeftToo) {
  const int64_t begin_ms = now_ms_;
  for (uint8_t seq = 4; !choice_.Move(now_ms_) && seq < 100; ++seq) {  // the client gives each up
    Exchange(Trace(seq), Refusal(seq, protocol::Reason::kReadOnly));
    now_ms_ += 200;
  }
  EXPECT_EQ(begin_ms + 1200, now_ms_);

  Exchange(Trace(100), Refusal(100, protocol::Reason::kReadOnly));
  now_ms_ += 5000;
  Exchange(Trace(101), Refusal(101, protocol::Reason::kReadOnly));
  EXPECT_FALSE(choice_.Move(now_ms_));  // a single one now and then tells nothing
}

TEST_F(ServerChoiceTest, AsksWhetherTheNewServerHasTheSameEpoch) {
  ComeFromTheFirst();
  EXPECT_EQ(Bytes(), Inquiry());  // it is not known to be there
  choice_.OnSent(Sense(1), now_ms_);
  EXPECT_EQ(Bytes(), Inquiry());
  choice_.OnReceived(Sensed(), now_ms_);
  EXPECT_EQ(Hello(), Inquiry());
  EXPECT_EQ(Bytes(), Inquiry());
  for (int i = 0; i < 4; ++i) {  // it has no leader yet, but answers
    now_ms_ += 200;
    EXPECT_EQ(Bytes(), Inquiry());
    Exchange(Sense(2), Sensed());
  }
  now_ms_ += 200;
  EXPECT_EQ(Hello(), Inquiry());
  choice_.OnReceived(Greeting(4, kTestNonce + 1), now_ms_);  // another boot's
  now_ms_ += 1000;
  EXPECT_EQ(Hello(), Inquiry());
  choice_.OnReceived(Greeting(3), now_ms_);
  now_ms_ += 5000;
  EXPECT_EQ(Bytes(), Inquiry());
  EXPECT_FALSE(choice_.TakeNewEpoch());
}

TEST_F(ServerChoiceTest, TellsOnceThatTheEpochIsAnother) {
  ComeFromTheFirst();
  Exchange(Sense(1), Sensed());
  EXPECT_EQ(Hello(), Inquiry());
  choice_.OnReceived(Greeting(4), now_ms_);
  EXPECT_TRUE(choice_.TakeNewEpoch());
  EXPECT_FALSE(choice_.TakeNewEpoch());
  Exchange(Hello(), Greeting(4));  // so the client says it
  EXPECT_FALSE(choice_.TakeNewEpoch());
  choice_.OnRefused();
  ASSERT_TRUE(choice_.Move(now_ms_));  // back to the first, whose epoch is another one again
  Exchange(Sense(1), Sensed());
  EXPECT_EQ(Hello(), Inquiry());
  choice_.OnReceived(Greeting(3), now_ms_);
  EXPECT_TRUE(choice_.TakeNewEpoch());
}

TEST_F(ServerChoiceTest, ASecondCopyOfTheAnswerTakesNothingBack) {
  ComeFromTheFirst();
  Exchange(Sense(1), Sensed());
  EXPECT_EQ(Hello(), Inquiry());
  Bytes twice = Greeting(4);
  const Bytes second = Greeting(4);
  twice.insert(twice.end(), second.begin(), second.end());
  choice_.OnReceived(twice, now_ms_);
  EXPECT_TRUE(choice_.TakeNewEpoch());
}

// It may be a server of another epoch which has greeted this robot before.
TEST_F(ServerChoiceTest, AsksAlsoWhenAChangeWasAnsweredButNotBefore) {
  ComeFromTheFirst();
  choice_.OnSent(Trace(1), now_ms_);
  choice_.OnReceived(Refusal(1, protocol::Reason::kBusy), now_ms_);
  now_ms_ += kInquiryMs - 1;
  EXPECT_EQ(Bytes(), Inquiry());  // HELLO would be a second change
  Exchange(Trace(1), Traced(1));
  EXPECT_EQ(Hello(), Inquiry());
}

TEST_F(ServerChoiceTest, AHelloOfTheClientItselfIsEnough) {
  ComeFromTheFirst();
  Exchange(Trace(1), Refusal(1, protocol::Reason::kSayHello));
  Exchange(Hello(), Greeting(4));
  EXPECT_EQ(Bytes(), Inquiry());
  EXPECT_FALSE(choice_.TakeNewEpoch());
}

TEST_F(ServerChoiceTest, BeforeTheFirstGreetingThereIsNothingToCompare) {
  choice_.OnSent(Hello(), now_ms_);
  EXPECT_EQ(150, UntilMove());
  EXPECT_EQ(Hello(), Unanswered());
  choice_.OnReceived(Greeting(4), now_ms_);
  EXPECT_EQ(Bytes(), Inquiry());
  EXPECT_FALSE(choice_.TakeNewEpoch());
}

class OneServerTest : public ServerChoiceTest {
 protected:
  OneServerTest() : ServerChoiceTest(1) {}
};

TEST_F(OneServerTest, IsNeverLeft) {
  choice_.OnSent(Sense(1), now_ms_);
  choice_.OnRefused();
  EXPECT_EQ(-1, UntilMove());
}

}  // namespace
}  // namespace pheromone::client
