#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <fstream>
#include <string>
#include <utility>

#include "server/robots/links/port_link.h"
#include "server/robots/links/send_permit.h"
#include "server/robots/links/testing/link_bench.h"
#include "server/robots/links/testing/remembering_tap.h"

namespace pheromone::links {
namespace {

using engine::testing::Deposit;
using engine::testing::Hello;
using engine::testing::Sense;
using std::chrono::milliseconds;
using testing::Eventually;
using testing::IsEcho;
using testing::Peer;
using testing::PingOf;
using testing::RememberingTap;
using testing::Wire;

std::string TargetOf(const std::string& path) {
  char target[256];
  const ssize_t size = readlink(path.c_str(), target, sizeof target);
  return size < 0 ? "" : std::string(target, static_cast<size_t>(size));
}

class PtyLinkTest : public ::testing::Test {
 protected:
  Status Start() {
    const LinkConfig config{.name = "radio-a", .path = path_};
    return server_.Start(MakePtyLink(server_.io(), config, server_.Context(0)));
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "radio-a.pty";
  testing::Server server_;
};

TEST_F(PtyLinkTest, APingIsAnsweredThroughARealPty) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  ASSERT_TRUE(robot.connected());
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 42)), 3, 42));
  const LinkCounters counters = server_.link().counters();
  EXPECT_EQ(counters.received.frames, 1u);
  EXPECT_EQ(counters.bytes_in, Wire(PingOf(3, 42)).size());
  EXPECT_EQ(counters.opened, 1u);
  EXPECT_TRUE(server_.link().state().up);
  EXPECT_EQ(server_.link().address(), path_);
}

// The clock of a permit.
std::atomic<uint64_t> permit_now_ms{1'000};

// Another server may send on the line, too.
class SharedPtyLinkTest : public PtyLinkTest {
 protected:
  void SetUp() override { permit_now_ms = 1'000; }
  void TearDown() override { server_.Stop(); }  // it outlives the permit, and the link must not

  void StartShared(LinkConfig config = {}) {
    config.name = "radio-a";
    config.path = path_;
    LinkContext context = server_.Context(0);
    context.permit = &permit_;
    context.tap = &tap_;
    ASSERT_TRUE(server_.Start(MakePtyLink(server_.io(), config, std::move(context))).ok());
  }

  // What is counted in the next read tells that this one was handled.
  void SendUnheard(const Peer& robot, uint8_t number) {
    const auto received = [this] { return server_.link().counters().received; };
    const protocol::DecoderCounters before = received();
    EXPECT_TRUE(robot.SendBytes(Wire(PingOf(3, number))));
    EXPECT_TRUE(Eventually([&] { return received().frames > before.frames; }));
    EXPECT_TRUE(robot.SendBytes({0}));
    EXPECT_TRUE(Eventually([&] { return received().ignored_bytes > before.ignored_bytes; }));
  }

  static engine::Outgoing CommandTo(uint8_t id, protocol::CommandCode code) {
    protocol::Command command;
    command.id = id;
    command.code = code;
    return {0, 0, engine::testing::MessageOf(command)};
  }

  static engine::Outgoing HaltOfAll() {
    return CommandTo(protocol::kBroadcastId, protocol::CommandCode::kHalt);
  }

  RememberingTap tap_;
  SendPermit permit_{[] { return permit_now_ms.load(); }};
};

bool IsHaltOfAllRobots(const std::optional<protocol::Message>& message) {
  protocol::Command command;
  return message && protocol::Decode(*message, &command) && command.id == protocol::kBroadcastId &&
         command.code == protocol::CommandCode::kHalt;
}

TEST_F(SharedPtyLinkTest, AStandbyIsSilentUntilItMaySendAndAgainWhenItsTimeIsOver) {
  StartShared();
  Peer robot(path_);
  SendUnheard(robot, 1);
  permit_.Set(0, "b");
  EXPECT_EQ(server_.link().role(), LinkRole::kStandby);
  EXPECT_EQ(server_.link().owner(), "b");
  EXPECT_TRUE(Eventually([&] {
    return server_.link().state().reason.find("; standby: node b sends") != std::string::npos;
  }));
  SendUnheard(robot, 2);
  permit_.Set(9'000, "a");
  EXPECT_EQ(server_.link().role(), LinkRole::kServes);
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 3)), 3, 3));
  EXPECT_TRUE(Eventually(
      [&] { return server_.link().state().reason.find("standby") == std::string::npos; }));
  permit_now_ms = 9'001;  // nobody says so, as when the process was stopped
  SendUnheard(robot, 4);
  permit_now_ms = 1'000;
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 5)), 3, 5));
}

