// A whole robot, and two servers of one cluster that die without a word, or stand still and go on
// with what has come meanwhile, in virtual time: whenever that is, the robot drives on, and no
// change is lost or made twice.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <deque>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/boards/host/server_choice.h"
#include "client_fw/boards/host/testing/server_frames.h"
#include "client_fw/core/conversation_state.h"
#include "client_fw/core/robot.h"

namespace pheromone::client {
namespace {

constexpr uint16_t kFailSafeMs = 400;  // pheromone-robot's default
constexpr int64_t kDelayMs = 2;        // of the network, each way
constexpr int64_t kElectionMs = 1600;  // the cluster has no leader for so long, and takes no change

struct StandingDrive {
  bool odometry(Odometry* to) {
    *to = Odometry{0, 0, 0};
    return true;
  }
  void set_wheel_speeds(int16_t /*left*/, int16_t /*right*/) {}
  void emergency_stop() {}
  const DriveStatus& status() const { return reported; }

  DriveStatus reported = kNothingToTell;
};

class World {
 public:
  explicit World(bool lays_trail)
      : choice_(2, kTestId), robot_(&board_, &drive_, ParametersOf(lays_trail), &memory_) {}

  static Parameters ParametersOf(bool lays_trail) {
    Parameters parameters;
    parameters.id = kTestId;
    parameters.boot_counter = kTestNonce;
    parameters.start_released = true;
    parameters.lay_trail = lays_trail;
    parameters.buffered_link = true;
    parameters.rounds = false;
    parameters.gap_timeout_ms = protocol::kNoGapTimeout;
    parameters.fail_safe_ms = kFailSafeMs;
    return parameters;
  }

  void Run(int64_t ms) {
    for (const int64_t end_ms = now_ms + ms; now_ms < end_ms;) {
      ++now_ms;
      Deliver();
      if (choice_.Move(now_ms)) {
        ++socket_;
        Send(Bytes(choice_.unanswered().begin(), choice_.unanswered().end()));
      }
      const auto inquiry = choice_.TakeInquiry(now_ms);
      Send(Bytes(inquiry.begin(), inquiry.end()));
      if (choice_.TakeNewEpoch()) {
        robot_.GreetAgain();
      }
      board_.OnTransmitted();
      board_.set_millis(static_cast<Moment>(now_ms));
      robot_.Step();
      std::array<uint8_t, kMaxClientFrame> frame{};
      const size_t size = board_.TakeTransmission(frame.data(), frame.size());
      if (size != 0) {
        choice_.OnSent({frame.data(), size}, now_ms);
        Send(Bytes(frame.begin(), frame.begin() + static_cast<ptrdiff_t>(size)));
      }
      LookForAnswers();
    }
  }

  int64_t now_ms = 0;
  std::array<bool, 2> is_still{};  // and does not read what it receives
  int64_t log_is_back_ms = 0;
  int64_t longest_silence_ms = 0;
  std::vector<uint8_t> executed;  // in this order
  const Conversation& conversation() const { return robot_.conversation(); }
  const ServerChoice& choice() const { return choice_; }

 private:
  struct Datagram {
    int64_t at_ms;
    bool to_robot;
    size_t server;
    int socket;  // the robot's
    Bytes bytes;
  };

  void Send(const Bytes& bytes) {
    if (!bytes.empty()) {
      under_way_.push_back({now_ms + kDelayMs, false, choice_.server(), socket_, bytes});
    }
  }

  void Deliver() {
    if (under_way_.empty()) {
      return;
    }
    std::deque<Datagram> later;
    for (; !under_way_.empty(); under_way_.pop_front()) {
      const Datagram& datagram = under_way_.front();
      if (datagram.at_ms > now_ms || (!datagram.to_robot && is_still[datagram.server])) {
        later.push_back(datagram);
      } else if (!datagram.to_robot) {
        const Bytes answer = Serve(datagram.bytes);
        if (!answer.empty()) {
          later.push_back({now_ms + kDelayMs, true, datagram.server, datagram.socket, answer});
        }
      } else if (datagram.socket == socket_) {
        choice_.OnReceived(datagram.bytes, now_ms);
        board_.Receive(datagram.bytes.data(), datagram.bytes.size());
      }
    }
    under_way_ = std::move(later);
  }

