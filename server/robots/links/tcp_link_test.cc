#include "server/robots/links/tcp_link.h"

#include <gtest/gtest.h>

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

class TcpLinkTest : public ::testing::Test {
 protected:
  Status Start(engine::LinkIndex index = 0) {
    config_.name = index == 0 ? "radio-a" : "radio-b";
    return server_.Start(MakeTcpLink(server_.io(), config_, server_.Context(index)));
  }

  Peer Connect() { return ConnectTo(server_.link(), SOCK_STREAM); }

  LinkConfig config_{.listen = {"127.0.0.1", 0}, .gap_timeout_ms = 10'000};
  testing::Server server_;
};

TEST_F(TcpLinkTest, APingIsAnswered) {
  ASSERT_TRUE(Start().ok());
  EXPECT_EQ(server_.link().address().find("127.0.0.1:"), 0u);
  Peer robot = Connect();
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 1)), 3, 1));
}

TEST_F(TcpLinkTest, Ipv6IsListenedOnAndToldInBrackets) {
  config_.listen.address = "::1";
  if (!Start().ok()) {
    GTEST_SKIP() << "no IPv6 here";
  }
  EXPECT_EQ(server_.link().address().find("[::1]:"), 0u);
  Peer robot = ConnectToIpv6(server_.link(), SOCK_STREAM);
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 1)), 3, 1));
}

TEST_F(TcpLinkTest, TwoRobotsOnTwoConnectionsGetTheirOwnAnswers) {
  ASSERT_TRUE(Start().ok());
  Peer a = Connect();
  Peer b = Connect();
  for (uint8_t i = 0; i < 100; ++i) {
    ASSERT_TRUE(a.Send(PingOf(1, i)));
    ASSERT_TRUE(b.Send(PingOf(2, i)));
    EXPECT_TRUE(IsEcho(b.Receive(), 2, i));
    EXPECT_TRUE(IsEcho(a.Receive(), 1, i));
  }
}

TEST_F(TcpLinkTest, AReconnectIsTheSameRobot) {
  ASSERT_TRUE(Start().ok());
  Peer robot = Connect();
  ASSERT_TRUE(robot.Ask(Hello(1, 5)));
  const auto first = robot.Ask(Deposit(1, 9));
  ASSERT_TRUE(first);
  const uint64_t hash = server_.service().StateHash();
  robot.HangUp();
  Peer again = Connect();
  const auto second = again.Ask(Deposit(1, 9));
  ASSERT_TRUE(second);
  EXPECT_TRUE(engine::testing::SameMessage(*first, *second));
  EXPECT_EQ(server_.service().StateHash(), hash);
}

TEST_F(TcpLinkTest, CommandsGoWhereTheRobotSpokeLast) {
  ASSERT_TRUE(Start().ok());
  Peer before = Connect();
  ASSERT_TRUE(before.Ask(Hello(1, 5)));
  Peer now = Connect();
  ASSERT_TRUE(now.Ask(PingOf(1, 1)));
  ASSERT_TRUE(server_.Halt(1).ok());
  const auto command = now.Receive();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->opcode, protocol::kCommand);
  EXPECT_TRUE(IsEcho(before.Ask(PingOf(2, 2)), 2, 2));  // and nothing came before it
}

TEST_F(TcpLinkTest, AnAnswerThatHadToWaitGoesToTheConnectionThatAskedForItLast) {
  ASSERT_TRUE(Start().ok());
  Peer before = Connect();
  ASSERT_TRUE(before.Ask(Hello(1, 5)));
  server_.log().GetStuck();
  ASSERT_TRUE(before.Send(Deposit(1, 9)));
  ASSERT_TRUE(Eventually([&] { return server_.service().held_answers() == 1; }));
  Peer now = Connect();
  ASSERT_TRUE(now.Send(Deposit(1, 9)));
  ASSERT_TRUE(now.Ask(PingOf(2, 1)));  // both were read
  Peer other = Connect();
  ASSERT_TRUE(other.Ask(PingOf(1, 1)));  // speaks last, and asks for something else
  server_.GoOn();
  EXPECT_EQ(now.Receive()->opcode, 0xA1);
  for (Peer* peer : {&before, &now, &other}) {
    EXPECT_TRUE(IsEcho(peer->Ask(PingOf(3, 7)), 3, 7));  // and nothing comes before it
  }
  EXPECT_EQ(server_.link().counters().undeliverable, 0u);
}