TEST_F(SharedPtyLinkTest, AHaltOfAllIsSentByWhoeverTakesOver) {
  StartShared();
  Peer robot(path_);
  server_.link().Send({HaltOfAll()});
  SendUnheard(robot, 1);
  permit_.Set(9'000, "a");
  EXPECT_TRUE(IsHaltOfAllRobots(robot.Receive()));
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 2)), 3, 2)) << "once";
}

TEST_F(SharedPtyLinkTest, AHaltOfAllIsForgottenOnceSomebodyIsToResume) {
  StartShared();
  Peer robot(path_);
  server_.link().Send({HaltOfAll(), CommandTo(3, protocol::CommandCode::kResume)});
  SendUnheard(robot, 1);
  permit_.Set(9'000, "a");
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 2)), 3, 2));
}

LinkConfig HalfDuplexConfig() {
  return {
      .medium_access = true, .turnaround_ms = 2, .server_delay_ms = 200, .response_window_ms = 250};
}

// 20 ms for drivers, 4 ms to turn round, and a byte takes a millisecond.
constexpr uint64_t kTooShortMs = 1'025;

TEST_F(SharedPtyLinkTest, AHaltOfAllThatThePermitIsTooShortForIsSentLater) {
  permit_.Set(kTooShortMs, "a");
  StartShared(HalfDuplexConfig());
  Peer robot(path_);
  server_.link().Send({HaltOfAll(), CommandTo(3, protocol::CommandCode::kHalt)});
  EXPECT_TRUE(Eventually([&] { return server_.link().counters().undeliverable == 1; }));
  EXPECT_EQ(server_.link().counters().frames_out, 0u);
  permit_.Set(9'000, "a");
  EXPECT_TRUE(IsHaltOfAllRobots(robot.Receive()));
}

TEST_F(SharedPtyLinkTest, AHaltOfAllThatIsNotSentBeforeSomebodyIsToResumeIsForgotten) {
  permit_.Set(kTooShortMs, "a");
  StartShared(HalfDuplexConfig());
  server_.link().Send({HaltOfAll(), CommandTo(3, protocol::CommandCode::kResume)});
  EXPECT_TRUE(Eventually([&] { return tap_.dropped().size() == 2; }));
}

// However often it is tried.
TEST_F(SharedPtyLinkTest, AHaltOfAllThatCannotBeSentIsForgottenAfterAWhile) {
  permit_.Set(kTooShortMs, "a");
  StartShared(HalfDuplexConfig());
  server_.link().Send({HaltOfAll()});
  EXPECT_TRUE(Eventually([&] { return tap_.dropped().size() == 1; }));
}

// A terminal that nobody reads takes a part of this.
TEST_F(SharedPtyLinkTest, WhatThePermitEndsBeforeIsRefusedAndAHaltOfAllInItIsSentLater) {
  constexpr size_t kPings = 3'000;
  permit_.Set(100'000, "a");
  StartShared();
  Peer robot(path_);
  std::vector<engine::Outgoing> many(kPings, {0, 0, PingOf(3, 1)});
  many.push_back(HaltOfAll());
  server_.link().Send(many);
  ASSERT_TRUE(Eventually([&] {
    int unread = 0;
    return ioctl(robot.descriptor(), FIONREAD, &unread) == 0 && unread > 0;
  }));
  permit_now_ms = 100'001;
  size_t received = 0;
  while (server_.link().counters().undeliverable == 0) {
    received += robot.Receive(milliseconds(10)) ? 1u : 0u;
  }
  permit_now_ms = 1'000;  // the halt is kept for three seconds
  std::optional<protocol::Message> message = robot.Receive();
  for (; message && !IsHaltOfAllRobots(message); message = robot.Receive()) {
    ++received;
  }
  EXPECT_TRUE(message);
  EXPECT_LT(received, kPings);
  EXPECT_EQ(server_.link().counters().undeliverable, kPings - received);
  const size_t sent = received * Wire(PingOf(3, 1)).size() + Wire(HaltOfAll().message).size();
  EXPECT_TRUE(
      Eventually([&] { return RememberingTap::Together(tap_.written(), 1).size() == sent; }));
  EXPECT_EQ(server_.link().counters().frames_out, received + 1);
}

// Also if what was sent of the last frame ends with the first of two DLE: there is no gap timeout.
TEST_F(SharedPtyLinkTest, AfterAPartOfAFrameTheNextOneIsHeard) {
  protocol::Ping ping;
  ping.id = 3;
  ping.length = protocol::kMaxPing;
  std::fill_n(ping.payload, ping.length, protocol::kDle);
  std::vector<engine::Outgoing> many(1'000, {0, 0, engine::testing::MessageOf(ping)});
  many.push_back(HaltOfAll());
  permit_.Set(100'000, "a");
  StartShared();
  Peer robot(path_);
  int attempts = 0;
  for (uint8_t round = 0; round < 4;) {
    ASSERT_LE(++attempts, 12) << "nothing is ever cut";
    ping.payload[0] = 1;
    ping.length = round;  // so that the cut is at another byte
    many.front() = {0, 0, engine::testing::MessageOf(ping)};
    const uint64_t before = server_.link().counters().undeliverable;
    server_.link().Send(many);
    ASSERT_TRUE(Eventually([&] {
      int unread = 0;
      return ioctl(robot.descriptor(), FIONREAD, &unread) == 0 && unread > 0;
    }));
    permit_now_ms = 100'001;
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(5);
    while (server_.link().counters().undeliverable == before &&
           std::chrono::steady_clock::now() < patience) {
      robot.Receive(milliseconds(10));
    }
    permit_now_ms = 1'000;
    if (server_.link().counters().undeliverable == before) {
      continue;  // all of it was written before, or none: this process waited for a processor
    }
    std::optional<protocol::Message> message = robot.Receive(std::chrono::seconds(5));
    while (message && !IsHaltOfAllRobots(message)) {
      message = robot.Receive(std::chrono::seconds(5));
    }
    ASSERT_TRUE(message) << int{round};
    ++round;
  }
}

TEST_F(SharedPtyLinkTest, WhatWouldBeOnTheAirBeyondThePermitIsNotBegun) {
  StartShared(HalfDuplexConfig());
  Peer robot(path_);
  protocol::Ping longer;
  longer.id = 3;
  longer.length = 20;
  const protocol::Message longer_ping = engine::testing::MessageOf(longer);
  // 20 ms for drivers, 4 ms to turn round, and a little more than a millisecond for each byte.
  const uint64_t shorter_ms = 24 + 2 * Wire(PingOf(3, 1)).size();
  ASSERT_GT(24 + Wire(longer_ping).size(), shorter_ms);
  permit_.Set(1'000 + shorter_ms, "a");
  std::optional<protocol::Message> echo;
  for (int i = 0; !echo && i < 20; ++i) {  // a busy machine may answer too late
    EXPECT_TRUE(robot.Send(longer_ping) && robot.Send(PingOf(3, 2)));
    echo = robot.Receive(milliseconds(500));
  }
  EXPECT_TRUE(IsEcho(echo, 3, 2));
}

TEST_F(PtyLinkTest, TheServersGroupMayUseItAndNobodyElse) {
  ASSERT_TRUE(Start().ok());
  struct stat terminal {};
  ASSERT_EQ(stat(path_.c_str(), &terminal), 0);
  EXPECT_EQ(terminal.st_mode & 0777, 0660u);
  EXPECT_EQ(terminal.st_gid, getegid());
}

TEST_F(PtyLinkTest, ItIsKnownWhenTheLastByteCame) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  EXPECT_FALSE(server_.link().counters().heard.has_value());
  const auto before = std::chrono::steady_clock::now();
  ASSERT_TRUE(robot.Ask(PingOf(3, 1)));
  ASSERT_TRUE(server_.link().counters().heard.has_value());
  EXPECT_GE(*server_.link().counters().heard, before);
}

TEST_F(PtyLinkTest, BytesThatLookLikeTerminalControlPassUnchanged) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  for (int byte = 0; byte < 256; ++byte) {
    EXPECT_TRUE(
        IsEcho(robot.Ask(PingOf(3, static_cast<uint8_t>(byte))), 3, static_cast<uint8_t>(byte)));
  }
}

TEST_F(PtyLinkTest, TwoFramesInOneWriteAreTwoAnswersInOrder) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  std::vector<uint8_t> both = Wire(PingOf(3, 1));
  const std::vector<uint8_t> second = Wire(PingOf(4, 2));
  both.insert(both.end(), second.begin(), second.end());
  ASSERT_TRUE(robot.SendBytes(both));
  EXPECT_TRUE(IsEcho(robot.Receive(), 3, 1));
  EXPECT_TRUE(IsEcho(robot.Receive(), 4, 2));
}

TEST_F(PtyLinkTest, BytesOneByOneAreAFrame) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  uint64_t sent = 0;
  for (const uint8_t byte : Wire(PingOf(3, 7))) {
    ASSERT_TRUE(robot.SendBytes({byte}));
    ++sent;
    EXPECT_TRUE(Eventually([&] { return server_.link().counters().bytes_in == sent; }));
  }
  EXPECT_TRUE(IsEcho(robot.Receive(), 3, 7));
}

TEST_F(PtyLinkTest, ABadFrameIsNotAnsweredAndTheNextGoodOneIs) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  std::vector<uint8_t> bytes = Wire(PingOf(3, 1));
  bytes[5] ^= 0x40;
  ASSERT_TRUE(robot.SendBytes(bytes));
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 2)), 3, 2));
  EXPECT_EQ(server_.link().counters().received.crc_errors, 1u);
}

