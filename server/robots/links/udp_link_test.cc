#include "server/robots/links/udp_link.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "server/robots/links/datagrams.h"
#include "server/robots/links/testing/link_bench.h"
#include "server/robots/links/testing/net_peer.h"

namespace pheromone::links {
namespace {

using engine::testing::Deposit;
using engine::testing::Hello;
using std::chrono::milliseconds;
using testing::ConnectTo;
using testing::ConnectToIpv6;
using testing::Eventually;
using testing::IsEcho;
using testing::Peer;
using testing::PingOf;
using testing::PortOf;
using testing::Wire;

std::vector<uint8_t> operator+(std::vector<uint8_t> a, const std::vector<uint8_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

class UdpLinkTest : public ::testing::Test {
 protected:
  Status Start(engine::LinkIndex index = 0, const AdmissionOptions& admission = {}) {
    config_.name = index == 0 ? "radio-a" : "radio-b";
    config_.admission = admission;
    return server_.Start(MakeUdpLink(server_.io(), config_, server_.Context(index)));
  }

  Peer Connect(size_t link = 0) { return ConnectTo(server_.link(link), SOCK_DGRAM); }

  LinkCounters counters(size_t link = 0) { return server_.link(link).counters(); }

  LinkConfig config_{.listen = {"127.0.0.1", 0}};
  testing::Server server_;
};

TEST_F(UdpLinkTest, APingIsAnsweredWhateverItsBytes) {
  ASSERT_TRUE(Start().ok());
  EXPECT_EQ(server_.link().address().find("127.0.0.1:"), 0u);
  Peer robot = Connect();
  for (int byte = 0; byte < 256; ++byte) {
    EXPECT_TRUE(
        IsEcho(robot.Ask(PingOf(3, static_cast<uint8_t>(byte))), 3, static_cast<uint8_t>(byte)));
  }
}

TEST_F(UdpLinkTest, Ipv6IsListenedOnAndToldInBrackets) {
  config_.listen.address = "::1";
  if (!Start().ok()) {
    GTEST_SKIP() << "no IPv6 here";
  }
  EXPECT_EQ(server_.link().address().find("[::1]:"), 0u);
  Peer robot = ConnectToIpv6(server_.link(), SOCK_DGRAM);
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 1)), 3, 1));
}

TEST_F(UdpLinkTest, ItIsKnownWhenTheLastDatagramCame) {
  ASSERT_TRUE(Start().ok());
  EXPECT_FALSE(counters().heard.has_value());
  const auto before = std::chrono::steady_clock::now();
  ASSERT_TRUE(Connect().Ask(PingOf(3, 1)));
  ASSERT_TRUE(counters().heard.has_value());
  EXPECT_GE(*counters().heard, before);
}

TEST_F(UdpLinkTest, EveryFrameOfADatagramIsAnsweredInOrder) {
  ASSERT_TRUE(Start().ok());
  Peer gateway = Connect();
  std::vector<uint8_t> datagram;
  for (uint8_t id = 1; id <= 50; ++id) {
    datagram = datagram + Wire(PingOf(id, id));
  }
  ASSERT_TRUE(gateway.SendBytes(datagram));
  uint64_t bytes = 0;
  for (uint8_t id = 1; id <= 50; ++id) {
    const auto answer = gateway.Receive();
    ASSERT_TRUE(answer);
    EXPECT_TRUE(IsEcho(answer, id, id));
    bytes += Wire(*answer).size();
  }
  EXPECT_EQ(counters().datagrams_in, 1u);
  EXPECT_TRUE(Eventually([this] { return counters().frames_out == 50; }));
  EXPECT_EQ(counters().bytes_out, bytes);
}

TEST_F(UdpLinkTest, AFloodFromManyIsAnsweredToEachWithItsOwn) {
  ASSERT_TRUE(Start().ok());
  std::vector<Peer> robots;
  for (int i = 0; i < 100; ++i) {
    robots.push_back(Connect());
  }
  for (uint8_t round = 0; round < 5; ++round) {
    for (size_t i = 0; i < robots.size(); ++i) {
      ASSERT_TRUE(robots[i].Send(PingOf(static_cast<uint8_t>(i + 1), round)));
    }
    for (size_t i = 0; i < robots.size(); ++i) {
      EXPECT_TRUE(IsEcho(robots[i].Receive(), static_cast<uint8_t>(i + 1), round)) << i;
    }
  }
}