TEST_F(TcpLinkTest, AnAnswerToAConnectionThatHasEndedGoesToNoOther) {
  config_.max_connections = 1;
  ASSERT_TRUE(Start().ok());
  Peer before = Connect();
  ASSERT_TRUE(before.Ask(Hello(1, 5)));
  server_.log().GetStuck();
  ASSERT_TRUE(before.Send(Deposit(1, 9)));
  ASSERT_TRUE(Eventually([&] { return server_.service().held_answers() == 1; }));
  Peer now = Connect();  // for which the other one goes
  ASSERT_TRUE(now.Ask(PingOf(1, 1)));
  server_.GoOn();
  EXPECT_TRUE(Eventually([&] { return server_.link().counters().undeliverable == 1; }));
  EXPECT_TRUE(IsEcho(now.Ask(PingOf(1, 2)), 1, 2));
  EXPECT_EQ(now.Ask(Deposit(1, 9))->opcode, 0xA1);  // it is there to be fetched
}

TEST_F(TcpLinkTest, AnAnswerThatNobodyWaitsForAnyLongerIsNotSentButCounted) {
  ASSERT_TRUE(Start().ok());
  Peer robot = Connect();
  ASSERT_TRUE(robot.Ask(PingOf(1, 1)));
  server_.link().Send({testing::AnswerAfter(kLongestWait + milliseconds(1), PingOf(1, 2)),
                       testing::AnswerAfter(milliseconds(0), PingOf(1, 3))});
  EXPECT_EQ(robot.Receive()->data[0], 3);
  EXPECT_EQ(server_.link().counters().late_answers, 1u);
}

TEST_F(TcpLinkTest, ABroadcastReachesEveryConnection) {
  ASSERT_TRUE(Start().ok());
  Peer a = Connect();
  Peer b = Connect();
  ASSERT_TRUE(a.Ask(Hello(1, 5)));
  ASSERT_TRUE(b.Ask(Hello(2, 5)));
  ASSERT_TRUE(server_.Halt(protocol::kBroadcastId).ok());
  EXPECT_EQ(a.Receive()->id, protocol::kBroadcastId);
  EXPECT_EQ(b.Receive()->id, protocol::kBroadcastId);
}

TEST_F(TcpLinkTest, AnEchoOfTheServersFramesDoesNotTakeOverARobotsAddress) {
  ASSERT_TRUE(Start().ok());
  Peer robot = Connect();
  ASSERT_TRUE(robot.Ask(Hello(1, 5)));
  Peer echo = Connect();
  protocol::Message answer = PingOf(1, 1);
  answer.opcode = protocol::kPingAnswer;
  ASSERT_TRUE(echo.Send(answer));
  ASSERT_TRUE(Eventually([&] { return server_.link().counters().received.frames == 2; }));
  ASSERT_TRUE(server_.Halt(1).ok());
  EXPECT_TRUE(robot.Receive());
}

TEST_F(TcpLinkTest, HalfAFrameAndAHangUpHarmNobody) {
  ASSERT_TRUE(Start().ok());
  std::vector<uint8_t> half = Wire(PingOf(3, 1));
  half.resize(half.size() / 2);
  Peer rude = Connect();
  ASSERT_TRUE(rude.SendBytes(half));
  rude.HangUp();
  Peer robot = Connect();
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 2)), 3, 2));
  EXPECT_EQ(server_.link().counters().received.frames, 1u);
}

TEST_F(TcpLinkTest, AClientThatHangsUpBeforeItsAnswersHarmsNobody) {
  ASSERT_TRUE(Start().ok());
  for (int round = 0; round < 20; ++round) {
    Peer rude = Connect();
    for (uint8_t i = 0; i < 50; ++i) {
      ASSERT_TRUE(rude.Send(PingOf(3, i)));
    }
    const linger now{1, 0};  // a reset, not an orderly end
    setsockopt(rude.descriptor(), SOL_SOCKET, SO_LINGER, &now, sizeof now);
    rude.HangUp();
  }
  Peer robot = Connect();
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(4, 2)), 4, 2));
}

