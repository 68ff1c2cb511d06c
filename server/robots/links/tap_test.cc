// A tap sees every byte that passes, and hears of every message that goes nowhere. What is left out
// on a shared line is in serial_link_test.cc and serial_lines_test.cc.

#include "server/robots/links/tap.h"

#include <gtest/gtest.h>

#include "server/robots/links/datagrams.h"
#include "server/robots/links/port_link.h"
#include "server/robots/links/tcp_link.h"
#include "server/robots/links/testing/link_bench.h"
#include "server/robots/links/testing/net_peer.h"
#include "server/robots/links/testing/remembering_tap.h"
#include "server/robots/links/udp_link.h"

namespace pheromone::links {
namespace {

using engine::testing::Deposit;
using engine::testing::Hello;
using engine::testing::SameMessage;
using protocol::Reason;
using testing::ConnectTo;
using testing::Eventually;
using testing::IsEcho;
using testing::Peer;
using testing::PingOf;
using testing::RememberingTap;
using testing::Wire;
using Bytes = RememberingTap::Bytes;

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::vector<protocol::Message> MessagesIn(const Bytes& bytes) {
  std::vector<protocol::Message> messages;
  protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
  decoder.PushBlock(bytes.data(), bytes.size(), 0,
                    [&](const protocol::Message& it) { messages.push_back(it); });
  return messages;
}

class TapTest : public ::testing::Test {
 protected:
  void TearDown() override { server_.Stop(); }

  LinkContext Context() {
    LinkContext context = server_.Context(0);
    context.tap = &tap_;
    return context;
  }

  // The first link: SOCK_STREAM or SOCK_DGRAM.
  void Listen(int kind, const AdmissionOptions& admission = {}) {
    const LinkConfig config{.name = "radio-a", .admission = admission, .listen = {"127.0.0.1", 0}};
    const Status status = kind == SOCK_STREAM
                              ? server_.Start(MakeTcpLink(server_.io(), config, Context()))
                              : server_.Start(MakeUdpLink(server_.io(), config, Context()));
    ASSERT_TRUE(status.ok()) << status.error();
  }

  Status StartPty(const std::string& path) {
    const LinkConfig config{.name = "radio-a", .path = path};
    return server_.Start(MakePtyLink(server_.io(), config, Context()));
  }

  Peer OpenPty() {
    const std::string path = folder_ / "radio-a.pty";
    EXPECT_TRUE(StartPty(path).ok());
    return Peer(path);
  }

