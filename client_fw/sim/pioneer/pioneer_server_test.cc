// The port, through real pseudo-terminals and sockets. The robot's time is virtual: nothing waits
// for a clock.
#include "client_fw/sim/pioneer/pioneer_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>

#include "client_fw/sim/testing/pioneer_client.h"

namespace pheromone::sim {
namespace {

using testing::Bytes;
using testing::Command;
using testing::Hex;
using testing::operator+;  // NOLINT(misc-unused-using-decls): it is used

const Bytes kSync0 = Hex("fa fb 03 00 00 00");
const Bytes kHandshake = Command(0) + Command(1) + Command(2) + Command(1);

class PioneerServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/pioneer_server_test.XXXXXX";
    ASSERT_NE(mkdtemp(name), nullptr);
    folder_ = name;
    link_ = folder_ + "/pioneer.pty";
  }
  void TearDown() override {
    unlink(link_.c_str());
    rmdir(folder_.c_str());
  }

  int OpenPty() const { return open(link_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK); }

  static int ConnectTcp(const PioneerServer& server) {
    const std::string& where = server.address();
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(std::stoi(where.substr(where.find(':') + 1))));
    const int client = socket(AF_INET, SOCK_STREAM, 0);
    EXPECT_EQ(connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    fcntl(client, F_SETFL, O_NONBLOCK);
    return client;
  }

