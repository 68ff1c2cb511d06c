// Serial links, through libserialport, on pseudo-terminals: testing/pty_as_serial_shim.c is linked
// in. What a pseudo-terminal cannot show: baud rates, adapters that really vanish.
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <atomic>
#include <fstream>
#include <stdexcept>

#include "server/robots/links/testing/serial_bench.h"

namespace pheromone::links {
namespace {

using engine::testing::Hello;
using std::chrono::milliseconds;
using testing::Eventually;
using testing::IsEcho;
using testing::Peer;
using testing::PingOf;
using testing::SerialLinkTest;
using testing::Wire;

TEST_F(SerialLinkTest, APingIsAnsweredThroughLibserialport) {
  for (const uint32_t baud : {9600u, 115200u, 250000u}) {
    Peer radio = PlugIn();
    config_.baud = baud;
    testing::Server server;
    ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok()) << baud;
    for (int byte = 0; byte < 256; ++byte) {
      EXPECT_TRUE(
          IsEcho(radio.Ask(PingOf(3, static_cast<uint8_t>(byte))), 3, static_cast<uint8_t>(byte)));
    }
  }
}

TEST_F(SerialLinkTest, ThePortIsRawAndExclusiveAndAnIdleLineIsNotItsEnd) {
  Peer radio = PlugIn();
  const Descriptor beside(open(slave_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  ASSERT_TRUE(Start().ok());
  termios mode{};
  ASSERT_EQ(tcgetattr(beside.get(), &mode), 0);
  EXPECT_EQ(mode.c_lflag & (ICANON | ECHO | ISIG), 0u);
  EXPECT_EQ(mode.c_iflag & (IXON | IXOFF | ICRNL), 0u);
  EXPECT_EQ(mode.c_cc[VMIN], 1);
  EXPECT_EQ(cfgetospeed(&mode), static_cast<speed_t>(B9600));
  int exclusive = 0;
  ASSERT_EQ(ioctl(beside.get(), TIOCGEXCL, &exclusive), 0);
  EXPECT_EQ(exclusive, 1);
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  EXPECT_EQ(server_.link().counters().opened, 1u);  // an end would have opened it again
}

TEST_F(SerialLinkTest, AReadThatBringsNothingIsNoHangUp) {
  Peer radio = PlugIn();
  const Descriptor beside(open(slave_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  ASSERT_TRUE(Start().ok());
  termios mode{};
  ASSERT_EQ(tcgetattr(beside.get(), &mode), 0);
  mode.c_cc[VMIN] = 0;  // a read of an idle line gives 0, as after a hang-up
  ASSERT_EQ(tcsetattr(beside.get(), TCSANOW, &mode), 0);
  for (uint8_t i = 1; i <= 20; ++i) {
    EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, i)), 3, i));
  }
  EXPECT_EQ(server_.link().counters().opened, 1u);
}

TEST_F(SerialLinkTest, APortThatIsUnpluggedAndPluggedInAgainServesOn) {
  for (uint8_t round = 1; round <= 3; ++round) {
    Peer radio = PlugIn();
    if (round == 1) {
      ASSERT_TRUE(Start().ok());
    }
    ASSERT_TRUE(Up());
    EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, round)), 3, round));
    ASSERT_EQ(unlink(path_.c_str()), 0);
    radio.HangUp();
    ASSERT_TRUE(Eventually([this] {
      return server_.link().state().reason.find("No such file") != std::string::npos;
    }));
  }
  EXPECT_EQ(server_.link().counters().opened, 3u);
  EXPECT_EQ(server_.lines()[1], "link radio-a: down, the other side hung up; retrying");
}

TEST_F(SerialLinkTest, APortThatIsAbsentAtFirstIsTriedAgain) {
  const Status status = Start();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error(), path_ + ": No such file or directory");
  Peer radio = PlugIn();
  ASSERT_TRUE(Up());
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
}

TEST_F(SerialLinkTest, TheStateTellsSinceWhenHowOftenAndWhenItIsTriedAgain) {
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_FALSE(Start().ok());
  ASSERT_TRUE(Eventually([this] { return server_.link().state().failed_attempts >= 3; }));
  ASSERT_TRUE(Eventually([this] { return server_.link().state().next_attempt.has_value(); }));
  const LinkRecord::State down = server_.link().state();
  EXPECT_FALSE(down.up);
  EXPECT_EQ(down.reason, path_ + ": No such file or directory");
  EXPECT_GE(down.since, begin);
  Peer radio = PlugIn();
  ASSERT_TRUE(Up());
  const LinkRecord::State up = server_.link().state();
  EXPECT_GT(up.since, down.since);
  EXPECT_EQ(up.failed_attempts, 0u);
  EXPECT_FALSE(up.next_attempt.has_value());
}

