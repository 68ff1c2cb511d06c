#include "client_fw/swarm/server_station.h"

#include <gtest/gtest.h>

#include <vector>

#include "client_fw/swarm/path_experiment.h"
#include "protocol/messages.h"
#include "server/core/engine/service/ordered_log.h"

namespace pheromone::swarm {
namespace {

using protocol::Message;

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kByte = 1'041'666;
constexpr uint8_t kWindowMs = 9;  // 2 T_t + D_s + 2 B, rounded up
constexpr int64_t kWindow = kWindowMs * kMs;

// A client that speaks when the test says so, and notes what it hears of the server.
struct Client : sim::Station {
  struct Heard {
    int64_t first_bit_ns;
    int64_t end_ns;
    Message message;
  };

  void OnByte(uint8_t byte, int64_t time_ns) override {
    if (begin_ns < 0) {
      begin_ns = time_ns - kByte;
    }
    if (decoder.Push(byte, static_cast<uint32_t>(time_ns / kMs))) {
      if (protocol::IsFromServer(decoder.message().opcode)) {
        heard.push_back({begin_ns, time_ns, decoder.message()});
      }
      begin_ns = -1;
    }
  }
  void OnTransmitted(int64_t time_ns) override { sent_ns = time_ns; }

  protocol::FrameDecoder decoder{20};
  std::vector<Heard> heard;
  int64_t begin_ns = -1;
  int64_t sent_ns = 0;
};

class ServerStationTest : public testing::Test {
 protected:
  explicit ServerStationTest(uint8_t window_ms = kWindowMs, int64_t delay_ns = 2 * kMs)
      : server_(&service_, 0, {"radio-a", 2, window_ms}, &medium_, {.delay_ns = delay_ns}) {
    const engine::EngineConfig config = EngineConfigOf(PathExperiment{});
    EXPECT_TRUE(service_.Configure(config, 1).ok());
    a_ = medium_.AddStation(&client_);
    b_ = medium_.AddStation(&other_);
  }

  void RunTo(int64_t ms) {
    for (int64_t at = medium_.now_ns() / kMs + 1; at <= ms; ++at) {
      server_.AdvanceTo(at * kMs);
    }
  }

  void Send(int station, const Message& message) {
    std::vector<uint8_t> frame(protocol::kMaxFrame);
    frame.resize(protocol::EncodeFrame(message, frame.data(), frame.size()));
    medium_.Transmit(station, frame);
  }

  static Message Sense(uint8_t id, uint8_t type = 2) {
    protocol::SenseRequest sense;
    sense.id = id;
    sense.type = type;
    sense.pose = {1500, 2250, 0};
    Message message;
    Encode(sense, &message);
    return message;
  }

  static engine::Outgoing Halt(uint8_t id) {
    protocol::Command command;
    command.id = id;
    command.seq = 1;
    command.code = protocol::CommandCode::kHalt;
    engine::Outgoing outgoing;
    Encode(command, &outgoing.message);
    return outgoing;
  }

