#include "client_fw/core/requests/request_memory.h"

#include <gtest/gtest.h>

#include <cstring>

#include "client_fw/core/testing/conversation_harness.h"

namespace pheromone {
namespace client {
namespace {

TEST(RequestMemoryTest, SealedIsTrusted) {
  RequestMemory memory = {};
  memory.seq = 5;
  Seal(&memory);
  EXPECT_TRUE(Trusted(memory));
}

// What RAM may hold after power-up.
TEST(RequestMemoryTest, UniformMemoryIsNotTrusted) {
  for (const int byte : {0x00, 0xFF, 0x55, 0xAA}) {
    RequestMemory memory = {};
    std::memset(&memory, byte, sizeof(memory));
    memory.numbered = (byte & 1) != 0;  // a bool of its own kind
    EXPECT_FALSE(Trusted(memory)) << byte;
  }
}

TEST(RequestMemoryTest, EveryFlippedBitIsNoticed) {
  RequestMemory memory = {};
  memory.nonce = 0x1234;
  memory.opcode = 0x31;
  Seal(&memory);
  for (size_t bit = 0; bit < 8 * sizeof(memory); ++bit) {
    unsigned char bytes[sizeof(memory)];
    std::memcpy(bytes, &memory, sizeof(memory));
    bytes[bit / 8] = static_cast<unsigned char>(bytes[bit / 8] ^ (1u << bit % 8));
    RequestMemory damaged = {};
    std::memcpy(&damaged, bytes, sizeof(memory));
    EXPECT_FALSE(Trusted(damaged)) << bit;
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
