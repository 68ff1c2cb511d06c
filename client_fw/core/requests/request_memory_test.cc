#include "client_fw/core/requests/request_memory.h"

#include <gtest/gtest.h>

#include <cstring>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

RequestMemory Sealed() {
  RequestMemory memory = {};
  memory.nonce = 0x1234;
  memory.seq = 5;
  memory.opcode = 0x31;
  Seal(&memory);
  return memory;
}

void FlipBit(size_t bit, void* bytes) {
  auto* const byte = static_cast<unsigned char*>(bytes) + bit / 8;
  *byte = static_cast<unsigned char>(*byte ^ (1u << bit % 8));
}

TEST(RequestMemoryTest, SealedIsTrusted) {
  RequestMemory memory = Sealed();
  EXPECT_TRUE(Trusted(memory));
  EXPECT_TRUE(Restore(&memory));
  EXPECT_EQ(5, memory.seq);
}

// What RAM may hold after power-up.
TEST(RequestMemoryTest, UniformMemoryIsNotTrusted) {
  for (const int byte : {0x00, 0xFF, 0x55, 0xAA}) {
    RequestMemory memory = {};
    std::memset(&memory, byte, sizeof(memory));
    EXPECT_FALSE(Restore(&memory)) << byte;
  }
}

TEST(RequestMemoryTest, EveryFlippedBitIsNoticed) {
  for (size_t bit = 0; bit < 8 * sizeof(RequestValues); ++bit) {
    RequestMemory memory = Sealed();
    FlipBit(bit, &memory);
    EXPECT_FALSE(Trusted(memory)) << bit;
    FlipBit(bit, &memory.sealed);
    EXPECT_FALSE(Restore(&memory)) << bit;
  }
  for (size_t bit = 0; bit < 16; ++bit) {
    RequestMemory memory = Sealed();
    FlipBit(bit, &memory.crc);
    EXPECT_FALSE(Restore(&memory)) << bit;
  }
}

TEST(RequestMemoryTest, AResetInTheMiddleOfAChangeGoesBackToTheSeal) {
  RequestMemory memory = Sealed();
  memory.seq = 6;
  memory.opcode = 0;
  EXPECT_FALSE(Trusted(memory));
  EXPECT_TRUE(Restore(&memory));
  EXPECT_TRUE(Trusted(memory));
  EXPECT_EQ(5, memory.seq);
  EXPECT_EQ(0x31, memory.opcode);
}

TEST(RequestMemoryTest, AResetInTheMiddleOfASealLosesNothing) {
  const RequestMemory before = Sealed();
  RequestMemory after = before;
  after.seq = 6;
  Seal(&after);
  for (size_t copied = 0; copied <= sizeof(RequestValues); ++copied) {
    RequestMemory memory = after;
    std::memcpy(&memory.sealed, &before.sealed, sizeof(RequestValues));
    std::memcpy(&memory.sealed, &after.sealed, copied);
    EXPECT_TRUE(Restore(&memory)) << copied;
    EXPECT_EQ(6, memory.seq) << copied;
    Seal(&memory);
    memory.seq = 7;  // the next change
    EXPECT_TRUE(Restore(&memory)) << copied;
    EXPECT_EQ(6, memory.seq) << copied;
  }
}

// A reset may come at any time: what has been sent or heard is under the seal.
TEST(RequestMemoryTest, IsSealedWheneverAFrameLeavesOrHasCome) {
  Parameters parameters = TestParameters();
  parameters.lay_trail = true;
  Harness harness(parameters);
  harness.Greet();
  EXPECT_TRUE(Trusted(harness.memory));
  for (int i = 0; i < 30; ++i) {
    ASSERT_TRUE(harness.RunUntilSent());
    EXPECT_TRUE(Trusted(harness.memory));
    if (harness.sent.opcode == protocol::kHello) {
      harness.AnswerHello();
    } else if (harness.sent.opcode == protocol::kEvent) {
      harness.AnswerEvent();
    } else if (i % 3 == 0) {
      harness.Answer(0, 0);
    } else if (i % 7 == 0) {
      const bool is_trace = protocol::ServiceOf(harness.sent.opcode) == protocol::kTrace;
      harness.AnswerError(protocol::Reason::kBusy, is_trace ? harness.SentTrace().seq : 0);
    }
    EXPECT_TRUE(Trusted(harness.memory));
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
