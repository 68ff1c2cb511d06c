// What a serial link does with modem lines and with the driver's counters: the modem and the driver
// are played by testing/pty_as_serial_shim.h.
#include <gtest/gtest.h>
#include <linux/serial.h>
#include <sys/ioctl.h>

#include <iostream>

#include "server/robots/links/testing/pty_as_serial_shim.h"
#include "server/robots/links/testing/serial_bench.h"

namespace pheromone::links {
namespace {

using std::chrono::milliseconds;
using testing::Eventually;
using testing::IsEcho;
using testing::Peer;
using testing::PingOf;

class SerialLinesTest : public testing::SerialLinkTest {
 protected:
  void TearDown() override {
    PtyShimHang(0);
    PtyShimSlow(0);
    PtyShimStopUart(0);
    server_.Stop();
    PtyShimSetUart({});
    PtyShimSetInputs(0);
    PtyShimSetRs485(0);
  }

  // A pseudo-terminal as it is, that nothing happens to.
  Peer StartAnother(testing::Server* server) {
    const LinkConfig config{.name = "radio-b", .path = folder_ / "another.pty"};
    EXPECT_TRUE(server->Start(MakePtyLink(server->io(), config, server->Context(1))).ok());
    return Peer(config.path);
  }

  LinkCounters counters() { return server_.link().counters(); }
};

TEST_F(SerialLinesTest, ADriverThatHangsWhileItsPortIsOpenedHoldsUpNoOtherLink) {
  testing::Server server(1);
  ASSERT_FALSE(
      server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());  // no port yet
  Peer other = StartAnother(&server);
  PtyShimHang(1);
  Peer radio = PlugIn();
  EXPECT_TRUE(Eventually([] { return PtyShimHeld() == 1; }));
  EXPECT_TRUE(IsEcho(other.Ask(PingOf(3, 1)), 3, 1));
  EXPECT_FALSE(server.link().state().up);
  PtyShimHang(0);
  EXPECT_TRUE(Eventually([&] { return server.link().state().up; }));
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(4, 1)), 4, 1));
}

// With one thread for all: whoever kept it would keep the other link waiting.
TEST_F(SerialLinesTest, ADriverThatHangsWhileSomethingIsSentHoldsUpNoOtherLink) {
  const ModemLines cases[] = {{CarrierSense::kDcd, Ptt::kNone, 0, 0},
                              {CarrierSense::kNone, Ptt::kRts, 0, 0}};
  for (const ModemLines& lines : cases) {
    config_.lines = lines;
    testing::Server server(1);
    Peer radio = PlugIn();
    ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
    Peer other = StartAnother(&server);
    PtyShimHang(1);
    ASSERT_TRUE(radio.Send(PingOf(3, 1)));
    ASSERT_TRUE(Eventually([] { return PtyShimHeld() == 1; }));
    for (uint8_t i = 1; i <= 20; ++i) {
      EXPECT_TRUE(IsEcho(other.Ask(PingOf(4, i)), 4, i));
    }
    ASSERT_TRUE(radio.Send(PingOf(3, 2)));  // it is still read
    EXPECT_TRUE(Eventually([&] { return server.link().counters().received.frames == 2; }));
    EXPECT_EQ(server.link().counters().frames_out, 0u);
    EXPECT_EQ(PtyShimHeld(), 1);
    PtyShimHang(0);
    EXPECT_TRUE(IsEcho(radio.Receive(), 3, 1));
    EXPECT_TRUE(IsEcho(radio.Receive(), 3, 2));
  }
}

// The last bit of one port does not leave; the other link does not notice.
TEST_F(SerialLinesTest, WaitingForTheLastBitHoldsUpNoOtherLink) {
  config_.lines.ptt = Ptt::kRts;
  testing::Server server(1);
  Peer radio = PlugIn();
  ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
  Peer other = StartAnother(&server);
  PtyShimSetUart(testing::kDrainsOnly);
  PtyShimStopUart(1);
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  ASSERT_TRUE(Eventually([] { return PtyShimAsked() >= 1; }));
  for (uint8_t i = 1; i <= 20; ++i) {
    EXPECT_TRUE(IsEcho(other.Ask(PingOf(4, i)), 4, i));
  }
  EXPECT_NE(PtyShimOutputs() & TIOCM_RTS, 0);
  PtyShimStopUart(0);
  EXPECT_TRUE(Eventually([] { return (PtyShimOutputs() & TIOCM_RTS) == 0; }));
  EXPECT_EQ(PtyShimAir().cut, 0);
  server.Stop();
}