TEST_F(PtyLinkTest, ClientsComeAndGo) {
  ASSERT_TRUE(Start().ok());
  for (uint8_t visit = 1; visit <= 5; ++visit) {
    Peer robot(path_);
    EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, visit)), 3, visit));
  }
  EXPECT_EQ(server_.link().counters().opened, 1u);  // the line itself never went down
}

TEST_F(PtyLinkTest, AnswersNobodyReadsAreBoundedAndTheLineStaysUsable) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  std::vector<uint8_t> many;
  for (int i = 0; i < 200; ++i) {
    const std::vector<uint8_t> frame = Wire(PingOf(3, 1));
    many.insert(many.end(), frame.begin(), frame.end());
  }
  ASSERT_TRUE(Eventually(
      [&] { return robot.SendBytes(many) && server_.link().counters().dropped_answers > 0; }));
  ASSERT_TRUE(robot.Send(PingOf(3, 99)));
  std::optional<protocol::Message> message;
  do {
    message = robot.Receive();
    ASSERT_TRUE(message);
  } while (!IsEcho(message, 3, 99));
}

TEST_F(PtyLinkTest, StopRemovesTheSymbolicLinkAndEndsTheLine) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 1)), 3, 1));
  server_.Stop();  // returns: nothing is left running
  EXPECT_EQ(TargetOf(path_), "");
  EXPECT_TRUE(robot.SeesTheEnd());
  EXPECT_FALSE(server_.link().state().up);
}