  TemporaryFolder folder_;
  RememberingTap tap_;
  testing::Server server_;
};

TEST_F(TapTest, SeesWhatIsReadAndWrittenByteByByte) {
  Peer robot = OpenPty();
  Bytes sent = {0x10, 0x33, 0x00};  // noise is seen too
  ASSERT_TRUE(robot.SendBytes(sent));
  Bytes received;
  for (uint8_t i = 0; i < 5; ++i) {
    const auto answer = robot.Ask(PingOf(3, i));
    ASSERT_TRUE(answer);
    sent = sent + Wire(PingOf(3, i));
    received = received + Wire(*answer);
  }
  server_.Stop();
  EXPECT_EQ(RememberingTap::Together(tap_.read(), 1), sent);
  EXPECT_EQ(RememberingTap::Together(tap_.written(), 1), received);
  EXPECT_TRUE(tap_.in_order());
  EXPECT_TRUE(tap_.dropped().empty());
  EXPECT_TRUE(tap_.rejected().empty());
}

TEST_F(TapTest, HearsOfWhatNobodyReadsAndOfWhatIsLeftAtTheEnd) {
  Peer robot = OpenPty();
  ASSERT_TRUE(robot.Ask(Hello(1, 1)));
  // Until the terminal takes no more, the session's queue is full, and the first in it go.
  const std::vector<engine::Outgoing> many(5000, {0, 0, PingOf(1, 7)});
  size_t sent = 1;  // HELLO's answer
  ASSERT_TRUE(Eventually([&] {
    server_.router().Deliver(many);
    sent += many.size();
    return server_.link().counters().dropped_answers > 0;
  }));
  server_.Stop();
  const std::vector<protocol::Message> dropped = tap_.dropped();
  EXPECT_GT(dropped.size(), server_.link().counters().dropped_answers);
  EXPECT_TRUE(SameMessage(dropped.back(), PingOf(1, 7)));
  const size_t written = MessagesIn(RememberingTap::Together(tap_.written(), 1)).size();
  EXPECT_EQ(written + dropped.size(), sent);
}

// Sends until the other end's buffers are full, and a write waits; then it fails.
TEST_F(TapTest, HearsOfWhatAFailedWriteLeavesAndItIsCounted) {
  Listen(SOCK_STREAM);
  Peer robot = ConnectTo(server_.link(), SOCK_STREAM);
  ASSERT_TRUE(robot.Ask(Hello(1, 1)));
  protocol::Message largest = PingOf(1, 7);
  largest.length = protocol::kMaxData;
  const std::vector<engine::Outgoing> many(500, {0, 0, largest});
  size_t sent = 1;  // HELLO's answer
  do {
    server_.router().Deliver(many);
    sent += many.size();
  } while (Eventually([&] { return server_.link().counters().frames_out == sent; },
                      std::chrono::milliseconds(500)));
  robot.HangUp();
  EXPECT_TRUE(Eventually([this] { return server_.link().counters().undeliverable > 0; }));
  server_.Stop();
  const size_t written = MessagesIn(RememberingTap::Together(tap_.written(), 1)).size();
  EXPECT_EQ(written + tap_.dropped().size(), sent);
}

TEST_F(TapTest, HearsOfWhatIsForALinkThatIsDown) {
  ASSERT_FALSE(StartPty(folder_ / "none/radio-a.pty").ok());
  const protocol::Message message = PingOf(9, 1);
  server_.link().Send({{0, 0, message}});
  ASSERT_TRUE(Eventually([this] { return tap_.dropped().size() == 1; }));
  EXPECT_TRUE(SameMessage(tap_.dropped()[0], message));
}

TEST_F(TapTest, TellsTcpConnectionsApart) {
  Listen(SOCK_STREAM);
  Peer a = ConnectTo(server_.link(), SOCK_STREAM);
  ASSERT_TRUE(a.Ask(PingOf(1, 1)));
  Peer b = ConnectTo(server_.link(), SOCK_STREAM);
  const auto answer = b.Ask(PingOf(2, 2));
  ASSERT_TRUE(answer);
  ASSERT_TRUE(a.Ask(PingOf(1, 3)));
  server_.Stop();
  EXPECT_EQ(RememberingTap::Together(tap_.read(), 1), Wire(PingOf(1, 1)) + Wire(PingOf(1, 3)));
  EXPECT_EQ(RememberingTap::Together(tap_.read(), 2), Wire(PingOf(2, 2)));
  EXPECT_EQ(RememberingTap::Together(tap_.written(), 2), Wire(*answer));
}

// Also those with nothing in them, or trash; but what is too long for a datagram is discarded
// unread, and is no part of what happens.
TEST_F(TapTest, SeesEachDatagramByItself) {
  Listen(SOCK_DGRAM);
  Peer robot = ConnectTo(server_.link(), SOCK_DGRAM);
  const Bytes sent[] = {
      Wire(PingOf(3, 1)), {}, {0x10, 0x02, 0x03}, {0x72}, Wire(PingOf(3, 2)) + Wire(PingOf(3, 3))};
  ASSERT_TRUE(robot.SendBytes(Bytes(kMaxDatagramBytes + 1, 0x55)));
  for (const Bytes& datagram : sent) {
    ASSERT_EQ(write(robot.descriptor(), datagram.data(), datagram.size()),
              static_cast<ssize_t>(datagram.size()));
  }
  Bytes received[3];
  for (Bytes& datagram : received) {
    const auto answer = robot.Receive();
    ASSERT_TRUE(answer);
    datagram = Wire(*answer);
  }
  server_.Stop();
  const auto read = tap_.read();
  ASSERT_EQ(read.size(), std::size(sent));
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].bytes, sent[i]) << i;
    EXPECT_EQ(read[i].connection, 1u);
  }
  const auto written = tap_.written();
  ASSERT_EQ(written.size(), std::size(received));
  for (size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ(written[i].bytes, received[i]) << i;
  }
  EXPECT_TRUE(tap_.in_order());
}

