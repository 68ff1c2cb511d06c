// The client's image for the Cortex-M3 works as a whole: start-up, interrupts, clock, both UARTs.
// It runs in real time, so the test waits for what has to come and never asks when; what comes too
// late for the robot, it asks for again.
#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "proto_tests/qemu/qemu_machine.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::conformance {
namespace {

using Bytes = std::vector<uint8_t>;

constexpr size_t kRadio = 0;
constexpr size_t kRobot = 1;

// A frame of ARCOS: client_fw/core/pioneer/pioneer_packet.h.
Bytes Packet(const Bytes& body) {
  Bytes packet;
  packet.reserve(body.size() + 5);
  for (const int byte : {0xFA, 0xFB, static_cast<int>(body.size() + 2)}) {
    packet.push_back(static_cast<uint8_t>(byte));
  }
  for (const uint8_t byte : body) {
    packet.push_back(byte);
  }
  unsigned sum = 0;
  for (size_t i = 0; i + 1 < body.size(); i += 2) {
    sum += static_cast<unsigned>(body[i] << 8 | body[i + 1]);
  }
  if (body.size() % 2 != 0) {
    sum ^= body.back();
  }
  packet.push_back(static_cast<uint8_t>(sum >> 8 & 0xFF));
  packet.push_back(static_cast<uint8_t>(sum & 0xFF));
  return packet;
}

// A Pioneer that stands at some X: greets as it should, and reports after each command.
class StandingPioneer {
 public:
  explicit StandingPioneer(QemuMachine* machine) : machine_(machine) {}

  void Listen() {
    while (machine_->available(kRobot) != 0) {
      heard_.push_back(machine_->Receive(kRobot));
      TakeCommand();
    }
  }

  std::vector<Bytes> commands;
  uint16_t x = 0;

 private:
  // A robot that was reset (its watchdog runs in real time) leaves half a command behind.
  void TakeCommand() {
    while (heard_.size() >= 6) {
      const size_t size = heard_[2] + 3u;
      const bool begins = heard_[0] == 0xFA && heard_[1] == 0xFB && size >= 6 && size <= 200;
      if (begins && heard_.size() < size) {
        return;
      }
      const auto begin = heard_.begin();
      if (begins && Packet(Bytes(begin + 3, begin + heard_[2] + 1)) ==
                        Bytes(begin, begin + static_cast<std::ptrdiff_t>(size))) {
        commands.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(size));
        heard_.erase(begin, begin + static_cast<std::ptrdiff_t>(size));
        Obey(commands.back());
      } else {
        heard_.erase(begin);
      }
    }
  }

  void Obey(const Bytes& command) {
    const uint8_t number = command[3];
    if (number == 2 && phase_ != kOpen) {
      const std::string names("Robot\0Pioneer\0p3dx-sh\0", 22);
      Bytes body = {2};
      body.insert(body.end(), names.begin(), names.end());
      machine_->Send(kRobot, Packet(body));
      phase_ = kGreeted;
    } else if (number <= 2 && (phase_ == kClosed || number != 1)) {
      phase_ = kClosed;  // SYNC0, SYNC1, or CLOSE
      machine_->Send(kRobot, command);
    } else {
      phase_ = kOpen;
      machine_->Send(kRobot, Packet({0x32,
                                     static_cast<uint8_t>(x & 0xFF),
                                     static_cast<uint8_t>(x >> 8),
                                     0,
                                     0,
                                     0,
                                     0,
                                     0,
                                     0,
                                     0,
                                     0,
                                     120,
                                     0,
                                     0,
                                     0,
                                     0,
                                     1,
                                     0,
                                     0,
                                     0}));
    }
  }

  enum Phase { kClosed, kGreeted, kOpen };
  QemuMachine* machine_;
  Bytes heard_;
  Phase phase_ = kClosed;
};

class QemuClient : public ::testing::Test {
 protected:
  // The next frame on the radio; the Pioneer lives meanwhile.
  protocol::Message NextRequest() {
    for (;;) {
      pioneer_.Listen();
      if (machine_.available(kRadio) == 0) {
        machine_.Move();
      } else if (radio_.Push(machine_.Receive(kRadio), 0)) {
        return radio_.message();
      }
    }
  }

  void AnswerHello(const protocol::HelloRequest& hello) {
    protocol::HelloAnswer answer;
    answer.id = hello.id;
    answer.nonce = hello.nonce;
    answer.protocol_version = protocol::kProtocolVersion;
    answer.epoch = 7;
    answer.pose_unit_10um = 100;  // 1 mm
    answer.type_mask = 1u << 1;
    answer.slot_ms = 2;
    answer.response_window_ms = 250;
    protocol::Message message;
    protocol::Encode(answer, &message);
    Bytes wire(protocol::kMaxFrame);
    wire.resize(protocol::EncodeFrame(message, wire.data(), wire.size()));
    machine_.Send(kRadio, wire);
  }

  QemuMachine machine_{PHEROMONE_QEMU, PHEROMONE_CORTEX_M_IMAGE};
  StandingPioneer pioneer_{&machine_};
  protocol::FrameDecoder radio_{protocol::kNoGapTimeout};
};

TEST_F(QemuClient, SaysHelloOnTheRadioUntilItIsAnswered) {
  protocol::HelloRequest first;
  protocol::HelloRequest second;
  ASSERT_TRUE(protocol::Decode(NextRequest(), &first));
  ASSERT_TRUE(protocol::Decode(NextRequest(), &second));
  EXPECT_EQ(first.id, 1);
  EXPECT_EQ(first.nonce, second.nonce) << "it was reset in between";
}

TEST_F(QemuClient, OpensItsPioneerAndSensesWhereTheOdometrySaysThatItIs) {
  pioneer_.x = 500;
  protocol::SenseRequest sense;
  for (int requests = 0; requests < 1000 && sense.pose.x == 0; ++requests) {
    const protocol::Message request = NextRequest();
    protocol::HelloRequest hello;
    if (protocol::Decode(request, &hello)) {
      AnswerHello(hello);
    } else if (protocol::Decode(request, &sense)) {
      pioneer_.x = 500 + 1234;
    }
  }
  // It began where the first report was; a p3dx-sh counts millimetres.
  EXPECT_EQ(sense.pose.x, 1234);
  EXPECT_EQ(sense.pose.y, 0);
  EXPECT_EQ(sense.type, 1);

  ASSERT_GE(pioneer_.commands.size(), 4u);
  EXPECT_EQ(pioneer_.commands[0], Bytes({0xFA, 0xFB, 0x03, 0x00, 0x00, 0x00}));  // arcos: SYNC0
}

}  // namespace
}  // namespace pheromone::conformance