// Also when both requests are read at once: the link is made to wait for the engine meanwhile.
TEST_F(UdpLinkTest, TwoUnderOneIdAreEachAnsweredWhereTheyAsked) {
  ASSERT_TRUE(Start().ok());
  Peer a = Connect();
  Peer b = Connect();
  server_.service().Inspect([&](const auto&) {
    for (uint8_t i = 0; i < 20; ++i) {
      EXPECT_TRUE(a.Send(PingOf(7, i)));
      EXPECT_TRUE(b.Send(PingOf(7, static_cast<uint8_t>(100 + i))));
    }
  });
  for (uint8_t i = 0; i < 20; ++i) {
    EXPECT_TRUE(IsEcho(a.Receive(), 7, i));
    EXPECT_TRUE(IsEcho(b.Receive(), 7, static_cast<uint8_t>(100 + i)));
  }
}

// Many addresses under few IDs repeat a request while the log is stuck.
TEST_F(UdpLinkTest, AnAnswerThatHadToWaitGoesToTheAddressThatAskedForItLast) {
  constexpr uint8_t kRobots = 20;
  constexpr int kAddresses = 20;  // of each
  ASSERT_TRUE(Start().ok());
  Peer first = Connect();
  for (uint8_t id = 1; id <= kRobots; ++id) {
    ASSERT_TRUE(first.Ask(Hello(id, 5)));
  }
  server_.log().GetStuck();
  const uint64_t frames = counters().received.frames;
  std::vector<Peer> peers;
  for (int i = 0; i < kAddresses; ++i) {
    for (uint8_t id = 1; id <= kRobots; ++id) {
      // Of 127.0.0.2 to 127.0.0.21, each with a port of its own.
      peers.push_back(testing::ConnectFrom(INADDR_LOOPBACK + 1 + static_cast<uint32_t>(i),
                                           server_.link(), SOCK_DGRAM));
      ASSERT_TRUE(peers.back().Send(Deposit(id, 9)));
      ASSERT_TRUE(Eventually([&] { return counters().received.frames == frames + peers.size(); }));
      ASSERT_LE(server_.service().held_answers(), kRobots);
    }
  }
  ASSERT_TRUE(first.Ask(PingOf(1, 1)));  // the last one has been handled, and this spoke after it
  EXPECT_EQ(server_.service().held_answers(), kRobots);
  server_.GoOn();
  for (size_t i = 0; i < peers.size(); ++i) {
    const auto id = static_cast<uint8_t>(1 + i % kRobots);
    if (i >= peers.size() - kRobots) {
      const auto answer = peers[i].Receive();
      ASSERT_TRUE(answer);
      EXPECT_EQ(answer->opcode, 0xA1);
      EXPECT_EQ(answer->id, id);
    }
    EXPECT_TRUE(IsEcho(peers[i].Ask(PingOf(id, 2)), id, 2)) << i;  // and nothing comes before it
  }
  EXPECT_TRUE(IsEcho(first.Ask(PingOf(1, 3)), 1, 3));
  EXPECT_EQ(counters().late_answers, 0u);
}

TEST_F(UdpLinkTest, AnAnswerThatNobodyWaitsForAnyLongerIsNotSentButCounted) {
  ASSERT_TRUE(Start().ok());
  Peer robot = Connect();
  ASSERT_TRUE(robot.Ask(PingOf(1, 1)));
  server_.link().Send(
      {testing::AnswerAfter(kLongestWait + milliseconds(1), PingOf(1, 2)), {0, 0, PingOf(1, 3)}});
  EXPECT_EQ(robot.Receive()->data[0], 3);
  EXPECT_EQ(counters().late_answers, 1u);
}

TEST_F(UdpLinkTest, AnotherPortIsTheSameRobot) {
  ASSERT_TRUE(Start().ok());
  Peer before = Connect();
  ASSERT_TRUE(before.Ask(Hello(1, 5)));
  const auto first = before.Ask(Deposit(1, 9));
  ASSERT_TRUE(first);
  const uint64_t hash = server_.service().StateHash();
  Peer now = Connect();
  const auto second = now.Ask(Deposit(1, 9));
  ASSERT_TRUE(second);
  EXPECT_TRUE(engine::testing::SameMessage(*first, *second));
  EXPECT_EQ(server_.service().StateHash(), hash);
}

TEST_F(UdpLinkTest, CommandsGoWhereTheRobotSpokeLast) {
  ASSERT_TRUE(Start().ok());
  Peer before = Connect();
  ASSERT_TRUE(before.Ask(Hello(1, 5)));
  Peer now = Connect();
  ASSERT_TRUE(now.Ask(PingOf(1, 1)));
  Peer echo = Connect();  // of the server's own frames: takes over nobody's address
  protocol::Message answer = PingOf(1, 1);
  answer.opcode = protocol::kPingAnswer;
  ASSERT_TRUE(echo.Send(answer));
  ASSERT_TRUE(Eventually([&] { return counters().received.frames == 3; }));
  std::vector<engine::Outgoing> out;
  ASSERT_TRUE(server_.service().Issue({0, 1, protocol::CommandCode::kHalt, {}}, &out).ok());
  server_.router().Deliver(out);
  const auto command = now.Receive();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->opcode, protocol::kCommand);
  EXPECT_TRUE(IsEcho(before.Ask(PingOf(2, 2)), 2, 2));  // and nothing came before it
}

