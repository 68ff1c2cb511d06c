// Signed frames on an ATmega1284P against a naive server with OpenSSL, and what they cost there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <string>
#include <vector>

#include "client_fw/core/testing/naive_signer.h"
#include "proto_tests/avr_core/avr_core.h"
#include "proto_tests/avr_core/signing_turn.h"
#include "protocol/frame.h"
#include "protocol/opcodes.h"

namespace pheromone::core_boundary {
namespace {

using client::NaiveSigner;
using protocol::Message;
using Octets = std::vector<uint8_t>;

constexpr uint8_t kId = 7;
constexpr double kCyclesAMicrosecond = 16;

Message MessageOf(uint8_t id, uint8_t opcode, const Octets& data) {
  Message message;
  message.id = id;
  message.opcode = opcode;
  NaiveSigner::Add(&message, data);
  return message;
}

class AvrSigningTest : public ::testing::Test {
 protected:
  // The result; how many cycles it took is in `cycles_`.
  Octets Run(SigningCommand command, const Message& message, uint16_t number = 0) {
    Octets request = {static_cast<uint8_t>(command), static_cast<uint8_t>(number),
                      static_cast<uint8_t>(number >> 8), message.id, message.opcode};
    request.insert(request.end(), message.data, message.data + message.length);
    const Octets reply = avr_.Run(request);
    cycles_ = kCyclesATick * (reply.at(0) + 256 * reply.at(1));
    EXPECT_LE(cycles_, 2000 * kCyclesAMicrosecond) << static_cast<char>(command);
    return {reply.begin() + 2, reply.end()};
  }

  // As the loop does, a piece in each pass; and it waits for one.
  void Derive(const std::string& what) {
    int longest = 0;
    while (Run(kDerive, {}) == Octets{1}) {
      longest = std::max(longest, cycles_);
    }
    cycles_ = longest;
    Tell(what);
  }

  void Tell(const std::string& what) const {
    std::cout << "  " << what << ": " << cycles_ << " cycles, " << cycles_ / kCyclesAMicrosecond
              << " us\n";
  }

  NaiveSigner server_;
  int cycles_ = 0;

 private:
  AvrCore avr_{PHEROMONE_AVR_SIGNING_IMAGE};
};

TEST_F(AvrSigningTest, ASessionFitsAndNoCallTakesMoreThanTwoMilliseconds) {
  Message hello = MessageOf(kId, protocol::kHello, {0x34, 0x12, 1, 5});
  NaiveSigner::Add(&hello, Run(kSignHello, hello, 0xABCD));
  Tell("HELLO signed");
  Derive("the longest piece of making room for the group's key");
  ASSERT_TRUE(server_.Open(&hello));
  ASSERT_EQ(Octets{1}, Run(kTakeAnswer, server_.Greeting(kId)));
  Tell("HELLO's answer taken");
  Derive("the longest piece of deriving the keys");

  const Octets pose = {1, 2, 3, 4, 5, 6};
  for (int i = 0; i < 300; ++i) {
    Message sense = MessageOf(kId, protocol::kSense | 1, pose);
    NaiveSigner::Add(&sense, Run(kSign, sense));
    ASSERT_TRUE(server_.Open(&sense)) << i;
  }
  Tell("SENSE signed");
  for (int i = 0; i < 300; ++i) {
    Message intensities = MessageOf(kId, protocol::kFromServer | 1, {1, 0, 2, 0});
    server_.Sign(&intensities);
    ASSERT_EQ(Octets{5}, Run(kVerify, intensities)) << i;
    ASSERT_EQ(Octets{255}, Run(kVerify, intensities)) << "replayed";
  }
  Tell("its answer verified");

  // Ten answers and ten turns, of which the first may be taken until 3 ms after the ROUND.
  Message round = MessageOf(protocol::kBroadcastId, protocol::kRound, Octets(56, 9));
  server_.Sign(&round);
  ASSERT_EQ(Octets{6}, Run(kVerify, round));
  Tell("the longest ROUND verified");

  // The session is still there afterwards, also after an answer that somebody else has made.
  Message again = MessageOf(kId, protocol::kHello, {0x34, 0x12, 1, 5});
  NaiveSigner::Add(&again, Run(kSignHello, again, 0xABCE));
  Tell("HELLO signed in a session");
  ASSERT_TRUE(server_.Open(&again));
  Derive("the longest piece of restoring the session");
  Message forged = server_.Greeting(kId);
  forged.data[forged.length - 1] ^= 1u;
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(Octets{0}, Run(kTakeAnswer, forged));
    Tell("a forged answer refused");
  }
  Derive("the longest piece of restoring the session");
  round = MessageOf(protocol::kBroadcastId, protocol::kRound, Octets(56, 9));
  server_.Sign(&round);
  ASSERT_EQ(Octets{6}, Run(kVerify, round));
}

}  // namespace
}  // namespace pheromone::core_boundary
