#include "client_fw/experiments/trails/ledger.h"

#include <gtest/gtest.h>

#include <vector>

#include "protocol/byte_order.h"
#include "protocol/frame.h"
#include "protocol/signing.h"
#include "protocol/tag_messages.h"

namespace pheromone::swarm {
namespace {

using protocol::NetAction;
using protocol::NetOutcome;

constexpr uint32_t kHash = 0x12345678;

template <typename Record>
void PutRecord(const Record& record, int32_t* words) {
  uint8_t statement[protocol::kNetStatementSize];
  Encode(record, statement);
  for (size_t i = 0; i < protocol::kStatementWords; ++i) {
    words[i] = protocol::GetI32(statement + 4 * i);
  }
}

// What a robot and the server say on a channel.
class Talk {
 public:
  explicit Talk(bool is_signed = false)
      : ledger(2),
        tally_([this](const NetTold& told) { ledger.Add(told); }, is_signed),
        is_signed_(is_signed) {}

  void Name(uint8_t id, int32_t number) {
    protocol::Message message;
    Encode(protocol::SymbolAnswer{id, 1, protocol::SymbolKind::kRobot, number}, &message);
    Hear(message);
  }
  void Write(uint8_t id, uint8_t seq, NetAction action, uint16_t amount = 0) {
    protocol::TagWriteRequest write;
    write.id = id;
    write.tag = 7;
    PutRecord(protocol::RobotRecord{kHash, seq, action, 1, amount, 0}, write.words);
    protocol::Message message;
    Encode(write, &message);
    Hear(message);
  }
  void Read(uint8_t id, int32_t number, uint8_t seq, NetOutcome outcome, uint16_t amount = 0) {
    protocol::TagReadAnswer read;
    read.id = id;
    read.tag = 7;
    read.slot = protocol::kEnvironmentSlot;
    PutRecord(protocol::EnvironmentRecord{kHash, 0, outcome, number, seq, amount, 0},
              read.words + protocol::kWordSubjectNamespace);
    protocol::Message message;
    Encode(read, &message);
    Hear(message);
  }
  void Do(uint8_t id, int32_t number, uint8_t seq, NetAction action, uint16_t amount = 0) {
    Write(id, seq, action, amount);
    Read(id, number, seq, NetOutcome::kAccepted, amount);
  }

  TrailsLedger ledger;
  int64_t now_ms = 0;

 private:
  void Hear(protocol::Message message) {
    if (!is_signed_) {
      tally_.Hear(message, now_ms);
      return;
    }
    for (int i = 0; i < protocol::kSignature; ++i) {
      message.data[message.length++] = 0xA5;
    }
    uint8_t frame[protocol::kMaxFrame];
    const size_t size = protocol::EncodeFrame(message, frame, sizeof frame);
    for (size_t i = 0; i < size; ++i) {
      tally_.OnByte(frame[i], now_ms * 1'000'000);
    }
  }

  NetTally tally_;
  bool is_signed_;
};

TEST(TrailsLedgerTest, ARoundTripIsChoiceDepositAndHome) {
  Talk talk;
  talk.Name(1, 15);
  talk.now_ms = 100;
  talk.Do(1, 15, 1, NetAction::kChooseB);
  EXPECT_EQ(talk.ledger.robots_on(BenchTrail::kB), 1);
  talk.Do(1, 15, 2, NetAction::kLeave);
  talk.Do(1, 15, 3, NetAction::kTake, 60);
  talk.now_ms = 500;
  talk.Do(1, 15, 4, NetAction::kStoreB, 44);
  EXPECT_EQ(talk.ledger.robots_on(BenchTrail::kB), 0);
  EXPECT_EQ(talk.ledger.trips(), 0u);
  talk.now_ms = 600;
  talk.Do(1, 15, 5, NetAction::kLeave);
  EXPECT_EQ(talk.ledger.trips(), 1u);
  ASSERT_EQ(talk.ledger.deposits().size(), 1u);
  EXPECT_EQ(talk.ledger.deposits()[0], (TrailsTrip{.robot = 0,
                                                   .trail = BenchTrail::kB,
                                                   .chosen_ms = 100,
                                                   .stored_ms = 500,
                                                   .home_ms = 600,
                                                   .amount = 44}));
  EXPECT_EQ(talk.ledger.taken(), 60u);
  EXPECT_EQ(talk.ledger.deposited(), 44u);
}

TEST(TrailsLedgerTest, SignedFramesCountLikeOthers) {
  Talk talk(/*is_signed=*/true);
  talk.Name(1, 15);
  talk.now_ms = 100;
  talk.Do(1, 15, 1, NetAction::kChooseB);
  EXPECT_EQ(talk.ledger.robots_on(BenchTrail::kB), 1);
  talk.now_ms = 500;
  talk.Do(1, 15, 2, NetAction::kStoreB, 44);
  ASSERT_EQ(talk.ledger.deposits().size(), 1u);
  EXPECT_EQ(talk.ledger.deposits()[0].stored_ms, 500);
}

TEST(TrailsLedgerTest, AnOutcomeCountsOnceAndForItsRobotOnly) {
  Talk talk;
  talk.Name(1, 15);
  talk.Name(2, 16);
  talk.Write(1, 4, NetAction::kStoreA, 10);
  talk.Read(1, 15, 3, NetOutcome::kAccepted);  // of the record before
  talk.Read(1, 16, 4, NetOutcome::kAccepted);  // another robot's
  talk.Read(2, 15, 4, NetOutcome::kAccepted);  // read by one that has written nothing
  talk.Read(1, 15, 4, NetOutcome::kNone);
  EXPECT_TRUE(talk.ledger.deposits().empty());
  talk.Read(1, 15, 4, NetOutcome::kAccepted);
  talk.Read(1, 15, 4, NetOutcome::kAccepted);
  talk.Write(1, 4, NetAction::kStoreA, 10);  // repeated, as its answer was lost
  talk.Read(1, 15, 4, NetOutcome::kAccepted);
  EXPECT_EQ(talk.ledger.deposits().size(), 1u);
}

TEST(TrailsLedgerTest, ARefusalIsCountedAndChangesNothing) {
  Talk talk;
  talk.Write(2, 9, NetAction::kChooseA);
  talk.Read(2, 16, 9, NetOutcome::kRefused);
  EXPECT_EQ(talk.ledger.refusals(), 1u);
  EXPECT_TRUE(talk.ledger.choices().empty());
  EXPECT_EQ(talk.ledger.robots_on(BenchTrail::kA), 0);
}

}  // namespace
}  // namespace pheromone::swarm