  // Both servers know what either has done.
  Bytes Serve(const Bytes& frame) {
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    protocol::Message request;
    decoder.PushBlock(frame.data(), frame.size(), 0,
                      [&](const protocol::Message& message) { request = message; });
    protocol::TraceRequest trace;
    protocol::SenseRequest sense;
    if (request.opcode == protocol::kPing) {
      request.opcode = protocol::kPingAnswer;
      return FrameOf(request);
    }
    if (Decode(request, &sense)) {
      return Sensed();
    }
    if (now_ms < log_is_back_ms) {
      return {};
    }
    if (Decode(request, &trace)) {
      const auto ahead = static_cast<uint8_t>(trace.seq - last_seq_);  // section 7
      if (ahead > 128) {
        return {};
      }
      if (ahead != 0) {
        executed.push_back(trace.seq);
        last_seq_ = trace.seq;
      }
      return Traced(trace.seq);
    }
    protocol::HelloAnswer greeting = GreetingOf(kTestId, kTestNonce, 3);
    greeting.slot_ms = 1;
    greeting.response_window_ms = 100;
    greeting.last_seq = last_seq_;
    protocol::HelloRequest hello;
    EXPECT_TRUE(Decode(request, &hello)) << "opcode " << int{request.opcode};
    return FrameOf(greeting);
  }

  void LookForAnswers() {
    const unsigned answers = robot_.conversation().counters().answers;
    if (answers != answers_ && answers_ != 0) {
      longest_silence_ms = std::max(longest_silence_ms, now_ms - answered_ms_);
    }
    if (answers != answers_) {
      answers_ = answers;
      answered_ms_ = now_ms;
    }
  }

  HostBoard board_;
  StandingDrive drive_;
  RequestMemory memory_{};
  ServerChoice choice_;
  Robot<HostBoard, StandingDrive> robot_;
  std::deque<Datagram> under_way_;
  int socket_ = 0;
  uint8_t last_seq_ = 0;
  unsigned answers_ = 0;
  int64_t answered_ms_ = 0;
};

// One after the other, and none twice.
bool EachOnce(const std::vector<uint8_t>& executed) {
  for (size_t i = 0; i < executed.size(); ++i) {
    if (executed[i] != static_cast<uint8_t>(i + 1)) {
      return false;
    }
  }
  return true;
}

class ServerChangeTest : public testing::TestWithParam<bool> {};

TEST_P(ServerChangeTest, RobotDrivesOnWheneverItsServerDies) {
  int64_t longest_ms = 0;
  for (const bool leader : {false, true}) {
    for (int phase_ms = 0; phase_ms < 420; phase_ms += 3) {
      World world(GetParam());
      world.Run(3000 + phase_ms);
      world.is_still[0] = true;
      world.log_is_back_ms = leader ? world.now_ms + kElectionMs : 0;
      world.Run(5000);
      SCOPED_TRACE("leader " + std::to_string(static_cast<int>(leader)) + ", phase " +
                   std::to_string(phase_ms));
      ASSERT_EQ(1u, world.choice().server());
      ASSERT_EQ(0u, world.conversation().counters().fail_safe_stops);
      ASSERT_EQ(1u, world.conversation().counters().hellos);  // none before it could drive on
      longest_ms = std::max(longest_ms, world.longest_silence_ms);
      ASSERT_TRUE(EachOnce(world.executed));
      ASSERT_EQ(world.executed.empty(), !GetParam());
    }
  }
  std::printf("longest time without an answer: %lld ms\n", static_cast<long long>(longest_ms));
  EXPECT_LT(longest_ms, kFailSafeMs);
}

TEST_P(ServerChangeTest, EachChangeIsMadeOnceWhicheverServersStandStillAndGoOn) {
  std::minstd_rand random(33);
  const auto from_to = [&random](int64_t from, int64_t to) {
    return from + static_cast<int64_t>(random() % static_cast<uint64_t>(to - from));
  };
  for (int life = 0; life < 30; ++life) {
    World world(GetParam());
    world.Run(from_to(1000, 1500));
    size_t taken_away = 0;
    for (int outage = 0; outage < 10; ++outage) {
      const size_t server = random() % 2;
      taken_away += world.choice().server() == server ? 1u : 0u;
      world.is_still[server] = true;
      world.log_is_back_ms = world.now_ms + from_to(0, kElectionMs);
      world.Run(from_to(1000, 3000));
      world.is_still[server] = false;
      world.Run(from_to(1500, 3000));
    }
    ASSERT_GT(taken_away, 0u);
    ASSERT_TRUE(EachOnce(world.executed)) << life;
    ASSERT_EQ(world.executed.empty(), !GetParam());
    ASSERT_EQ(0u, world.conversation().counters().fail_safe_stops) << life;
    ASSERT_LT(world.longest_silence_ms, kFailSafeMs);
  }
}

INSTANTIATE_TEST_SUITE_P(WithoutAndWithATrail, ServerChangeTest, testing::Bool());

}  // namespace
}  // namespace pheromone::client