TEST_F(PtyLinkTest, StopRightAfterStartIsClean) {
  ASSERT_TRUE(Start().ok());
  server_.Stop();
  EXPECT_EQ(TargetOf(path_), "");
}

TEST_F(PtyLinkTest, AStaleSymbolicLinkIsReplaced) {
  ASSERT_EQ(symlink("/dev/pts/99999", path_.c_str()), 0);
  ASSERT_TRUE(Start().ok());
  EXPECT_NE(TargetOf(path_), "/dev/pts/99999");
  Peer robot(path_);
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 1)), 3, 1));
}

TEST_F(PtyLinkTest, ASymbolicLinkToSomebodyElsesTerminalIsReplaced) {
  const Descriptor terminal(posix_openpt(O_RDWR | O_NOCTTY));
  ASSERT_EQ(unlockpt(terminal.get()), 0);
  ASSERT_EQ(symlink(ptsname(terminal.get()), path_.c_str()), 0);
  EXPECT_TRUE(Start().ok());
  EXPECT_NE(TargetOf(path_), ptsname(terminal.get()));
}

TEST_F(PtyLinkTest, ARegularFileIsNotOverwrittenAndTheLinkWaitsForItToGo) {
  std::ofstream(path_) << "precious";
  const Status status = Start();
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().find("exists and is not a link to a pseudo-terminal"),
            std::string::npos);
  EXPECT_FALSE(server_.link().state().up);
  ASSERT_EQ(server_.lines().size(), 1u);
  EXPECT_EQ(server_.lines()[0].find("link radio-a: down, "), 0u);
  std::string text;
  std::ifstream(path_) >> text;
  EXPECT_EQ(text, "precious");

  ASSERT_EQ(unlink(path_.c_str()), 0);
  ASSERT_TRUE(Eventually([&] { return server_.link().state().up; }));
  Peer robot(path_);
  EXPECT_TRUE(IsEcho(robot.Ask(PingOf(3, 1)), 3, 1));
  EXPECT_EQ(server_.lines().size(), 2u);  // told once, however often it was tried
}