TEST_F(UdpLinkTest, ABroadcastReachesEveryAddressOnce) {
  ASSERT_TRUE(Start().ok());
  Peer a = Connect();
  Peer b = Connect();
  ASSERT_TRUE(a.Ask(Hello(1, 5)));
  ASSERT_TRUE(a.Ask(Hello(3, 5)));
  ASSERT_TRUE(b.Ask(Hello(2, 5)));
  std::vector<engine::Outgoing> out;
  ASSERT_TRUE(server_.service()
                  .Issue({0, protocol::kBroadcastId, protocol::CommandCode::kHalt, {}}, &out)
                  .ok());
  server_.router().Deliver(out);
  for (Peer* peer : {&a, &b}) {
    EXPECT_EQ(peer->Receive()->id, protocol::kBroadcastId);
    EXPECT_TRUE(IsEcho(peer->Ask(PingOf(9, 1)), 9, 1));
  }
}

TEST_F(UdpLinkTest, TwoUnderOneIdAreBothHaltedAndReportedOnce) {
  ASSERT_TRUE(Start().ok());
  Peer a = Connect();
  Peer b = Connect();
  for (uint8_t i = 0; i < 5; ++i) {
    ASSERT_TRUE(a.Ask(PingOf(7, i)));
    ASSERT_TRUE(b.Ask(PingOf(7, i)));
  }
  std::vector<engine::Outgoing> out;
  ASSERT_TRUE(server_.service()
                  .Issue({0, protocol::kBroadcastId, protocol::CommandCode::kHalt, {}}, &out)
                  .ok());
  server_.router().Deliver(out);
  for (Peer* peer : {&a, &b}) {
    const auto halt = peer->Receive();
    ASSERT_TRUE(halt);
    EXPECT_EQ(halt->opcode, protocol::kCommand);
  }
  const std::vector<std::string> lines = server_.lines();
  EXPECT_EQ(std::ranges::count_if(lines,
                                  [](const std::string& line) {
                                    return line.find("robot 7 speaks from 127.0.0.1:") !=
                                           std::string::npos;
                                  }),
            1);
}

TEST_F(UdpLinkTest, WhatNobodyAskedForYetCannotBeDelivered) {
  ASSERT_TRUE(Start().ok());
  const protocol::Message message = PingOf(9, 1);
  server_.link().Send({{0, 0, message}});
  EXPECT_TRUE(Eventually([&] { return counters().undeliverable == 1; }));
}

TEST_F(UdpLinkTest, TrashIsCountedAndHarmsNobody) {
  ASSERT_TRUE(Start().ok());
  Peer rude = Connect();
  const std::vector<uint8_t> frame = Wire(PingOf(3, 1));
  std::vector<uint8_t> half = frame;
  half.resize(half.size() - 1);
  std::vector<uint8_t> damaged = frame;
  damaged[4] ^= 1;
  ASSERT_EQ(write(rude.descriptor(), "", 0), 0);  // an empty datagram
  ASSERT_TRUE(rude.SendBytes({1, 2, 3}));
  ASSERT_TRUE(rude.SendBytes(damaged));
  ASSERT_TRUE(rude.SendBytes(half));
  ASSERT_TRUE(rude.SendBytes({frame.back()}));  // does not complete the one before
  ASSERT_TRUE(rude.SendBytes({protocol::kDle}));
  EXPECT_TRUE(IsEcho(rude.Ask(PingOf(3, 2)), 3, 2));
  const LinkCounters counted = counters();
  EXPECT_EQ(counted.datagrams_in, 7u);
  EXPECT_EQ(counted.received.frames, 1u);
  EXPECT_EQ(counted.received.crc_errors, 1u);
  EXPECT_EQ(counted.received.timeouts, 1u);
  EXPECT_EQ(counted.received.ignored_bytes, 3u + 1u + 1u);
}

TEST_F(UdpLinkTest, ADatagramThatIsTooLongIsDiscardedWhole) {
  ASSERT_TRUE(Start().ok());
  Peer robot = Connect();
  std::vector<uint8_t> bytes = Wire(PingOf(3, 1));
  bytes.resize(kMaxDatagramBytes + 1, 0);
  ASSERT_TRUE(robot.SendBytes(bytes));
  bytes.resize(kMaxDatagramBytes);  // this one just fits
  ASSERT_TRUE(robot.SendBytes(bytes));
  EXPECT_TRUE(IsEcho(robot.Receive(), 3, 1));
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 2)), 3, 2));
  EXPECT_EQ(counters().oversize_datagrams, 1u);
}