  static void Put(int client, const Bytes& bytes) {
    EXPECT_EQ(write(client, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }

  // Bytes reach the other end when the system gets round to it: steps on the spot until then.
  bool StepUntil(PioneerServer* server, const std::function<bool()>& holds) {
    for (int i = 0; i < 20'000; ++i) {
      server->Step(now_ns_);
      if (holds()) {
        return true;
      }
      server->Wait(1);
    }
    return false;
  }

  /// What the client gets, until there are `size` bytes.
  Bytes Get(PioneerServer* server, int client, size_t size) {
    Bytes got;
    StepUntil(server, [&] {
      std::array<uint8_t, 256> buffer{};
      const ssize_t count = read(client, buffer.data(), std::min(size - got.size(), buffer.size()));
      if (count > 0) {
        got.insert(got.end(), buffer.begin(), buffer.begin() + count);
      }
      return got.size() == size;
    });
    return got;
  }

  std::string folder_;
  std::string link_;
  PioneerRobot robot_{{}, {}};
  int64_t now_ns_ = 0;
};

TEST_F(PioneerServerTest, ASessionOverAPty) {
  PioneerServer server(&robot_);
  ASSERT_EQ(server.ServePty(link_), "");
  EXPECT_EQ(server.address(), link_);
  server.Step(0);
  EXPECT_FALSE(server.connected());
  const int client = OpenPty();
  ASSERT_GE(client, 0);
  Put(client, kSync0);
  EXPECT_EQ(Get(&server, client, 6), kSync0);
  Put(client, kHandshake + Command(28, 0));
  EXPECT_TRUE(StepUntil(&server, [&] { return robot_.open(); }));
  now_ns_ = 100'000'000;
  const Bytes rest = Get(&server, client, 6 + 6 + 6 + 10 + 8 + 5 + 41);
  EXPECT_EQ(testing::Packets(rest).back()[3], 0x32);
  close(client);
}

TEST_F(PioneerServerTest, APtyIsRawForClientsThatDoNotCare) {
  PioneerServer server(&robot_);
  ASSERT_EQ(server.ServePty(link_), "");
  const int client = OpenPty();
  // Among the arguments: Ctrl-C, Ctrl-D, CR, LF, XON, XOFF, Ctrl-Z.
  Put(client, kHandshake + Command(4, 1));
  for (const int argument : {0x0304, 0x0D0A, 0x1113, 0x1A7F, 0x0D0D}) {
    Put(client, Command(6, argument));
  }
  EXPECT_TRUE(StepUntil(&server, [&] { return robot_.counters().packets == 10; }));
  EXPECT_EQ(robot_.counters().bad_checksums, 0u);
  close(client);
}

TEST_F(PioneerServerTest, TheNextClientOfAPtyFindsNoSessionAndNoOldBytes) {
  PioneerServer server(&robot_);
  ASSERT_EQ(server.ServePty(link_), "");
  int client = OpenPty();
  Put(client, kHandshake + Command(4, 1) + Command(11, 300));
  EXPECT_TRUE(StepUntil(&server, [&] { return robot_.motors_enabled(); }));
  now_ns_ = 1'000'000'000;
  server.Step(now_ns_);  // SIPs that nobody reads
  EXPECT_NE(robot_.drive().motion(), Motion{});
  close(client);
  EXPECT_TRUE(StepUntil(&server, [&] { return !server.connected(); }));
  EXPECT_FALSE(robot_.open());
  EXPECT_FALSE(robot_.motors_enabled());
  now_ns_ = 2'000'000'000;
  server.Step(now_ns_);
  EXPECT_EQ(robot_.drive().motion(), Motion{});  // stood still by itself, at 300 mm/s^2

  client = OpenPty();
  Put(client, kSync0);
  EXPECT_EQ(Get(&server, client, 6), kSync0);
  close(client);
}

// A hundred times: a client drives and dies without a word; the next one connects at once, as ARIA
// does, and drives on.
TEST_F(PioneerServerTest, AClientThatDiesWhileDrivingIsReplacedOverAPtyAndOverTcp) {
  PioneerServer server(&robot_);
  PioneerRobot other({}, {});
  PioneerServer tcp(&other);
  ASSERT_EQ(server.ServePty(link_), "");
  ASSERT_EQ(tcp.ServeTcp(0), "");
  const auto visit = [&](PioneerServer* port, PioneerRobot* robot, int client, uint64_t round) {
    Put(client, kSync0);
    ASSERT_EQ(Get(port, client, 6), kSync0) << round;
    Put(client, Command(1) + Command(2) + Command(1, 1) + Command(4, 1) + Command(11, 300));
    ASSERT_TRUE(StepUntil(port, [&] { return robot->motors_enabled(); })) << round;
    now_ns_ += 250'000'000;
    port->Step(now_ns_);
    EXPECT_NE(robot->drive().motion(), Motion{}) << round;
    close(client);
    ASSERT_TRUE(StepUntil(port, [&] { return !port->connected(); })) << round;
    EXPECT_FALSE(robot->open()) << round;
    EXPECT_EQ(robot->counters().sessions, round);
  };
  for (uint64_t round = 1; round <= 100; ++round) {
    visit(&server, &robot_, OpenPty(), round);
    visit(&tcp, &other, ConnectTcp(tcp), round);
  }
}

TEST_F(PioneerServerTest, CloseEndsATcpConnection) {
  PioneerServer server(&robot_);
  ASSERT_EQ(server.ServeTcp(0), "");
  const int client = ConnectTcp(server);
  Put(client, kHandshake + Command(2));
  ASSERT_TRUE(StepUntil(&server, [&] { return robot_.counters().closes == 1; }));
  EXPECT_FALSE(server.connected());
  close(client);
}

TEST_F(PioneerServerTest, TheLinkGoesWithTheServerAndOnlyAPtysLinkIsReplaced) {
  ASSERT_EQ(symlink("/dev/pts/99999", link_.c_str()), 0);
  {
    PioneerServer server(&robot_);
    EXPECT_EQ(server.ServePty(link_), "");
    const int client = OpenPty();
    EXPECT_GE(client, 0);
    close(client);
  }
  struct stat found = {};
  EXPECT_NE(lstat(link_.c_str(), &found), 0);

  std::ofstream(link_) << "precious";
  PioneerServer server(&robot_);
  EXPECT_NE(server.ServePty(link_).find("is not a link to a pseudo-terminal"), std::string::npos);
  std::string text;
  std::ifstream(link_) >> text;
  EXPECT_EQ(text, "precious");
}

TEST_F(PioneerServerTest, AFolderThatDoesNotExistIsAnError) {
  PioneerServer server(&robot_);
  EXPECT_NE(server.ServePty(folder_ + "/none/pty").find("No such file"), std::string::npos);
}

TEST_F(PioneerServerTest, ASessionOverTcpEndsWithItsConnection) {
  PioneerServer server(&robot_);
  ASSERT_EQ(server.ServeTcp(0), "");
  for (uint64_t visit = 1; visit <= 3; ++visit) {
    const int client = ConnectTcp(server);
    Put(client, kHandshake + Command(4, 1));
    EXPECT_TRUE(StepUntil(&server, [&] { return robot_.motors_enabled(); }));
    EXPECT_EQ(robot_.counters().sessions, visit);
    close(client);
    EXPECT_TRUE(StepUntil(&server, [&] { return !robot_.open(); }));
    EXPECT_FALSE(server.connected());
  }
}

TEST_F(PioneerServerTest, ASecondTcpClientIsHungUpOn) {
  PioneerServer server(&robot_);
  ASSERT_EQ(server.ServeTcp(0), "");
  const int first = ConnectTcp(server);
  EXPECT_TRUE(StepUntil(&server, [&] { return server.connected(); }));
  const int second = ConnectTcp(server);
  char byte = 0;
  EXPECT_TRUE(StepUntil(&server, [&] { return read(second, &byte, 1) == 0; }));
  Put(first, kSync0);
  EXPECT_EQ(Get(&server, first, 6), kSync0);
  close(first);
  close(second);
}

TEST_F(PioneerServerTest, AClientThatNeverReadsDoesNotGrowTheServerAndGetsWholePackets) {
  PioneerServer server(&robot_);
  ASSERT_EQ(server.ServeTcp(0), "");
  const int client = ConnectTcp(server);
  const int small = 2048;
  setsockopt(client, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
  Put(client, kHandshake);
  EXPECT_TRUE(StepUntil(&server, [&] { return robot_.open(); }));
  for (int sip = 0; sip < 50'000; ++sip) {
    now_ns_ += 100'000'000;
    server.Step(now_ns_);
  }
  EXPECT_TRUE(server.connected());
  Bytes got;
  StepUntil(&server, [&] {
    std::array<uint8_t, 65536> buffer{};
    const ssize_t count = read(client, buffer.data(), buffer.size());
    got.insert(got.end(), buffer.begin(), buffer.begin() + std::max<ssize_t>(count, 0));
    return count < 0;
  });
  // Packets reports what is not whole, but for the last one, which may still be under way.
  const size_t last = got.size() - (got.size() - 6 - 6 - 29) % 89;
  EXPECT_GT(testing::Packets({got.begin(), got.begin() + static_cast<ptrdiff_t>(last)}).size(),
            20u);
  EXPECT_LT(got.size(), size_t{50'000} * 89);
  close(client);
}

TEST_F(PioneerServerTest, APortInUseIsAnError) {
  PioneerServer server(&robot_);
  ASSERT_EQ(server.ServeTcp(0), "");
  const std::string& where = server.address();
  PioneerServer other(&robot_);
  const std::string error =
      other.ServeTcp(static_cast<uint16_t>(std::stoi(where.substr(where.find(':') + 1))));
  EXPECT_NE(error.find("Address already in use"), std::string::npos);
}

}  // namespace
}  // namespace pheromone::sim