  engine::VolatileLog log_;
  sim::RadioMedium medium_{sim::RadioConfig{}};
  engine::Service service_{
      &log_, [this] {
        return engine::ClockReading{static_cast<uint64_t>(medium_.now_ns() / kMs), 0};
      }};
  ServerStation server_;
  Client client_;
  Client other_;
  int a_ = 0;
  int b_ = 0;
};

TEST_F(ServerStationTest, AnswerBeginsAfterTheGapAndWithinTheWindow) {
  Send(a_, Sense(1));
  RunTo(100);
  ASSERT_EQ(1u, client_.heard.size());
  EXPECT_EQ(0x82, client_.heard[0].message.opcode);
  const int64_t gap_ns = client_.heard[0].first_bit_ns - client_.sent_ns;
  EXPECT_GE(gap_ns, 2 * kMs + kByte);
  EXPECT_LE(gap_ns, kWindow);
}

class SlowServer : public ServerStationTest {
 protected:
  SlowServer() : ServerStationTest(kWindowMs + 3, 5 * kMs) {}
};

// Another station sends right after the request, so that the server cannot answer in time.
TEST_F(SlowServer, AnswerThatCannotStartWithinTheWindowIsNotSent) {
  Send(a_, Sense(1));
  RunTo(17);  // the request ends at 16.6 ms
  Send(b_, Sense(2));
  RunTo(34);
  EXPECT_EQ(1u, server_.counters().late_answers);
  RunTo(200);
  ASSERT_EQ(1u, other_.heard.size());
  EXPECT_EQ(2, other_.heard[0].message.id);
  ASSERT_EQ(1u, client_.heard.size());
  EXPECT_EQ(2, client_.heard[0].message.id);
}

TEST_F(ServerStationTest, CommandRidesOnTheAnswerToTheSameClient) {
  Send(a_, Sense(1));
  RunTo(17);
  server_.Queue(Halt(1));
  RunTo(100);
  ASSERT_EQ(2u, client_.heard.size());
  EXPECT_EQ(0x82, client_.heard[0].message.opcode);
  EXPECT_EQ(protocol::kCommand, client_.heard[1].message.opcode);
  EXPECT_NEAR(static_cast<double>(client_.heard[0].end_ns),
              static_cast<double>(client_.heard[1].first_bit_ns), 2);  // no gap
}

TEST_F(ServerStationTest, CommandToAnotherClientWaitsForTheAnswer) {
  Send(a_, Sense(1));
  RunTo(17);
  server_.Queue(Halt(7));
  RunTo(100);
  ASSERT_EQ(2u, client_.heard.size());
  EXPECT_EQ(0x82, client_.heard[0].message.opcode);
  EXPECT_EQ(7, client_.heard[1].message.id);
  EXPECT_GT(client_.heard[1].first_bit_ns, client_.heard[0].end_ns);
}

TEST_F(ServerStationTest, CommandWaitsForAFreeChannelAndForTheLastOnesAcknowledgement) {
  Send(b_, Sense(2));
  RunTo(10);
  server_.Queue(Halt(1));
  server_.Queue(Halt(3));
  RunTo(200);
  ASSERT_EQ(3u, client_.heard.size());
  EXPECT_EQ(0x82, client_.heard[0].message.opcode);
  EXPECT_EQ(1, client_.heard[1].message.id);
  EXPECT_EQ(3, client_.heard[2].message.id);
  EXPECT_GE(client_.heard[2].first_bit_ns - client_.heard[1].end_ns, kWindow - 10);  // rounding
}

TEST_F(ServerStationTest, RepeatedCommandTakesThePlaceOfOneThatHasNotLeft) {
  Send(b_, Sense(2));
  RunTo(5);
  server_.Queue(Halt(1));
  server_.Queue(Halt(1));
  RunTo(200);
  ASSERT_EQ(2u, client_.heard.size());
  EXPECT_EQ(0x82, client_.heard[0].message.opcode);
  EXPECT_EQ(protocol::kCommand, client_.heard[1].message.opcode);
}

class WideWindow : public ServerStationTest {
 protected:
  WideWindow() : ServerStationTest(50) {}
};

TEST_F(WideWindow, HoldsOneErrorAtMost) {
  Send(a_, Sense(1, 9));  // no such pheromone
  Send(a_, Sense(1, 9));  // directly behind
  RunTo(60);
  EXPECT_EQ(1u, server_.counters().withheld_errors);
  EXPECT_EQ(1u, client_.heard.size());
  RunTo(100);
  Send(a_, Sense(1, 9));
  RunTo(200);
  EXPECT_EQ(1u, server_.counters().withheld_errors);
  ASSERT_EQ(2u, client_.heard.size());
  EXPECT_EQ(protocol::kError, client_.heard[1].message.opcode);
}

}  // namespace
}  // namespace pheromone::swarm
