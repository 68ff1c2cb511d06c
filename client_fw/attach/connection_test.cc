// Connections to real sockets and pseudo-terminals of this process, in a time of the test's own.
#include "client_fw/attach/connection.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <string_view>

#include "client_fw/attach/testing/sockets.h"
#include "server/base/holders.h"
#include "server/base/testing/temporary_folder.h"

namespace pheromone::attach {
namespace {

// A pseudo-terminal's master; what stands in for a cable.
struct Cable {
  Cable() : master(posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_EQ(0, grantpt(master.get()));
    EXPECT_EQ(0, unlockpt(master.get()));
    std::array<char, 64> text{};
    EXPECT_EQ(0, ptsname_r(master.get(), text.data(), text.size()));
    name = text.data();
  }

  Descriptor master;
  std::string name;
};

void AwaitEvent(const Connection& connection) {
  pollfd waited = {connection.descriptor(), connection.poll_events(), 0};
  ASSERT_EQ(1, poll(&waited, 1, kPatienceMs));
}

// Opens it, or finishes opening it; the network may take a moment.
void Connect(Connection* connection, int64_t now_ms) {
  connection->Advance(now_ms);
  if (connection->poll_events() == POLLOUT) {
    AwaitEvent(*connection);
    connection->Advance(now_ms);
  }
}

std::string Received(Connection* connection, int64_t now_ms) {
  AwaitEvent(*connection);
  const std::span<const uint8_t> bytes = connection->Read(now_ms);
  return {bytes.begin(), bytes.end()};
}

void Send(Connection* connection, std::string_view text, int64_t now_ms) {
  connection->Write({reinterpret_cast<const uint8_t*>(text.data()), text.size()}, now_ms);
}

TEST(Connection, SpeaksTcpAndReturnsAfterTheOtherSideHasClosed) {
  TcpServer server;
  Connection connection(At("127.0.0.1:" + std::to_string(server.port())));
  EXPECT_FALSE(connection.up());
  Connect(&connection, 0);
  ASSERT_TRUE(connection.up()) << connection.trouble();
  {
    const Descriptor peer = server.Accept();
    Send(&connection, "there", 1);
    EXPECT_EQ("there", ReadFrom(peer));
    ASSERT_TRUE(WriteAll(peer.get(), "back"));
    EXPECT_EQ("back", Received(&connection, 2));
    EXPECT_TRUE(connection.Read(2).empty());
    EXPECT_TRUE(connection.up());
  }
  EXPECT_EQ("", Received(&connection, 100));
  EXPECT_FALSE(connection.up());
  EXPECT_EQ("closed by the other side", connection.trouble());
  EXPECT_EQ(1u, connection.losses());
  Send(&connection, "nobody", 101);

  connection.Advance(100 + kRetryMs - 1);
  EXPECT_EQ(-1, connection.descriptor());
  Connect(&connection, 100 + kRetryMs);
  EXPECT_TRUE(connection.up());
  const Descriptor peer = server.Accept();
  Send(&connection, "again", 700);
  EXPECT_EQ("again", ReadFrom(peer));  // and nothing of what was sent before
}

TEST(Connection, TriesAgainWhereNobodyListens) {
  uint16_t port = 0;
  {
    const TcpServer briefly;
    port = briefly.port();
  }
  Connection connection(At("127.0.0.1:" + std::to_string(port)));
  Connect(&connection, 0);
  EXPECT_FALSE(connection.up());
  EXPECT_EQ("Connection refused", connection.trouble());
  TcpServer server(port);
  Connect(&connection, kRetryMs - 1);
  EXPECT_FALSE(connection.up());
  Connect(&connection, kRetryMs);
  EXPECT_TRUE(connection.up());
  EXPECT_EQ(0u, connection.losses());  // it was never there
}

TEST(Connection, SilentNetworkIsConnectedAgainAndCountsAsUpWithItsFirstByte) {
  TcpServer server;
  Connection connection(At("127.0.0.1:" + std::to_string(server.port())));
  Connect(&connection, 0);
  const Descriptor silent = server.Accept();
  connection.Advance(kSilentMs - 1);
  EXPECT_TRUE(connection.up());
  connection.Advance(kSilentMs);
  EXPECT_FALSE(connection.up());
  EXPECT_EQ("nothing received for 3 s", connection.trouble());
  EXPECT_EQ(1u, connection.losses());

  Connect(&connection, kSilentMs + kRetryMs);
  const Descriptor alive = server.Accept();
  EXPECT_FALSE(connection.up());
  Send(&connection, "anyone?", kSilentMs + kRetryMs);  // nothing would ever come otherwise
  EXPECT_EQ("anyone?", ReadFrom(alive));
  connection.Advance(2 * kSilentMs + kRetryMs);
  EXPECT_EQ(1u, connection.losses());  // still the same loss

  Connect(&connection, 2 * kSilentMs + 2 * kRetryMs);
  const Descriptor third = server.Accept();
  ASSERT_TRUE(WriteAll(third.get(), "yes"));
  EXPECT_EQ("yes", Received(&connection, 2 * kSilentMs + 2 * kRetryMs));
  EXPECT_TRUE(connection.up());
}

TEST(Connection, UdpSendsWholeFramesAndBearsAnAbsentServer) {
  uint16_t port = 0;
  { const Descriptor briefly = Bound(SOCK_DGRAM, &port); }
  Connection connection(At("udp:127.0.0.1:" + std::to_string(port)));
  Connect(&connection, 0);
  for (int i = 0; i < 3; ++i) {  // the system says that nobody is there
    Send(&connection, "lost", i);
    EXPECT_TRUE(connection.Read(i).empty());
  }
  EXPECT_TRUE(connection.up());

  const Descriptor server = Bound(SOCK_DGRAM, &port);
  Send(&connection, "one", 4);
  Send(&connection, "two", 4);
  EXPECT_EQ("one", ReadFrom(server));
  EXPECT_EQ("two", ReadFrom(server));
}

TEST(Connection, OpensATerminalRawAndReturnsAfterItWasUnplugged) {
  const TemporaryFolder folder;
  const std::string port = (folder / "ttyUSB0").string();
  auto cable = std::make_unique<Cable>();
  std::filesystem::create_symlink(cable->name, port);
  Connection connection(At(port));
  connection.Advance(0);
  ASSERT_TRUE(connection.up()) << connection.trouble();
  termios mode = {};
  ASSERT_EQ(0, tcgetattr(connection.descriptor(), &mode));
  EXPECT_EQ(B9600, cfgetospeed(&mode));
  EXPECT_EQ(0u, mode.c_lflag & (ICANON | ECHO | ISIG));
  EXPECT_EQ(static_cast<tcflag_t>(CLOCAL | CREAD | CS8),
            mode.c_cflag & (CLOCAL | CREAD | CSIZE | PARENB | CSTOPB | CRTSCTS));

  const std::string control = "\x03\x04\x11\x13\r\n\x7f";  // as they are, both ways
  Send(&connection, control, 1);
  EXPECT_EQ(control, ReadFrom(cable->master));
  ASSERT_TRUE(WriteAll(cable->master.get(), control));
  EXPECT_EQ(control, Received(&connection, 2));
  EXPECT_TRUE(connection.Read(2).empty());  // an idle line is not a lost one
  EXPECT_TRUE(connection.up());
  connection.Advance(10 * kSilentMs);  // nor is a silent one
  EXPECT_TRUE(connection.up());

  cable.reset();
  EXPECT_EQ("", Received(&connection, 40'000));
  EXPECT_FALSE(connection.up());
  EXPECT_EQ(1u, connection.losses());
  std::filesystem::remove(port);
  connection.Advance(40'000 + kRetryMs);
  EXPECT_EQ("No such file or directory", connection.trouble());

  const Cable next;
  std::filesystem::create_symlink(next.name, port);
  connection.Advance(40'000 + 2 * kRetryMs);
  EXPECT_TRUE(connection.up()) << connection.trouble();
  ASSERT_TRUE(WriteAll(next.master.get(), "hello"));
  EXPECT_EQ("hello", Received(&connection, 42'000));
}

// The server at its other end answers at once, so a frame must not count as leaving for as long as
// it would take on a real line.
TEST(Connection, FrameHasLeftAPseudoTerminalAtOnce) {
  const Cable cable;
  Connection connection(At(cable.name));
  connection.Advance(0);
  Send(&connection, std::string(96, 'x'), 1000);
  EXPECT_TRUE(connection.drained(1000));
}

// A modem behind a pseudo-terminal of another program, or behind a TCP serial server: 96 bytes take
// 100 ms at 9600 baud, and the next frame must not begin before.
TEST(Connection, FrameLeavesALineBehindAPseudoTerminalOrTcpAtItsBitRate) {
  const Cable cable;
  TcpServer server;
  for (const std::string& where : {cable.name, "127.0.0.1:" + std::to_string(server.port())}) {
    SCOPED_TRACE(where);
    Address address = At(where);
    address.paced = true;
    Connection connection(address);
    Connect(&connection, 0);
    ASSERT_TRUE(connection.up()) << connection.trouble();
    const Descriptor peer = address.kind == Address::Kind::kTcp ? server.Accept() : Descriptor();
    Send(&connection, std::string(96, 'x'), 1000);
    EXPECT_EQ(ReadFrom(peer.valid() ? peer : cable.master).size(), 96u);
    EXPECT_FALSE(connection.drained(1099));
    EXPECT_TRUE(connection.drained(1101));
  }
}

TEST(Connection, PortServesOneProgram) {
  const Cable cable;
  Connection first(At(cable.name));
  first.Advance(0);
  ASSERT_TRUE(first.up());
  Connection second(At(cable.name));
  second.Advance(0);
  EXPECT_FALSE(second.up());
  EXPECT_TRUE(second.in_use());
  EXPECT_EQ("in use by " + DescribeProcess(getpid()), second.trouble());
}

TEST(Connection, TellsWhatIsNotATerminal) {
  const TemporaryFolder folder;
  std::ofstream(folder / "file") << "text";
  Connection connection(At((folder / "file").string()));
  connection.Advance(0);
  EXPECT_FALSE(connection.up());
  EXPECT_EQ("not a terminal device (Inappropriate ioctl for device)", connection.trouble());
}

TEST(Connection, WhatDoesNotFitIsLostAndBlocksNobody) {
  TcpServer server;
  Connection connection(At("127.0.0.1:" + std::to_string(server.port())));
  Connect(&connection, 0);
  const Descriptor stuck = server.Accept();
  const std::string much(1 << 16, 'x');
  for (int i = 0; i < 1000; ++i) {
    Send(&connection, much, 1);
  }
  EXPECT_TRUE(connection.up());
}

TEST(SerialConnection, ItsRateCanBeChangedWhileItIsOpen) {
  const Cable cable;
  Address address;
  address.kind = Address::Kind::kSerial;
  address.text = cable.name;
  address.baud = 9600;
  Connection connection(address);
  connection.Advance(0);
  ASSERT_TRUE(connection.up()) << connection.trouble();
  termios mode = {};
  ASSERT_EQ(0, tcgetattr(cable.master.get(), &mode));
  EXPECT_EQ(speed_t{B9600}, cfgetospeed(&mode));
  EXPECT_TRUE(connection.SetBaud(38'400));
  ASSERT_EQ(0, tcgetattr(cable.master.get(), &mode));
  EXPECT_EQ(speed_t{B38400}, cfgetospeed(&mode));
  EXPECT_EQ(speed_t{B38400}, cfgetispeed(&mode));
  EXPECT_FALSE(connection.SetBaud(12'345));
}

}  // namespace
}  // namespace pheromone::attach
