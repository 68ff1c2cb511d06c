// Servers at sockets of this process, in a time of the test's own. When the client goes on is
// ServerChoice's matter and tested there.
#include "client_fw/attach/servers.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client_fw/attach/testing/sockets.h"
#include "client_fw/boards/host/testing/server_frames.h"
#include "server/base/holders.h"

namespace pheromone::attach {
namespace {

using client::Bytes;
using client::kTestId;
using client::Sense;
using client::Sensed;

Bytes Heard(Servers* servers, int64_t now_ms) {
  pollfd waited = {servers->connection().descriptor(), POLLIN, 0};
  EXPECT_EQ(1, poll(&waited, 1, kPatienceMs));
  const std::span<const uint8_t> bytes = servers->Read(now_ms);
  return {bytes.begin(), bytes.end()};
}

std::string UdpText(uint16_t port) {
  return "udp:127.0.0.1:" + std::to_string(port);
}
std::string TcpText(uint16_t port) {
  return "127.0.0.1:" + std::to_string(port);
}

std::string Text(const Bytes& bytes) {
  return {bytes.begin(), bytes.end()};
}

// A UDP server has received `frame`, and answers it.
void Serve(const Descriptor& server, const Bytes& frame, const Bytes& answer) {
  std::array<uint8_t, 256> buffer{};
  sockaddr_in from = {};
  socklen_t size = sizeof from;
  pollfd waited = {server.get(), POLLIN, 0};
  ASSERT_EQ(1, poll(&waited, 1, kPatienceMs)) << "nothing was sent to this server";
  const ssize_t got = recvfrom(server.get(), buffer.data(), buffer.size(), 0,
                               reinterpret_cast<sockaddr*>(&from), &size);
  EXPECT_EQ(frame, Bytes(buffer.data(), buffer.data() + std::max<ssize_t>(got, 0)));
  EXPECT_EQ(static_cast<ssize_t>(answer.size()),
            sendto(server.get(), answer.data(), answer.size(), 0,
                   reinterpret_cast<sockaddr*>(&from), size));
}

TEST(Servers, UdpServerThatIsSilentIsLeftForTheNextWhichGetsTheSameFrame) {
  uint16_t first_port = 0;
  uint16_t second_port = 0;
  const Descriptor first = Bound(SOCK_DGRAM, &first_port);
  const Descriptor second = Bound(SOCK_DGRAM, &second_port);
  Servers servers({At(UdpText(first_port)), At(UdpText(second_port))}, kTestId);
  const Bytes answer = Sensed();
  servers.Advance(0);
  servers.Write(Sense(1), 1);
  Serve(first, Sense(1), answer);
  EXPECT_EQ(answer, Heard(&servers, 2));

  servers.Write(Sense(2), 200);
  servers.Choose(200 + client::kServerPatienceMs - 1);
  EXPECT_EQ(0u, servers.moves());
  servers.Choose(200 + client::kServerPatienceMs);
  EXPECT_EQ(1u, servers.moves());
  EXPECT_FALSE(servers.all_silent());
  EXPECT_EQ(UdpText(first_port) + ": no answer", servers.left());
  Serve(second, Sense(2), answer);
  EXPECT_EQ(answer, Heard(&servers, 351));
  EXPECT_EQ(0u, servers.moves());
  EXPECT_EQ(1u, servers.all_moves());
  EXPECT_EQ(UdpText(second_port), servers.connection().address().text);
}

TEST(Servers, UdpPortThatNobodyHasIsLeftAtOnce) {
  uint16_t dead = 0;
  { const Descriptor briefly = Bound(SOCK_DGRAM, &dead); }
  uint16_t port = 0;
  const Descriptor server = Bound(SOCK_DGRAM, &port);
  Servers servers({At(UdpText(dead)), At(UdpText(port))}, kTestId);
  servers.Advance(0);
  servers.Write(Sense(1), 0);
  EXPECT_EQ(Bytes(), Heard(&servers, 0));  // the system says that nobody is there
  servers.Choose(0);
  EXPECT_EQ(1u, servers.moves());
  EXPECT_EQ(UdpText(dead) + ": nobody is there", servers.left());
  Serve(server, Sense(1), Sensed());
}

TEST(Servers, TcpServerThatClosesIsLeftAtOnceAndTheNextGetsTheFrameWhenItIsConnected) {
  TcpServer first;
  TcpServer second;
  Servers servers({At(TcpText(first.port())), At(TcpText(second.port()))}, kTestId);
  const auto connect = [&servers](int64_t now_ms) {
    if (servers.connection().poll_events() == POLLOUT) {
      pollfd waited = {servers.connection().descriptor(), POLLOUT, 0};
      ASSERT_EQ(1, poll(&waited, 1, kPatienceMs));
    }
    servers.Advance(now_ms);
    servers.Choose(now_ms);
  };
  servers.Advance(0);
  servers.Write(Sense(1), 0);  // not connected yet
  connect(1);
  {
    const Descriptor peer = first.Accept();
    EXPECT_EQ(Text(Sense(1)), ReadFrom(peer));
    const Bytes answer = Sensed();
    ASSERT_TRUE(WriteAll(peer.get(), Text(answer)));
    EXPECT_EQ(answer, Heard(&servers, 2));
    servers.Write(Sense(2), 3);
  }
  EXPECT_EQ(Bytes(), Heard(&servers, 3));
  servers.Choose(3);
  EXPECT_EQ(1u, servers.moves());
  connect(4);
  const Descriptor peer = second.Accept();
  EXPECT_EQ(Text(Sense(2)), ReadFrom(peer));
}

TEST(Servers, HelloBesideTellsThatTheServerHasAnotherEpoch) {
  uint16_t dead = 0;
  uint16_t port = 0;
  auto gone = std::make_unique<Descriptor>(Bound(SOCK_DGRAM, &dead));
  const Descriptor server = Bound(SOCK_DGRAM, &port);
  Servers servers({At(UdpText(dead)), At(UdpText(port))}, kTestId);
  servers.Advance(0);
  servers.Write(client::Hello(), 0);
  Serve(*gone, client::Hello(), client::Greeting(3));
  Heard(&servers, 1);
  gone.reset();
  servers.Write(Sense(1), 2);
  Heard(&servers, 2);
  servers.Choose(2);
  Serve(server, Sense(1), Sensed());
  Heard(&servers, 3);
  servers.Choose(4);
  Serve(server, client::Hello(), client::Greeting(4));
  EXPECT_FALSE(servers.TakeNewEpoch());
  Heard(&servers, 5);
  EXPECT_TRUE(servers.TakeNewEpoch());
}

TEST(CheckServers, SeveralAreAllReachedInTheSameWay) {
  const Address tcp = At("127.0.0.1:1");
  const Address udp = At("udp:127.0.0.1:1");
  const Address serial = At("/dev/ttyUSB0");
  Address paced = tcp;
  paced.paced = true;
  for (const std::vector<Address>& good :
       {std::vector{tcp}, {udp}, {serial}, {paced}, {tcp, tcp}, {udp, udp, udp}}) {
    EXPECT_TRUE(CheckServers(good).ok());
  }
  EXPECT_EQ("/dev/ttyUSB0: one of several servers, expected HOST:PORT or udp:HOST:PORT",
            CheckServers({serial, serial}).error());
  EXPECT_EQ(
      "127.0.0.1:1 and udp:127.0.0.1:1: expected several servers either all by TCP or all "
      "by UDP",
      CheckServers({tcp, udp}).error());
  EXPECT_EQ("several servers have no modem whose bit rate could be given",
            CheckServers({paced, paced}).error());
}

}  // namespace
}  // namespace pheromone::attach
