#include "client_fw/sim/avr/avr_bridge.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <string>

namespace pheromone::sim {
namespace {

constexpr int64_t kMs = 1'000'000;

// A pair of ends; the machine's does not block, as a terminal's would not.
struct Line {
  Line() {
    std::array<int, 2> ends{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
    machine = ends[0];
    outside = ends[1];
    EXPECT_EQ(fcntl(machine, F_SETFL, O_NONBLOCK), 0);
    EXPECT_EQ(fcntl(outside, F_SETFL, O_NONBLOCK), 0);
  }
  ~Line() {
    close(machine);
    close(outside);
  }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  std::string Take() const {
    std::array<char, 1000> bytes{};
    const ssize_t size = read(outside, bytes.data(), bytes.size());
    return {bytes.data(), static_cast<size_t>(size > 0 ? size : 0)};
  }
  void Give(const std::string& bytes) const {
    EXPECT_EQ(write(outside, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

  int machine = -1;
  int outside = -1;
};

TEST(AvrBridgeTest, BytesPassAtTheRateOfTheLine) {
  AvrMachineConfig config;
  config.image = PHEROMONE_AVR_ECHO_IMAGE;
  AvrMachine machine(config);
  const Line radio;
  const Line robot;
  AvrBridge bridge(&machine, radio.machine, robot.machine);
  ASSERT_TRUE(bridge.Step(10 * kMs));
  EXPECT_EQ(robot.Take().substr(0, 1), "R");

  const std::string sent(500, 'x');
  radio.Give(sent);
  std::string echoed;
  for (int ms = 11; ms <= 510; ++ms) {
    ASSERT_TRUE(bridge.Step(ms * kMs));
    echoed += radio.Take();
  }
  EXPECT_NEAR(static_cast<double>(echoed.size()), 480, 5) << "half a second at 9600 baud";
  for (int ms = 511; ms <= 600; ++ms) {
    ASSERT_TRUE(bridge.Step(ms * kMs));
    echoed += radio.Take();
  }
  EXPECT_EQ(echoed, sent);
  EXPECT_EQ(machine.uart(AvrMachine::kRadio).overruns, 0u);
  EXPECT_EQ(bridge.lost(), 0u);
}

TEST(AvrBridgeTest, SaysWhenATerminalIsGone) {
  AvrMachineConfig config;
  config.image = PHEROMONE_AVR_ECHO_IMAGE;
  AvrMachine machine(config);
  const Line radio;
  Line robot;
  AvrBridge bridge(&machine, radio.machine, robot.machine);
  ASSERT_TRUE(bridge.Step(10 * kMs));
  robot.Take();
  close(robot.outside);
  robot.outside = -1;
  EXPECT_FALSE(bridge.Step(11 * kMs));
}

}  // namespace
}  // namespace pheromone::sim
