// The client's image for the Cortex-M3 works as a whole: start-up, interrupts, clock, both UARTs.
// It runs in real time, so the test waits for what has to come and never asks when; what comes too
// late for the robot, it asks for again.
#include <gtest/gtest.h>

#include <cstdint>

#include "proto_tests/qemu/hello_answer.h"
#include "proto_tests/qemu/qemu_machine.h"
#include "proto_tests/qemu/standing_pioneer.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::conformance {
namespace {

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
    const protocol::Message message = HelloAnswerTo(hello);
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
