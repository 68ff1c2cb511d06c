// What an operator sees: robots, links, status, health and the field.

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <thread>

#include "server/daemon/testing/live_control_bench.h"

namespace pheromone::daemon {
namespace {

using engine::testing::Hello;
using engine::testing::Sense;
using engine::testing::Trace;
using testing::LiveControlTest;

TEST_F(LiveControlTest, ClientsAreThoseThatSaidHelloAndThoseThatWereHeard) {
  Handle(0, {Hello(3, 9), Trace(3, 1, 2000, 3000, 16384), Trace(3, 1, 2000, 3000, 16384)});
  Handle(1, {Sense(7, 500, 250, 0)});  // from its own frame, without HELLO
  now_ms_ = 2'500;
  const auto clients = control_.GetClients();
  ASSERT_EQ(clients.size(), 2u);
  EXPECT_EQ(clients[0].link, "radio-a");
  EXPECT_EQ(clients[0].id, 3);
  EXPECT_TRUE(clients[0].known);
  EXPECT_EQ(clients[0].robot.hello.nonce, 9);
  EXPECT_EQ(clients[0].traffic.requests, 3u);
  EXPECT_EQ(clients[0].traffic.repeats, 1u);
  EXPECT_EQ(clients[0].silent_ms, 2'500u);
  EXPECT_EQ(clients[0].pose_source, control::PoseSource::kRobot);
  EXPECT_EQ(clients[0].pose.position, (field::PointUm{2'000'000, 3'000'000}));
  EXPECT_EQ(clients[1].link, "radio-b");
  EXPECT_FALSE(clients[1].known);
  // Turned by a quarter and moved by one metre: (1 - 0.25, 0.5).
  EXPECT_EQ(clients[1].pose.position, (field::PointUm{750'000, 500'000}));
  EXPECT_EQ(clients[1].pose.heading, 16384);
}

TEST_F(LiveControlTest, ATrackersWordCountsForAsLongAsItIsValid) {
  Handle(0, {Hello(3, 9), Sense(3, 1000, 1000, 0)});
  const engine::PoseObserved seen{0, 3, {{4'000'000, 5'000'000}, 8192}, 500};
  ASSERT_EQ(service_.Observe({&seen, 1}), 1u);
  EXPECT_EQ(control_.GetClients()[0].pose_source, control::PoseSource::kTracker);
  EXPECT_EQ(control_.GetClients()[0].pose.position, seen.pose.position);
  now_ms_ = 500;
  EXPECT_EQ(control_.GetClients()[0].pose_source, control::PoseSource::kRobot);
  EXPECT_EQ(control_.GetClients()[0].pose.position, (field::PointUm{1'000'000, 1'000'000}));
}

TEST_F(LiveControlTest, LinksTellTheirStateAndWhyTheyWereDown) {
  EXPECT_TRUE(links_[0]->Start().ok());
  EXPECT_TRUE(links_[1]->Start().ok());
  links_[1]->Stop();
  EXPECT_TRUE(links_[1]->Start().ok());
  const auto views = control_.GetLinks();
  ASSERT_EQ(views.size(), 2u);
  EXPECT_TRUE(views[0].up);
  EXPECT_EQ(views[0].state, "somewhere");
  EXPECT_EQ(views[0].last_error, "");
  EXPECT_FALSE(views[0].byte_rate.has_value());
  EXPECT_EQ(views[1].last_error, "unplugged");
  EXPECT_EQ(views[1].byte_rate, 960);
  EXPECT_EQ(control_.GetStatus(false).links_up, 2u);
}

TEST_F(LiveControlTest, ALinkThatIsDownTellsHowOftenItTriedAndWhenItTriesAgain) {
  EXPECT_TRUE(links_[0]->Start().ok());
  links_[0]->Stop();
  EXPECT_EQ(control_.GetLinks()[0].failed_attempts, 0u);
  EXPECT_FALSE(control_.GetLinks()[0].next_attempt_s.has_value());
  for (int attempt = 0; attempt < 3; ++attempt) {
    fakes_[0]->Fail(std::chrono::hours(1));
  }
  const control::LinkView down = control_.GetLinks()[0];
  EXPECT_EQ(down.failed_attempts, 3u);
  ASSERT_TRUE(down.next_attempt_s.has_value());
  EXPECT_GT(*down.next_attempt_s, 0);
  EXPECT_LE(*down.next_attempt_s, 3600);
  fakes_[0]->Fail(std::chrono::seconds(0));  // due, and perhaps a moment ago
  EXPECT_EQ(control_.GetLinks()[0].next_attempt_s, 0.0);
  EXPECT_TRUE(links_[0]->Start().ok());
  const control::LinkView up = control_.GetLinks()[0];
  EXPECT_EQ(up.failed_attempts, 0u);
  EXPECT_FALSE(up.next_attempt_s.has_value());
}

TEST_F(LiveControlTest, LinksTellWhereOtherProgramsOpenThem) {
  config_.links[0].path = "/dev/../dev/ttyUSB0";
  EXPECT_EQ(control_.GetLinks()[0].terminal, "/dev/ttyUSB0");
  config_.links[0].path = "";  // found by the numbers of its adapter
  EXPECT_EQ(control_.GetLinks()[0].terminal, "");
}

TEST_F(LiveControlTest, LinksTellHowLongTheyWereSilent) {
  EXPECT_TRUE(links_[0]->Start().ok());
  EXPECT_FALSE(control_.GetLinks()[0].silent_s.has_value());
  fakes_[0]->Hear();
  EXPECT_GE(control_.GetLinks()[0].silent_s.value_or(0), 60);
  EXPECT_FALSE(control_.GetLinks()[0].silent);
  fakes_[0]->FallSilent();
  EXPECT_TRUE(control_.GetLinks()[0].silent);
}

TEST_F(LiveControlTest, HealthSaysThatTheDiskDoesNotAdvanceAndThatFieldTimeIsOver) {
  EXPECT_TRUE(control_.CheckHealth().ok());
  EXPECT_EQ(control_.GetStatus(false).warning, "");
  log_.trouble = "no response from the disk for 2.1 s";
  EXPECT_EQ(control_.CheckHealth().error(), log_.trouble);
  EXPECT_EQ(control_.GetStatus(false).warning, log_.trouble);
  log_.trouble.clear();
  now_ms_ = engine::kMaxFieldTimeMs - 1;
  EXPECT_TRUE(control_.CheckHealth().ok());
  now_ms_ = engine::kMaxFieldTimeMs;
  const Status over = control_.CheckHealth();
  ASSERT_FALSE(over.ok());
  EXPECT_NE(over.error().find("field time has reached its end"), std::string::npos);
}

TEST_F(LiveControlTest, StatusAddsUpAndReadsTheProcess) {
  Handle(0, {Hello(3, 9), Sense(3)});
  Handle(0, {Sense(3)});
  const control::StatusView status = control_.GetStatus(true);
  EXPECT_EQ(status.version, PHEROMONE_VERSION);
  EXPECT_EQ(status.sequence, 2u);  // the configuration, HELLO
  EXPECT_EQ(status.robots, 1u);
  EXPECT_EQ(status.requests_by_opcode[0x01], 2u);
  EXPECT_EQ(status.state_hash, service_.StateHash());
  uint64_t batches = 0;
  for (const uint64_t count : status.latency.by_class) {
    batches += count;
  }
  EXPECT_EQ(batches, 2u);
  EXPECT_GT(status.resident_bytes, 1u << 20);
  EXPECT_GE(status.open_descriptors, 3u);
}

TEST_F(LiveControlTest, ViewsAreTakenWhileRobotsAreServed) {
  constexpr int kRounds = 300;
  std::thread robots([this] {
    Handle(0, {Hello(3, 9)});
    for (int i = 0; i < kRounds; ++i) {
      Handle(0, {Trace(3, static_cast<uint8_t>(i), 1000 + 20 * i, 2000)});
    }
  });
  std::thread sampler([this] {
    for (int i = 0; i < kRounds; ++i) {
      control_.SampleLinks();
    }
  });
  for (int i = 0; i < kRounds; ++i) {
    const control::FieldView view = control_.GetField();
    const field::FieldReader reader(*view.field);
    size_t nodes = 0;
    reader.VisitLevels(1, view.now_ms, [&](field::NodeIndex, uint32_t) { ++nodes; });
    EXPECT_LE(nodes, static_cast<size_t>(kRounds));
    EXPECT_LE(control_.GetClients().size(), 1u);
    EXPECT_EQ(control_.GetLinks().size(), 2u);
  }
  robots.join();
  sampler.join();
  EXPECT_EQ(control_.GetStatus(false).requests_by_opcode[0x31], static_cast<uint64_t>(kRounds));
}

}  // namespace
}  // namespace pheromone::daemon
