// An exception where none is expected ends what it hit and is told; the link comes back by itself.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <stdexcept>

#include "server/robots/links/port_link.h"
#include "server/robots/links/tcp_link.h"
#include "server/robots/links/testing/link_bench.h"
#include "server/robots/links/testing/net_peer.h"
#include "server/robots/links/testing/remembering_tap.h"
#include "server/robots/links/udp_link.h"

namespace pheromone::links {
namespace {

using std::chrono::milliseconds;
using testing::ConnectTo;
using testing::Eventually;
using testing::IsEcho;
using testing::Peer;
using testing::PingOf;

// Throws when it is shown the next bytes that are read.
class ThrowingTap final : public testing::RememberingTap {
 public:
  void Read(Connection* line, std::span<const uint8_t> bytes, uint32_t now_ms,
            const protocol::FrameDecoder& decoder) override {
    if (throws.exchange(false)) {
      throw std::runtime_error("out of order");
    }
    RememberingTap::Read(line, bytes, now_ms, decoder);
  }
  std::atomic<bool> throws{false};
};

class InternalErrorTest : public ::testing::Test {
 protected:
  LinkContext Context() {
    LinkContext context = server_.Context(0);
    context.tap = &tap_;
    return context;
  }

  bool Told(const std::string& line) {
    return Eventually([&] {
      const std::vector<std::string> lines = server_.lines();
      return std::count(lines.begin(), lines.end(), line) == 1;
    });
  }

  bool UpAgain() {
    return Eventually(
        [this] { return server_.link().counters().opened == 2 && server_.link().state().up; });
  }

  static constexpr char kDown[] = "link radio-a: down, internal error: out of order; retrying";

  const LinkConfig on_localhost_{.name = "radio-a", .listen = {"127.0.0.1", 0}};
  TemporaryFolder folder_;
  ThrowingTap tap_;
  testing::Server server_;
};

TEST_F(InternalErrorTest, APortIsOpenedAgain) {
  const LinkConfig config{.name = "radio-a", .path = folder_ / "radio-a.pty"};
  ASSERT_TRUE(server_.Start(MakePtyLink(server_.io(), config, Context())).ok());
  Peer robot(config.path);
  ASSERT_TRUE(robot.Ask(PingOf(1, 1)));
  tap_.throws = true;
  ASSERT_TRUE(robot.Send(PingOf(1, 2)));
  ASSERT_TRUE(Told(kDown));
  ASSERT_TRUE(UpAgain());
  Peer again(config.path);
  EXPECT_TRUE(IsEcho(again.Ask(PingOf(1, 3)), 1, 3));
  server_.Stop();
  EXPECT_TRUE(tap_.in_order());
}

TEST_F(InternalErrorTest, ASocketForDatagramsIsOpenedAgain) {
  ASSERT_TRUE(server_.Start(MakeUdpLink(server_.io(), on_localhost_, Context())).ok());
  Peer robot = ConnectTo(server_.link(), SOCK_DGRAM);
  ASSERT_TRUE(robot.Ask(PingOf(1, 1)));
  tap_.throws = true;
  ASSERT_TRUE(robot.Send(PingOf(1, 2)));
  ASSERT_TRUE(Told(kDown));
  ASSERT_TRUE(UpAgain());
  Peer again = ConnectTo(server_.link(), SOCK_DGRAM);
  EXPECT_TRUE(IsEcho(again.Ask(PingOf(1, 3)), 1, 3));
  server_.Stop();
  EXPECT_TRUE(tap_.in_order());
}

TEST_F(InternalErrorTest, AConnectionIsClosedAndNoOther) {
  ASSERT_TRUE(server_.Start(MakeTcpLink(server_.io(), on_localhost_, Context())).ok());
  Peer robot = ConnectTo(server_.link(), SOCK_STREAM);
  ASSERT_TRUE(robot.Ask(PingOf(1, 1)));
  Peer other = ConnectTo(server_.link(), SOCK_STREAM);
  ASSERT_TRUE(other.Ask(PingOf(2, 1)));
  tap_.throws = true;
  ASSERT_TRUE(robot.Send(PingOf(1, 2)));
  EXPECT_TRUE(robot.SeesTheEnd());
  EXPECT_TRUE(Told("link radio-a: internal error: out of order; the connection is closed"));
  EXPECT_TRUE(IsEcho(other.Ask(PingOf(2, 2)), 2, 2));
  Peer again = ConnectTo(server_.link(), SOCK_STREAM);
  EXPECT_TRUE(IsEcho(again.Ask(PingOf(1, 3)), 1, 3));
  server_.Stop();
  EXPECT_TRUE(tap_.in_order());
}

}  // namespace
}  // namespace pheromone::links