TEST_F(TcpLinkTest, EveryClientIdMayHaveAConnection) {
  ASSERT_TRUE(Start().ok());
  std::vector<Peer> robots;
  for (uint8_t id = 1; id <= 254; ++id) {
    robots.push_back(Connect());
    ASSERT_TRUE(robots.back().Ask(PingOf(id, 1)));
  }
  for (uint8_t id = 1; id <= 254; ++id) {
    EXPECT_TRUE(IsEcho(robots[id - 1u].Ask(PingOf(id, 2)), id, 2));
  }
  EXPECT_EQ(server_.link().counters().dropped_connections, 0u);
}

TEST_F(TcpLinkTest, WhenThereIsNoRoomTheConnectionSilentForLongestGoes) {
  config_.max_connections = 2;
  ASSERT_TRUE(Start().ok());
  Peer a = Connect();
  ASSERT_TRUE(a.Ask(PingOf(1, 1)));
  Peer b = Connect();
  ASSERT_TRUE(b.Ask(PingOf(2, 1)));
  ASSERT_TRUE(a.Ask(PingOf(1, 2)));
  Peer c = Connect();
  EXPECT_TRUE(IsEcho(c.Ask(PingOf(3, 1)), 3, 1));
  EXPECT_TRUE(b.SeesTheEnd());
  EXPECT_TRUE(IsEcho(a.Ask(PingOf(1, 3)), 1, 3));
  EXPECT_EQ(server_.link().counters().dropped_connections, 1u);
}

// Also one that sends what is no frame, or speaks as a client that is not served.
TEST_F(TcpLinkTest, StrangersGoBeforeARobotThatIsSilentForLonger) {
  config_.max_connections = 4;
  config_.admission.clients.reset().set(1).set(0).set(protocol::kBroadcastId);
  ASSERT_TRUE(Start().ok());
  Peer robot = Connect();
  ASSERT_TRUE(robot.Ask(PingOf(1, 1)));
  std::vector<Peer> strangers;
  const std::vector<uint8_t> said[] = {
      {}, {1, 2, 3}, Wire(PingOf(9, 1)) /* not served */, Wire(PingOf(0, 1)), {}, {}};
  uint64_t bytes = server_.link().counters().bytes_in;
  for (size_t i = 0; i < std::size(said); ++i) {
    strangers.push_back(Connect());
    bytes += said[i].size();
    ASSERT_TRUE(strangers.back().SendBytes(said[i]));
    ASSERT_TRUE(Eventually([&] {
      const LinkCounters counters = server_.link().counters();
      return counters.opened == 2 + i && counters.bytes_in == bytes;
    }));
    if (i >= 3) {
      EXPECT_TRUE(strangers[i - 3].SeesTheEnd()) << i;  // who came first
    }
  }
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(1, 2)), 1, 2));
  EXPECT_EQ(server_.link().counters().dropped_connections, 3u);
}

TEST_F(TcpLinkTest, APortInUseIsToldAndTriedAgain) {
  ASSERT_TRUE(Start(0).ok());
  config_.listen.port = PortOf(server_.link(0).address());
  const Status second = Start(1);
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().find("Address already in use"), std::string::npos);
  EXPECT_EQ(server_.link(1).address(), "");
  server_.link(0).Stop();
  EXPECT_TRUE(Eventually([&] { return server_.link(1).state().up; }));
}

// One that listens, but has no descriptor left for who calls, waits too: that is no attempt.
TEST(LinkRecordTest, OnlyALinkThatIsDownHasANextAttempt) {
  const auto soon = std::chrono::steady_clock::now() + std::chrono::seconds(1);
  LinkRecord record;
  record.SetUp("somewhere");
  record.SetNextAttempt(soon);
  EXPECT_FALSE(record.state().next_attempt.has_value());
  record.SetDown("gone");
  record.SetNextAttempt(soon);
  EXPECT_EQ(record.state().next_attempt, soon);
}

TEST_F(TcpLinkTest, AnAddressThatIsNoneIsAnError) {
  config_.listen.address = "1.2.3";
  EXPECT_FALSE(Start().ok());
}

TEST_F(TcpLinkTest, StopEndsEveryConnection) {
  ASSERT_TRUE(Start().ok());
  Peer a = Connect();
  Peer b = Connect();
  ASSERT_TRUE(a.Ask(PingOf(1, 1)));
  server_.Stop();
  EXPECT_TRUE(a.SeesTheEnd());
  EXPECT_TRUE(b.SeesTheEnd());
}

}  // namespace
}  // namespace pheromone::links
