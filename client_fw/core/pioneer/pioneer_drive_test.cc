#include "client_fw/core/pioneer/pioneer_drive.h"

#include <gtest/gtest.h>

#include <deque>

#include "client_fw/core/base/moment.h"
#include "client_fw/core/testing/naive_arcos.h"

namespace pheromone {
namespace client {
namespace {

// A board whose UART has room for `room` bytes.
class NarrowBoard {
 public:
  int robot_get() {
    if (in.empty()) {
      return -1;
    }
    const uint8_t byte = in.front();
    in.pop_front();
    return byte;
  }
  bool robot_put(uint8_t byte) {
    if (room == 0) {
      return false;
    }
    rate_of_last = rate;
    --room;
    out.push_back(byte);
    return true;
  }
  void set_robot_rate(uint8_t number) { rate = number; }
  Moment millis() const { return now_ms; }

  void Hear(const Bytes& packet) { in.insert(in.end(), packet.begin(), packet.end()); }

  uint32_t now_ms = 0xFFFFFF00;  // wraps soon
  std::deque<uint8_t> in;
  Bytes out;
  int room = 0;
  uint8_t rate = 77;
  uint8_t rate_of_last = 77;  // byte put
};

class PioneerDriveTest : public ::testing::Test {
 protected:
  void Run(int ms, int room = 2) {
    for (int i = 0; i < ms; ++i) {
      ++board_.now_ms;
      board_.room = room;
      drive_.Step();
    }
  }

  void Connect() {
    for (uint8_t sync = 0; sync < 3; ++sync) {
      Run(30);
      board_.Hear(NaivePacket({sync}));
    }
    Run(30);
    board_.Hear(NaivePacket(Sip().Body()));
    Run(90);
    board_.out.clear();
  }

  NarrowBoard board_;
  PioneerDrive<NarrowBoard> drive_{&board_};
};

TEST_F(PioneerDriveTest, CommandsPassThroughANarrowUart) {
  Connect();
  drive_.set_wheel_speeds(-100, 100);
  Run(4);
  EXPECT_EQ(Hex("fa fb 06 20 1b fb 04 1b"), board_.out);
  Run(1);
  EXPECT_EQ(Hex("fa fb 06 20 1b fb 04 1b 1f"), board_.out);
}

TEST_F(PioneerDriveTest, OdometryIsKnownFromTheFirstSipUntilSilence) {
  Odometry odometry = {1, 2, 3};
  EXPECT_FALSE(drive_.odometry(&odometry));
  EXPECT_EQ(1, odometry.x_mm);
  Connect();
  ASSERT_TRUE(drive_.odometry(&odometry));
  EXPECT_EQ(0, odometry.x_mm);
  Sip sip;
  sip.x = 1000;
  board_.Hear(NaivePacket(sip.Body()));
  Run(1);
  ASSERT_TRUE(drive_.odometry(&odometry));
  EXPECT_EQ(485, odometry.x_mm);
  Run(kPioneerSilenceMs);
  EXPECT_FALSE(drive_.odometry(&odometry));
}

TEST_F(PioneerDriveTest, TheBoardHasTheRateBeforeTheFirstByteAtIt) {
  for (uint8_t rate = 0; rate < 3; ++rate) {
    board_.out.clear();
    for (int ms = 0; ms < 2000 && board_.out.empty(); ++ms) {  // SYNC0, then CLOSE
      Run(1);
    }
    EXPECT_EQ(rate, board_.rate_of_last);
    Run(500);
    board_.out.clear();
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