// Printed, not judged: what another link, which shares the one thread, does meanwhile.
TEST_F(SerialLinesTest, FigureOfASlowDriverBesideAnotherLink) {
  constexpr int kCalls = 50;
  config_.lines = {CarrierSense::kDcd, Ptt::kRts, 0, 0};
  testing::Server server(1);
  Peer radio = PlugIn();
  ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
  Peer other = StartAnother(&server);
  PtyShimSlow(5);
  const int before = PtyShimCalls();
  uint64_t asked = 0;
  int answered = 0;
  while (PtyShimCalls() - before < kCalls) {
    if (server.link().counters().frames_out == asked) {
      ASSERT_TRUE(radio.Send(PingOf(3, 1)));
      ++asked;
    }
    ASSERT_TRUE(IsEcho(other.Ask(PingOf(4, 1)), 4, 1));
    ++answered;
  }
  std::cout << "for each call of 5 ms, another link answered " << answered / kCalls
            << " requests, one after the other\n";
  PtyShimSlow(0);
  server.Stop();
}

TEST_F(SerialLinesTest, ADriverThatHangsOverItsCountersHoldsUpNotEvenItsOwnLine) {
  PtyShimSetCounts({1, 1, 1, 1, 1});
  testing::Server server(1);
  Peer radio = PlugIn();
  ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
  PtyShimHang(1);
  ASSERT_TRUE(Eventually([] { return PtyShimHeld() == 1; }));
  for (uint8_t i = 1; i <= 20; ++i) {
    EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, i)), 3, i));
  }
  PtyShimSetCounts({3, 1, 1, 1, 1});
  PtyShimHang(0);
  EXPECT_TRUE(Eventually([&] { return server.link().counters().line.framing == 2; }));
}

TEST_F(SerialLinesTest, AnAnswerThatTheDriverMakesLateIsNotSentButCounted) {
  config_.lines.ptt = Ptt::kRts;
  config_.response_window_ms = 30;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  PtyShimHang(1);
  const auto asked = std::chrono::steady_clock::now();
  ASSERT_TRUE(radio.Send(PingOf(3, 1)));
  // Either it holds the call that switches, or the answer was late before that.
  ASSERT_TRUE(Eventually([&] { return PtyShimHeld() == 1 || counters().late_answers == 1; }));
  ASSERT_TRUE(
      Eventually([&] { return std::chrono::steady_clock::now() - asked > milliseconds(60); }));
  PtyShimHang(0);
  EXPECT_TRUE(Eventually([this] { return counters().late_answers == 1; }));
  EXPECT_TRUE(Eventually([] { return (PtyShimOutputs() & TIOCM_RTS) == 0; }));
  EXPECT_EQ(counters().frames_out, 0u);
  ASSERT_EQ(tap_.dropped().size(), 1u);
}

TEST_F(SerialLinesTest, ALinkThatIsStoppedWhileItsDriverHangsEndsWithTheCall) {
  const ModemLines cases[] = {{CarrierSense::kDcd, Ptt::kNone, 0, 0},
                              {CarrierSense::kNone, Ptt::kRts, 0, 0}};
  for (const ModemLines& lines : cases) {
    for (const bool unplugged : {false, true}) {
      config_.lines = lines;
      testing::Server server(1);
      Peer radio = PlugIn();
      ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
      Peer other = StartAnother(&server);
      PtyShimHang(1);
      ASSERT_TRUE(radio.Send(PingOf(3, 1)));
      ASSERT_TRUE(Eventually([] { return PtyShimHeld() == 1; }));
      if (unplugged) {
        radio.HangUp();
      }
      server.link().Stop();
      EXPECT_TRUE(IsEcho(other.Ask(PingOf(4, 1)), 4, 1));  // after the stop, on the one thread
      PtyShimHang(0);
      server.Stop();
      if (!unplugged) {  // one that is has no lines
        EXPECT_EQ(PtyShimOutputs() & TIOCM_RTS, 0);
      }
      EXPECT_FALSE(server.link().state().up);
    }
  }
}

TEST_F(SerialLinesTest, AnAnswerWaitsForTheCarrierToEnd) {
  struct {
    CarrierSense sense;
    int line;
  } const cases[] = {{CarrierSense::kDcd, TIOCM_CAR}, {CarrierSense::kCts, TIOCM_CTS}};
  for (const auto& it : cases) {
    config_.lines.carrier_sense = it.sense;
    testing::Server server;
    Peer radio = PlugIn();
    ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
    PtyShimSetInputs(it.line);
    ASSERT_TRUE(radio.Send(PingOf(3, 1)));
    EXPECT_FALSE(radio.Receive(milliseconds(50)));
    PtyShimSetInputs(TIOCM_CAR + TIOCM_CTS - it.line);  // the other line means nothing
    EXPECT_TRUE(IsEcho(radio.Receive(), 3, 1));
    PtyShimSetInputs(0);
  }
}