TEST_F(SerialLinkTest, AUsbAdapterIsTakenWhereverItAppears) {
  config_.path.clear();
  config_.usb = UsbIdentity{0x0403, 0x6001, ""};
  std::atomic<int> adapters = 0;
  const auto list = [&adapters, this] {
    std::vector<UsbPort> ports = {{"/dev/null", {0x1a86, 0x7523, ""}}};
    for (int i = 0; i < adapters; ++i) {
      ports.push_back({i == 0 ? path_ : "/dev/other", {0x0403, 0x6001, std::to_string(i)}});
    }
    return ports;
  };
  const auto waits_for = [this](const std::string& reason) {
    return Eventually([&] { return server_.link().state().reason == reason; });
  };
  Peer radio = PlugIn();
  EXPECT_EQ(Start(list).error(), "no USB adapter 0403:6001; found 1a86:7523 at /dev/null");
  EXPECT_EQ(server_.link().address(), "USB 0403:6001");
  adapters = 2;
  EXPECT_TRUE(waits_for(
      "more than one USB adapter 0403:6001: 0403:6001:0 at " + path_ +
      ", 0403:6001:1 at /dev/other; specify its serial number, or configure its port instead"));
  adapters = 1;
  EXPECT_TRUE(waits_for("serial USB 0403:6001 at 9600 baud"));
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
}

TEST_F(SerialLinkTest, AnExceptionWhileAPortIsOpenedIsToldAndItIsTriedAgain) {
  config_.path.clear();
  config_.usb = UsbIdentity{0x0403, 0x6001, ""};
  std::atomic<int> asked = 0;
  const auto list = [&asked, this] {
    if (++asked <= 2) {  // at the start, and when it is tried again
      throw std::runtime_error("the bus is gone");
    }
    return std::vector<UsbPort>{{path_, {0x0403, 0x6001, ""}}};
  };
  Peer radio = PlugIn();
  EXPECT_EQ(Start(list).error(), "internal error: the bus is gone");
  ASSERT_TRUE(Up());
  EXPECT_EQ(asked, 3);
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  EXPECT_EQ(server_.lines()[0], "link radio-a: down, internal error: the bus is gone; retrying");
}

TEST_F(SerialLinkTest, APortThatAnotherHoldsIsBusyUntilItIsLetGo) {
  Peer radio = PlugIn();
  Descriptor other(open(slave_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  ASSERT_EQ(flock(other.get(), LOCK_EX), 0);
  const Status status = Start();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().find(path_ + ": busy, held by "), 0u) << status.error();
  termios mode{};
  ASSERT_EQ(tcgetattr(other.get(), &mode), 0);
  EXPECT_NE(mode.c_lflag & ICANON, 0u);  // its settings are left alone: a link would make it raw
  other = Descriptor();
  ASSERT_TRUE(Up());
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  const Descriptor late(open(slave_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC));
  EXPECT_NE(flock(late.get(), LOCK_EX | LOCK_NB), 0);  // now it is ours
}

TEST_F(SerialLinkTest, AModemThatFallsSilentIsTold) {
  config_.silence_s = 1;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  ASSERT_TRUE(Eventually([this] { return server_.link().state().silent; }));
  EXPECT_TRUE(server_.link().state().up);  // a warning and no more
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 2)), 3, 2));
  ASSERT_TRUE(Eventually([this] { return !server_.link().state().silent; }));
  const std::vector<std::string> lines = server_.lines();
  ASSERT_GE(lines.size(), 3u);
  EXPECT_EQ(lines[1], "link radio-a: nothing received for 1 s; check the modem and the robots");
  EXPECT_EQ(lines[2], "link radio-a: receiving again");
}

TEST_F(SerialLinkTest, ClientsThatAreNotListedGetNoAnswer) {
  config_.admission.clients.reset().set(3);
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  ASSERT_TRUE(radio.Send(PingOf(4, 1)));
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 2)), 3, 2));
  EXPECT_EQ(server_.link().counters().not_allowed, 1u);
}

TEST_F(SerialLinkTest, AFileThatIsNoPortIsAnError) {
  std::ofstream(path_) << "x";
  const Status status = Start();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error(), path_ + ": not a serial port");
}

TEST_F(SerialLinkTest, StopWhileUpAndWhileDownIsClean) {
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  server_.Stop();
  EXPECT_TRUE(radio.SeesTheEnd());

  testing::Server second;
  config_.path = folder_ / "none";
  LinkContext context = second.Context(0);
  context.backoff = {milliseconds(60'000), milliseconds(60'000), 1};  // Stop need not wait for it
  EXPECT_FALSE(second.Start(MakeSerialLink(second.io(), config_, context)).ok());
}