TEST_F(TapTest, HearsOfDatagramsThatAreTooLateForTheSocket) {
  Listen(SOCK_DGRAM);
  // Another one, that the threads go on for.
  const LinkConfig other{.name = "radio-b", .listen = {"127.0.0.1", 0}};
  ASSERT_TRUE(server_.Start(MakeUdpLink(server_.io(), other, server_.Context(1))).ok());
  ASSERT_TRUE(ConnectTo(server_.link(), SOCK_DGRAM).Ask(PingOf(1, 1)));
  server_.link().Stop();
  const protocol::Message message = PingOf(1, 2);
  server_.link().Send({{0, 0, message}});
  ASSERT_TRUE(Eventually([this] { return tap_.dropped().size() == 1; }));
  EXPECT_TRUE(SameMessage(tap_.dropped()[0], message));
  EXPECT_EQ(tap_.written().size(), 1u);
}

// How much was turned away before the batch was handled.
class CountingWitness final : public engine::Observer {
 public:
  explicit CountingWitness(const RememberingTap& tap) : tap_(tap) {}
  void OnBatch(const engine::Stamp&, engine::LinkIndex, std::span<const protocol::Message> messages,
               std::span<const Outcome>, std::span<const engine::Outgoing>) override {
    messages_ += messages.size();
    turned_away_ = tap_.rejected().size();
  }
  void OnEvent(uint64_t, const engine::Stamp&, const engine::Event&,
               std::span<const engine::Outgoing>) override {}
  size_t messages() const { return messages_; }
  size_t rejected() const { return turned_away_; }

 private:
  const RememberingTap& tap_;
  size_t messages_ = 0;
  size_t turned_away_ = 0;
};

class TapAdmissionTest : public TapTest, public ::testing::WithParamInterface<int> {};

// Replay takes the batch from what was decoded and not turned away: that must be known before.
TEST_P(TapAdmissionTest, HearsOfWhatIsTurnedAwayAndHowBeforeTheRestIsHandled) {
  AdmissionOptions admission;
  admission.clients.reset().set(1);
  admission.per_client_per_s = 1;
  Listen(GetParam(), admission);
  CountingWitness observer(tap_);
  server_.service().Attach(&observer, [](const auto&) {});
  protocol::Message echo = PingOf(1, 1);  // nobody's request: it gets no answer
  echo.opcode = protocol::kPingAnswer;
  Peer robot = ConnectTo(server_.link(), GetParam());
  ASSERT_TRUE(robot.SendBytes(Wire(PingOf(2, 1)) + Wire(PingOf(1, 1)) + Wire(Deposit(1, 9)) +
                              Wire(echo) + Wire(PingOf(3, 1))));
  Bytes received;
  for (int i = 0; i < 2; ++i) {
    const auto answer = robot.Receive();
    ASSERT_TRUE(answer);
    received = received + Wire(*answer);
  }
  server_.Stop();
  const struct {
    protocol::Message message;
    Reason answer;
  } expected[] = {{PingOf(2, 1), Reason::kNone},
                  {Deposit(1, 9), Reason::kBusy},
                  {echo, Reason::kNone},
                  {PingOf(3, 1), Reason::kNone}};
  const auto rejected = tap_.rejected();
  ASSERT_EQ(rejected.size(), std::size(expected));
  for (size_t i = 0; i < rejected.size(); ++i) {
    EXPECT_TRUE(SameMessage(rejected[i].message, expected[i].message)) << i;
    EXPECT_EQ(rejected[i].answer, expected[i].answer) << i;
  }
  EXPECT_EQ(observer.messages(), 1u);
  EXPECT_EQ(observer.rejected(), std::size(expected));
  EXPECT_EQ(RememberingTap::Together(tap_.written(), 1), received);  // BUSY too
  EXPECT_TRUE(tap_.dropped().empty());
  EXPECT_TRUE(tap_.in_order());
}

INSTANTIATE_TEST_SUITE_P(TcpAndUdp, TapAdmissionTest, ::testing::Values(SOCK_STREAM, SOCK_DGRAM),
                         [](const auto& test) {
                           return test.param == SOCK_STREAM ? "Tcp" : "Udp";
                         });

}  // namespace
}  // namespace pheromone::links