TEST_F(SerialLinesTest, ACarrierThatOutlastsTheWindowCostsTheAnswer) {
  config_.lines.carrier_sense = CarrierSense::kDcd;
  config_.response_window_ms = 30;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  PtyShimSetInputs(TIOCM_CAR);
  ASSERT_TRUE(radio.Send(PingOf(3, 1)));
  ASSERT_TRUE(Eventually([this] { return counters().late_answers == 1; }));
  EXPECT_EQ(counters().frames_out, 0u);
}

TEST_F(SerialLinesTest, WithoutCarrierSenseTheLinesMeanNothing) {
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  PtyShimSetInputs(TIOCM_CAR | TIOCM_CTS);
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
}

// The line is up before the first byte, for the lead, and after the last one, for the tail.
TEST_F(SerialLinesTest, ATransceiverIsSwitchedForAsLongAsThereIsSomethingToSend) {
  struct {
    Ptt ptt;
    int line;
  } const cases[] = {{Ptt::kRts, TIOCM_RTS}, {Ptt::kDtr, TIOCM_DTR}};
  for (const auto& it : cases) {
    config_.lines = {CarrierSense::kNone, it.ptt, 100, 200};
    testing::Server server;
    Peer radio = PlugIn();
    ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
    EXPECT_EQ(PtyShimOutputs() & it.line, 0);
    ASSERT_TRUE(radio.Send(PingOf(3, 1)));
    ASSERT_TRUE(Eventually([&] { return (PtyShimOutputs() & it.line) != 0; }));
    const auto keyed_at = std::chrono::steady_clock::now();
    EXPECT_TRUE(IsEcho(radio.Receive(), 3, 1));
    // What the clock says is later than it was, but never by less than what must have passed.
    EXPECT_TRUE(Eventually([&] { return (PtyShimOutputs() & it.line) == 0; }));
    EXPECT_GE(std::chrono::steady_clock::now() - keyed_at, milliseconds(200));
  }
}

// From the first bit to the last, without a tail: whatever the driver tells.
TEST_F(SerialLinesTest, ATransceiverIsKeyedForEveryBitAtEachBaudRate) {
  config_.lines.ptt = Ptt::kRts;
  for (const PtyShimUart& uart : testing::kUarts) {
    for (const uint32_t baud : {9600u, 19'200u, 38'400u, 57'600u, 115'200u}) {
      config_.baud = baud;
      testing::Server server;
      Peer radio = PlugIn();
      ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
      PtyShimSetUart(uart);
      for (uint8_t i = 1; i <= 3; ++i) {
        EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, i)), 3, i));
        ASSERT_TRUE(Eventually([] { return (PtyShimOutputs() & TIOCM_RTS) == 0; }));
        EXPECT_EQ(PtyShimAir().bytes,
                  static_cast<long long>(i * testing::Wire(PingOf(3, 1)).size()));
        EXPECT_EQ(PtyShimAir().cut, 0) << baud << " baud";
        EXPECT_GE(PtyShimAir().tail_ns, 0);
      }
      server.Stop();
      PtyShimSetUart({});
    }
  }
}

// A UART that is slower than its baud rate, or starts late.
TEST_F(SerialLinesTest, ATransceiverIsKeyedUntilTheDriverSaysThatTheLastBitHasLeft) {
  config_.lines.ptt = Ptt::kRts;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  PtyShimSetUart(testing::kDrainsOnly);
  PtyShimStopUart(1);
  const auto asked_at = std::chrono::steady_clock::now();
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  ASSERT_TRUE(Eventually([] { return PtyShimAsked() >= 1; }));
  // Longer than its bytes take.
  ASSERT_TRUE(
      Eventually([&] { return std::chrono::steady_clock::now() - asked_at > milliseconds(60); }));
  EXPECT_NE(PtyShimOutputs() & TIOCM_RTS, 0);
  PtyShimStopUart(0);
  EXPECT_TRUE(Eventually([] { return (PtyShimOutputs() & TIOCM_RTS) == 0; }));
  EXPECT_EQ(PtyShimAir().cut, 0);
}