TEST_F(PtyLinkTest, ALinkToAnotherFileIsLeftAlone) {
  const std::string other = folder_ / "other";
  std::ofstream(other) << "x";
  ASSERT_EQ(symlink(other.c_str(), path_.c_str()), 0);
  EXPECT_FALSE(Start().ok());
  EXPECT_EQ(TargetOf(path_), other);
}

// A server that crashed leaves its link behind, and another server may get the terminal's name.
TEST_F(PtyLinkTest, ALinkToTheTerminalOfAServersOtherLinkIsReplaced) {
  ASSERT_TRUE(Start().ok());
  const std::string target = TargetOf(path_);
  const std::string left = path_ + "-left";
  ASSERT_EQ(symlink(target.c_str(), left.c_str()), 0);
  const auto second = MakePtyPort(left);
  const Result<Descriptor> opened = second->Open();
  ASSERT_TRUE(opened.ok()) << opened.error();
  EXPECT_NE(TargetOf(left), target);
  EXPECT_EQ(TargetOf(path_), target);
}

TEST_F(PtyLinkTest, TheLinkOfARunningServerIsNotTakenOver) {
  ASSERT_TRUE(Start().ok());
  const std::string target = TargetOf(path_);
  const auto second = MakePtyPort(path_);
  const Result<Descriptor> opened = second->Open();
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error(), path_ + " belongs to another running server");
  EXPECT_EQ(TargetOf(path_), target);
  server_.Stop();
  EXPECT_TRUE(second->Open().ok());
}

TEST_F(PtyLinkTest, AFolderThatDoesNotExistIsAnError) {
  path_ = folder_ / "none/radio-a.pty";
  const Status status = Start();
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().find("No such file or directory"), std::string::npos);
}

// A deposit is answered twice and done once: the robot's memory is the server's, not the line's.
TEST_F(PtyLinkTest, ARepeatedDepositIsAnsweredAgainAndDoneOnce) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  ASSERT_TRUE(robot.Ask(Hello(1, 5)));
  const auto first = robot.Ask(Deposit(1, 9));
  ASSERT_TRUE(first);
  const uint64_t hash = server_.service().StateHash();
  robot.HangUp();
  Peer again(path_);
  const auto second = again.Ask(Deposit(1, 9));
  ASSERT_TRUE(second);
  EXPECT_TRUE(engine::testing::SameMessage(*first, *second));
  EXPECT_EQ(server_.service().StateHash(), hash);
  EXPECT_EQ(again.Ask(Sense(1))->opcode, 0x81);
}

TEST_F(PtyLinkTest, AnAnswerThatNobodyWaitsForAnyLongerIsNotSentButCounted) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  ASSERT_TRUE(robot.Ask(Hello(1, 5)));
  server_.link().Send({testing::AnswerAfter(kLongestWait + milliseconds(1), PingOf(1, 2)),
                       testing::AnswerAfter(milliseconds(0), PingOf(1, 3))});
  EXPECT_EQ(robot.Receive()->data[0], 3);
  EXPECT_EQ(server_.link().counters().late_answers, 1u);
}

TEST_F(PtyLinkTest, CommandsReachTheRobotUnasked) {
  ASSERT_TRUE(Start().ok());
  Peer robot(path_);
  ASSERT_TRUE(robot.Ask(Hello(1, 5)));
  ASSERT_TRUE(server_.Halt(1).ok());
  const auto command = robot.Receive();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->opcode, protocol::kCommand);
}

}  // namespace
}  // namespace pheromone::links
