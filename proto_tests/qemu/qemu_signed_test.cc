// The Cortex-M3's image of a robot that signs: its key and the count of its starts are in a file of
// QEMU's semihosting. A naive server signs by OpenSSL. In real time, as qemu_client_test.cc.
#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "client_fw/core/testing/naive_signer.h"
#include "proto_tests/qemu/hello_answer.h"
#include "proto_tests/qemu/qemu_machine.h"
#include "proto_tests/qemu/standing_pioneer.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"
#include "server/base/testing/temporary_folder.h"

namespace pheromone::conformance {
namespace {

using client::NaiveSigner;
using protocol::Message;

constexpr size_t kKeyAddress = 0x200;

// By the CRC's definition.
uint16_t CheckOf(const Bytes& bytes) {
  unsigned crc = 0;
  for (const uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 1u) != 0 ? (crc >> 1) ^ 0xA001u : crc >> 1;
    }
  }
  return static_cast<uint16_t>(~crc);
}

class QemuSigned : public ::testing::Test {
 protected:
  void StoreKey(uint16_t check) {
    Bytes eeprom(kKeyAddress, 0xFF);
    eeprom.insert(eeprom.end(), signer_.key.begin(), signer_.key.end());
    eeprom.push_back(static_cast<uint8_t>(check & 0xFF));
    eeprom.push_back(static_cast<uint8_t>(check >> 8));
    std::ofstream(folder_ / "eeprom.bin", std::ios::binary)
        .write(reinterpret_cast<const char*>(eeprom.data()),
               static_cast<std::streamsize>(eeprom.size()));
  }

  void SwitchOn() {
    machine_.emplace(PHEROMONE_QEMU, PHEROMONE_CORTEX_M_IMAGE, folder_.string());
    pioneer_.emplace(&*machine_);
    radio_.emplace(protocol::kNoGapTimeout);
  }

  // The next frame on the radio; the Pioneer lives meanwhile.
  Message NextFrame() {
    for (;;) {
      pioneer_->Listen();
      if (machine_->available(kRadio) == 0) {
        machine_->Move();
      } else if (radio_->Push(machine_->Receive(kRadio), 0)) {
        return radio_->message();
      }
    }
  }

  // The next one without its signature, which must be right.
  Message NextSigned() {
    Message message = NextFrame();
    EXPECT_TRUE(signer_.Open(&message)) << int{message.opcode};
    return message;
  }

  void Send(const Message& message) {
    Bytes wire(protocol::kMaxFrame);
    wire.resize(protocol::EncodeFrame(message, wire.data(), wire.size()));
    machine_->Send(kRadio, wire);
  }

  static Message AnswerTo(const Message& hello_frame) {
    protocol::HelloRequest hello;
    EXPECT_TRUE(protocol::Decode(hello_frame, &hello));
    return HelloAnswerTo(hello);
  }

  TemporaryFolder folder_;
  NaiveSigner signer_;
  std::optional<QemuMachine> machine_;
  std::optional<StandingPioneer> pioneer_;
  std::optional<protocol::FrameDecoder> radio_;
};

TEST_F(QemuSigned, SensesInASessionAndBelievesSignedAnswersOnly) {
  StoreKey(CheckOf(signer_.key));
  SwitchOn();
  int unsigned_answers = 0;
  protocol::SenseRequest sense;
  bool senses = false;
  for (int frames = 0; frames < 1000 && !senses; ++frames) {
    const Message request = NextSigned();
    senses = protocol::Decode(request, &sense);
    if (signer_.greets) {
      Send(signer_.Greeting(request.id));
    } else if (request.opcode == protocol::kHello && unsigned_answers < 2) {
      ++unsigned_answers;
      Send(AnswerTo(request));
    } else if (request.opcode == protocol::kHello) {
      Message answer = AnswerTo(request);
      signer_.Sign(&answer);
      Send(answer);
    }
  }
  EXPECT_EQ(unsigned_answers, 2) << "it took one, and asked no more";
  ASSERT_TRUE(senses);
  EXPECT_EQ(sense.type, 1);
}

TEST_F(QemuSigned, NoncesGoOnWhenItIsSwitchedOffAndOn) {
  StoreKey(CheckOf(signer_.key));
  for (const int nonce : {1, 2, 3, 4, 5, 6}) {
    SwitchOn();
    NextSigned();
    EXPECT_TRUE(signer_.greets);
    EXPECT_EQ(signer_.hellos.back(), 0);
    EXPECT_EQ(signer_.client_nonce, nonce);
  }
}

TEST_F(QemuSigned, WithoutAValidKeyNothingIsSigned) {
  for (const bool stored : {false, true}) {
    if (stored) {
      StoreKey(static_cast<uint16_t>(CheckOf(signer_.key) ^ 0x0100));
    }
    SwitchOn();
    const Message hello = NextFrame();
    EXPECT_EQ(hello.opcode, protocol::kHello);
    EXPECT_EQ(hello.length, 4);
  }
}

}  // namespace
}  // namespace pheromone::conformance