// An answer that is longer than the FIFO. With a line to key, none of its bits can leave before the
// end begins, and its tail is part of it.
TEST_F(SerialLinesTest, ALinkThatIsStoppedWhileItSendsEndsItsFrame) {
  constexpr uint16_t kTailMs = 20;
  for (const Ptt ptt : {Ptt::kRts, Ptt::kNone}) {
    for (PtyShimUart uart : {testing::kTellsAll, testing::kDrainsOnly, testing::kDrainsEarly}) {
      config_.lines = {CarrierSense::kNone, ptt, 0, ptt == Ptt::kRts ? kTailMs : uint16_t{0}};
      uart.key_line = ptt == Ptt::kRts ? TIOCM_RTS : 0;
      uart.fifo = 1;
      testing::Server server;
      Peer radio = PlugIn();
      ASSERT_TRUE(server.Start(MakeSerialLink(server.io(), config_, server.Context(0))).ok());
      PtyShimSetUart(uart);
      PtyShimStopUart(ptt == Ptt::kRts ? 1 : 0);
      ASSERT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
      server.link().Stop();
      PtyShimStopUart(0);
      server.Stop();
      EXPECT_EQ(PtyShimAir().bytes, static_cast<long long>(testing::Wire(PingOf(3, 1)).size()));
      EXPECT_EQ(PtyShimAir().cut, 0) << (ptt == Ptt::kRts ? "keyed" : "not keyed");
      EXPECT_EQ(PtyShimOutputs() & TIOCM_RTS, 0);
      if (ptt == Ptt::kRts) {
        EXPECT_GE(PtyShimAir().tail_ns, kTailMs * 1'000'000LL);
      }
      PtyShimSetUart({});
    }
  }
}

TEST_F(SerialLinesTest, ALinkThatCannotEndItsFrameIsStoppedAllTheSame) {
  config_.lines = {CarrierSense::kNone, Ptt::kRts, 0, 60'000};
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  ASSERT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
  EXPECT_NE(PtyShimOutputs() & TIOCM_RTS, 0);
  server_.Stop();
  EXPECT_EQ(PtyShimOutputs() & TIOCM_RTS, 0);
}

TEST_F(SerialLinesTest, WhatWaitsForTheTransceiverWhenTheLineEndsIsLeftOut) {
  config_.lines = {CarrierSense::kNone, Ptt::kRts, 30'000, 0};
  config_.response_window_ms = 65'000;
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  ASSERT_TRUE(radio.Send(PingOf(3, 1)));
  ASSERT_TRUE(Eventually([] { return (PtyShimOutputs() & TIOCM_RTS) != 0; }));
  radio.HangUp();
  ASSERT_TRUE(Eventually([this] { return tap_.dropped().size() == 1; }));
  EXPECT_TRUE(IsEcho(tap_.dropped()[0], 3, 1));
  EXPECT_TRUE(tap_.written().empty());
}

TEST_F(SerialLinesTest, TheDriverIsToldToSwitchAnRs485Line) {
  PtyShimSetRs485(1);
  config_.lines = {CarrierSense::kNone, Ptt::kRs485, 3, 4};
  Peer radio = PlugIn();
  ASSERT_TRUE(Start().ok());
  const PtyShimRs485 told = PtyShimGetRs485();
  EXPECT_EQ(told.flags, SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND);
  EXPECT_EQ(told.delay_before_ms, 3);
  EXPECT_EQ(told.delay_after_ms, 4);
  EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
}

TEST_F(SerialLinesTest, ADriverThatCannotSwitchIsAClearError) {
  config_.lines.ptt = Ptt::kRs485;
  Peer radio = PlugIn();
  const Status status = Start();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error(),
            path_ +
                ": its driver cannot switch the direction of an RS-485 line (ptt = \"rs485\"); an "
                "adapter that switches by itself needs no ptt, and others often use \"rts\": "
                "Inappropriate ioctl for device");
}

// Counted from when the port was opened, also when the driver's 32 bits wrap, and summed over times
// that it was.
TEST_F(SerialLinesTest, ErrorsThatTheDriverCountsAreCountedSinceThePortWasOpened) {
  PtyShimSetCounts({1000, 1000, 1000, 1000, -1});
  for (uint64_t opening = 1; opening <= 2; ++opening) {
    Peer radio = PlugIn();
    if (opening == 1) {
      ASSERT_TRUE(Start().ok());
    }
    ASSERT_TRUE(Up());
    EXPECT_TRUE(IsEcho(radio.Ask(PingOf(3, 1)), 3, 1));
    PtyShimSetCounts({1005, 1004, 1003, 1002, 0});
    const LineErrors expected{5 * opening, 4 * opening, 3 * opening, 2 * opening, 1 * opening};
    EXPECT_TRUE(Eventually([&] { return counters().line == expected; }));
    ASSERT_EQ(unlink(path_.c_str()), 0);
    radio.HangUp();
    ASSERT_TRUE(Eventually([this] { return !server_.link().state().up; }));
    PtyShimSetCounts({1000, 1000, 1000, 1000, -1});
  }
}

}  // namespace
}  // namespace pheromone::links