// The link is made to wait for the engine until the system has thrown some away.
TEST_F(UdpLinkTest, WhatTheSystemThrowsAwayIsCounted) {
  ASSERT_TRUE(Start().ok());
  Peer robot = Connect();
  constexpr uint64_t kSent = 20'000;
  server_.service().Inspect([&](const auto&) {
    for (uint64_t i = 0; i < kSent; ++i) {
      EXPECT_TRUE(robot.Send(PingOf(7, 1)));
    }
  });
  EXPECT_TRUE(
      Eventually([&] { return counters().datagrams_in + counters().dropped_datagrams == kSent; }));
  EXPECT_GT(counters().dropped_datagrams, 0u);
}

TEST_F(UdpLinkTest, APeerThatIsGoneHarmsNobody) {
  ASSERT_TRUE(Start().ok());
  for (int round = 0; round < 20; ++round) {
    Peer gone = Connect();
    ASSERT_TRUE(gone.Send(PingOf(3, 1)));
    gone.HangUp();  // its answer is refused by the system
  }
  Peer robot = Connect();
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(4, 2)), 4, 2));
}

TEST_F(UdpLinkTest, ClientsThatAreNotListedGetNoAnswerAndAreCounted) {
  AdmissionOptions admission;
  admission.clients.reset().set(1);
  ASSERT_TRUE(Start(0, admission).ok());
  Peer robot = Connect();
  ASSERT_TRUE(robot.Send(PingOf(2, 1)));
  ASSERT_TRUE(robot.Send(Hello(2, 1)));
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(1, 1)), 1, 1));
  EXPECT_EQ(counters().not_allowed, 2u);
}

TEST_F(UdpLinkTest, WhoAsksTooOftenIsToldThatTheServerIsBusy) {
  AdmissionOptions admission;
  admission.per_client_per_s = 1;
  ASSERT_TRUE(Start(0, admission).ok());
  Peer robot = Connect();
  // Two requests of one batch come at the same time.
  ASSERT_TRUE(robot.SendBytes(Wire(PingOf(1, 1)) + Wire(Deposit(1, 9)) + Wire(PingOf(2, 1))));
  bool busy = false;
  int echoes = 0;
  for (int i = 0; i < 3; ++i) {
    const auto answer = robot.Receive();
    ASSERT_TRUE(answer);
    protocol::ErrorAnswer error;
    if (protocol::Decode(*answer, &error)) {
      EXPECT_EQ(error.reason, protocol::Reason::kBusy);
      EXPECT_EQ(error.id, 1);
      EXPECT_EQ(error.seq, 9);
      busy = true;
    } else {
      ++echoes;
    }
  }
  EXPECT_TRUE(busy);
  EXPECT_EQ(echoes, 2);
  EXPECT_EQ(counters().too_many, 1u);
}

// Whoever they pretend to be: 10 000 addresses are more than there are client IDs.
TEST_F(UdpLinkTest, AnotherLinkLosesNoAnswerWhileManyPeersFlood) {
  ASSERT_TRUE(Start(0).ok());
  ASSERT_TRUE(Start(1).ok());
  Peer calm = Connect(1);
  for (int peer = 0; peer < 10'000; ++peer) {
    Peer spoofed = Connect(0);
    ASSERT_TRUE(spoofed.Send(PingOf(static_cast<uint8_t>(1 + peer % 254), 1)));
    if (peer % 100 == 0) {
      const auto number = static_cast<uint8_t>(peer / 100);
      EXPECT_TRUE(IsEcho(calm.Ask(PingOf(1, number)), 1, number));
    }
  }
}

TEST_F(UdpLinkTest, APortInUseIsToldAndTriedAgain) {
  ASSERT_TRUE(Start(0).ok());
  config_.listen.port = PortOf(server_.link(0).address());
  const Status second = Start(1);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().find("Address already in use"), std::string::npos);
  EXPECT_EQ(server_.link(1).address(), "");
  server_.link(0).Stop();
  EXPECT_TRUE(Eventually([&] { return server_.link(1).state().up; }));
  Peer robot = Connect(1);
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(1, 1)), 1, 1));
}

TEST_F(UdpLinkTest, AnAddressThatIsNoneIsAnError) {
  config_.listen.address = "1.2.3";
  EXPECT_FALSE(Start().ok());
}

}  // namespace
}  // namespace pheromone::links