// The robot's modem is still turning round. One that is keyed by a line does not add to that.
TEST_F(SerialLinkTest, AnAnswerWaitsForTheRobotsModem) {
  config_.turnaround_ms = 150;
  config_.lines.ptt = Ptt::kRts;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  const auto asked = std::chrono::steady_clock::now();
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  EXPECT_GE(std::chrono::steady_clock::now() - asked, milliseconds(151));
}

// With a gap longer than the window no answer is ever in time.
TEST_F(SerialLinkTest, AnAnswerThatCannotStartWithinTheWindowIsNotSentButCounted) {
  config_.turnaround_ms = 50;
  config_.response_window_ms = 10;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  ASSERT_TRUE(radio.Send(Hello(1, 5)));
  ASSERT_TRUE(radio.Send(PingOf(1, 1)));
  ASSERT_TRUE(Eventually([this] { return server_.link().counters().late_answers == 2; }));
  ASSERT_EQ(tap_.dropped().size(), 2u);
  EXPECT_EQ(tap_.dropped()[1].opcode, protocol::kPingAnswer);
  // What nobody waits for has no window: it goes when the line is idle.
  ASSERT_TRUE(server_.Halt(1).ok());
  const auto command = radio.Receive();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->opcode, protocol::kCommand);
  EXPECT_TRUE(Eventually([this] { return server_.link().counters().frames_out == 1; }));
}

// Those that had to wait for the log, too: the window is the robot's that asked.
TEST_F(SerialLinkTest, AnAnswerThatHadToWaitIsSentWithinItsWindowAndNotAfterIt) {
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  ASSERT_TRUE(radio.Ask(PingOf(1, 1)));
  const milliseconds window(config_.response_window_ms);
  server_.link().Send({testing::AnswerAfter(window + milliseconds(1), PingOf(1, 2)),
                       testing::AnswerAfter(window / 2, PingOf(1, 3))});
  EXPECT_EQ(radio.Receive()->data[0], 3);
  EXPECT_EQ(server_.link().counters().late_answers, 1u);
  ASSERT_EQ(tap_.dropped().size(), 1u);
  EXPECT_TRUE(engine::testing::SameMessage(tap_.dropped()[0], PingOf(1, 2)));
}

// The command is there first, but must wait until the line is idle for G_s + 2 B; the robot that
// asks meanwhile is answered after G_s.
TEST_F(SerialLinkTest, AnAnswerGoesBeforeACommandThatWaitsForAnIdleLine) {
  config_.turnaround_ms = 500;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  ASSERT_TRUE(radio.Ask(Hello(1, 5)));
  ASSERT_TRUE(server_.Halt(1).ok());
  ASSERT_TRUE(radio.Send(PingOf(3, 1)));
  ASSERT_TRUE(radio.Send(PingOf(3, 2)));
  EXPECT_TRUE(IsEcho(radio.Receive(), 3, 1));
  EXPECT_TRUE(IsEcho(radio.Receive(), 3, 2));
  const auto command = radio.Receive();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->opcode, protocol::kCommand);
}

TEST_F(SerialLinkTest, ErrorsAreSentOnceInAResponseWindow) {
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  protocol::Message unknown;
  unknown.id = 1;
  unknown.opcode = 0x7A;
  std::vector<uint8_t> bytes;
  for (const protocol::Message& message : {unknown, unknown, PingOf(1, 1)}) {
    const std::vector<uint8_t> frame = Wire(message);
    bytes.insert(bytes.end(), frame.begin(), frame.end());
  }
  ASSERT_TRUE(radio.SendBytes(bytes));
  EXPECT_EQ(engine::testing::ReasonOf(*radio.Receive()), protocol::Reason::kUnknownOpcode);
  EXPECT_TRUE(IsEcho(radio.Receive(), 1, 1));
  EXPECT_EQ(server_.link().counters().withheld_errors, 1u);
  ASSERT_EQ(tap_.dropped().size(), 1u);
  EXPECT_EQ(tap_.dropped()[0].opcode, protocol::kError);
}

// A frame whose end is lost: the silence after it discards it, and the next one is answered.
TEST_F(SerialLinkTest, AGapInsideAFrameDiscardsIt) {
  config_.gap_timeout_ms = 20;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  std::vector<uint8_t> half = Wire(PingOf(3, 1));
  half.resize(half.size() / 2);
  ASSERT_TRUE(radio.SendBytes(half));
  ASSERT_TRUE(Eventually([&] { return server_.link().counters().bytes_in == half.size(); }));
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(
      Eventually([&] { return std::chrono::steady_clock::now() - begin > milliseconds(30); }));
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 2)), 3, 2));
  EXPECT_EQ(server_.link().counters().received.timeouts, 1u);
}

}  // namespace
}  // namespace pheromone::links
