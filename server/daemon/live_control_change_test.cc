// What an operator asks for is answered once: when it is durable, refused, or waited for too long.

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "server/base/testing/temporary_folder.h"
#include "server/daemon/testing/live_control_bench.h"

namespace pheromone::daemon {
namespace {

using engine::testing::Hello;
using testing::Dot;
using testing::FakeLink;
using testing::LiveControlTest;
using testing::Outcome;

void ExpectHalts(const std::vector<protocol::Message>& sent) {
  for (const protocol::Message& message : sent) {
    protocol::Command command;
    ASSERT_TRUE(protocol::Decode(message, &command));
    EXPECT_EQ(command.id, protocol::kBroadcastId);
    EXPECT_EQ(command.code, protocol::CommandCode::kHalt);
  }
}

TEST_F(LiveControlTest, HaltGoesToAllRobotsOfAllLinks) {
  Outcome<std::vector<std::string>> halted;
  control_.HaltAll(halted.Taker());
  ASSERT_TRUE(halted.is_there());
  EXPECT_EQ(halted.Get().value(), (std::vector<std::string>{"radio-a", "radio-b"}));
  for (const FakeLink* link : fakes_) {
    EXPECT_EQ(link->sent().size(), 1u);
    ExpectHalts(link->sent());
  }
}

TEST_F(LiveControlTest, AStandbyGetsAHaltAndIsNotOneOfThoseThatSendIt) {
  config_.links[1].on = {"a", "b"};
  fakes_[1]->SetRole(links::LinkRole::kStandby);
  control_.HaltHere();
  for (FakeLink* link : fakes_) {
    EXPECT_FALSE(link->sent().empty());
    ExpectHalts(link->sent());
  }
  Outcome<std::vector<std::string>> halted;
  control_.HaltAll(halted.Taker());
  EXPECT_EQ(halted.Get().value(), (std::vector<std::string>{"radio-a"}));
  EXPECT_FALSE(fakes_[1]->sent().empty());
  const auto views = control_.GetLinks();
  EXPECT_EQ(views[0].role, "serves");
  EXPECT_EQ(views[1].role, "standby");
  EXPECT_EQ(views[1].nodes, (std::vector<std::string>{"a", "b"}));
}

TEST_F(LiveControlTest, HaltGoesOutThriceThoughTheLogRefusesItAndChangesNothing) {
  Handle(0, {Hello(3, 9)});
  log_.admit = protocol::Reason::kReadOnly;
  const uint64_t hash = service_.StateHash();
  const uint64_t sequence = log_.sequence();
  Outcome<std::vector<std::string>> halted;
  control_.HaltAll(halted.Taker());
  ASSERT_TRUE(halted.is_there());
  EXPECT_EQ(halted.Get().value(), (std::vector<std::string>{"radio-a", "radio-b"}));
  for (FakeLink* link : fakes_) {
    EXPECT_GE(link->sent().size(), 1u) << "it is sent before it is called sent";
    ExpectHalts(link->AwaitSent(3));
  }
  EXPECT_EQ(service_.StateHash(), hash);
  EXPECT_EQ(log_.sequence(), sequence);
  Outcome<> single;
  control_.Issue("radio-a", 3, protocol::CommandCode::kHalt, {}, single.Taker());
  EXPECT_FALSE(single.Get().ok());
}

TEST_F(LiveControlTest, HaltGoesOutWhileEditsWaitForAStuckDiskAndTheQueuesAreFull) {
  log_.GetStuck();
  std::array<Outcome<control::EditOutcome>, 2> edits;
  for (auto& edit : edits) {
    control_.Edit(Dot(), edit.Taker());
  }
  has_room_ = false;
  Outcome<std::vector<std::string>> halted;
  control_.HaltAll(halted.Taker());
  EXPECT_TRUE(halted.Get().ok());
  for (FakeLink* link : fakes_) {
    ExpectHalts(link->AwaitSent(3));
  }
  EXPECT_FALSE(edits[0].is_there() || edits[1].is_there());
  log_.Heal();
  for (const auto& edit : edits) {
    EXPECT_EQ(edit.times(), 1u);
    EXPECT_TRUE(edit.Get().ok());
  }
  EXPECT_EQ(halted.times(), 1u);
}

TEST_F(LiveControlTest, ACommandIsSentWithItsArguments) {
  const auto issue = [&](const char* link, protocol::CommandCode code,
                         const std::vector<uint8_t>& arguments) {
    Outcome<> outcome;
    control_.Issue(link, 3, code, arguments, outcome.Taker());
    return outcome.Get();
  };
  EXPECT_EQ(issue("radio-c", protocol::CommandCode::kHalt, {}).error(),
            "unknown link \"radio-c\", expected one of radio-a, radio-b");
  EXPECT_FALSE(issue("radio-a", protocol::CommandCode::kHalt, {}).ok());
  Handle(0, {Hello(3, 9)});
  EXPECT_TRUE(issue("radio-a", protocol::CommandCode::kSpeed, {0x2C, 0x01}).ok());
  protocol::Command command;
  const auto sent = fakes_[0]->sent();
  ASSERT_EQ(sent.size(), 1u);
  ASSERT_TRUE(protocol::Decode(sent[0], &command));
  EXPECT_EQ(command.arguments[0], 0x2C);
  EXPECT_EQ(command.arguments[1], 0x01);
  EXPECT_EQ(control_.GetClients()[0].robot.command.outcome, engine::CommandOutcome::kPending);
}

TEST_F(LiveControlTest, AnEditIsDoneOnlyWhenItIsDurable) {
  log_.GetStuck();
  Outcome<control::EditOutcome> edit;
  control_.Edit(Dot(), edit.Taker());
  EXPECT_FALSE(edit.is_there());
  EXPECT_LT(control_.GetStatus(false).durable_sequence, control_.GetStatus(false).sequence);
  log_.Heal();
  ASSERT_TRUE(edit.is_there());
  ASSERT_TRUE(edit.Get().ok()) << edit.Get().error();
  EXPECT_EQ(edit.Get().value().nodes, 5u);  // the node and its neighbours, a radius away

  log_.admit = protocol::Reason::kReadOnly;
  Outcome<control::EditOutcome> refused;
  control_.Edit(Dot(), refused.Taker());
  EXPECT_FALSE(refused.Get().ok());
  EXPECT_FALSE(control_.CheckHealth().ok());
}

TEST_F(LiveControlTest, AnEditThatTheDiskDoesNotTakeIsToldOnceAlsoIfItDoesInTheEnd) {
  log_.GetStuck();
  Outcome<control::EditOutcome> edit;
  hasty_.Edit(Dot(), edit.Taker());
  EXPECT_EQ(edit.Get().error(), "applied; not yet durable: a crash may undo it");
  log_.Heal();
  EXPECT_EQ(edit.times(), 1u);
}

TEST_F(LiveControlTest, WhoWaitsForTheDiskIsAnsweredWhenTheServerStopsOrTooManyWait) {
  log_.GetStuck();
  Outcome<control::EditOutcome> waiting;
  control_.Edit(Dot(), waiting.Taker());
  log_.full = true;
  Outcome<control::EditOutcome> refused;
  control_.Edit(Dot(), refused.Taker());
  EXPECT_EQ(refused.Get().error(), "applied; not yet durable: a crash may undo it");
  EXPECT_FALSE(waiting.is_there());
  control_.Stop();
  EXPECT_EQ(waiting.Get().error(), "applied; not yet durable: a crash may undo it");
  log_.Heal();
  EXPECT_EQ(waiting.times(), 1u);
  Outcome<control::EditOutcome> after;
  control_.Edit(Dot(), after.Taker());
  EXPECT_TRUE(after.Get().ok());
}

TEST_F(LiveControlTest, AnEditThatTouchesNoNodeChangesNothing) {
  const uint64_t sequence = log_.sequence();
  field::FieldEdit beside = Dot();
  beside.points = {{-200'000, 0}};
  Outcome<control::EditOutcome> edit;
  control_.Edit(beside, edit.Taker());
  EXPECT_EQ(edit.Get().error(),
            "the shape contains no node of the map: x from 0 to 10 m, y from 0 to 10 m");
  EXPECT_EQ(log_.sequence(), sequence);
  field::FieldEdit all = Dot();
  all.shape = field::FieldEdit::Shape::kAll;
  all.action = field::FieldEdit::Action::kErase;
  Outcome<control::EditOutcome> erased;
  control_.Edit(all, erased.Taker());
  ASSERT_TRUE(erased.Get().ok());
  EXPECT_EQ(erased.Get().value().nodes, 101u * 101u);
}

TEST_F(LiveControlTest, WhatFindsNoRoomInItsQueueIsRefusedAndChangesNothing) {
  has_room_ = false;
  const uint64_t sequence = log_.sequence();
  Outcome<control::EditOutcome> edit;
  control_.Edit(Dot(), edit.Taker());
  Outcome<std::vector<std::string>> reload;
  control_.Reload(reload.Taker());
  Outcome<> capture;
  control_.StartCapture(capture.Taker());
  const std::string busy = "the server is busy with earlier requests; nothing was changed";
  EXPECT_EQ(edit.Get().error(), busy);
  EXPECT_EQ(reload.Get().error(), busy);
  EXPECT_EQ(capture.Get().error(), busy);
  EXPECT_EQ(log_.sequence(), sequence);
}

TEST_F(LiveControlTest, AChangedLawIsDoneWhenItIsDurable) {
  Outcome<> changed;
  control_.ChangeTau(3, 2'500, changed.Taker());
  EXPECT_TRUE(changed.Get().ok());
  EXPECT_EQ(tau_, (std::pair<uint8_t, int64_t>(3, 2'500)));
  log_.SetDurable(0);
  Outcome<> late;
  hasty_.ChangeTau(3, 2'600, late.Taker());
  EXPECT_EQ(late.Get().error(), "applied; not yet durable: a crash may undo it");
  reloaded_ = Error{"it diffuses"};
  Outcome<> wrong;
  control_.ChangeTau(3, 2'700, wrong.Taker());
  EXPECT_EQ(wrong.Get().error(), "it diffuses");
  has_room_ = false;
  Outcome<> busy;
  control_.ChangeTau(3, 2'800, busy.Taker());
  EXPECT_EQ(busy.Get().error(), "the server is busy with earlier requests; nothing was changed");
  EXPECT_EQ(tau_.second, 2'700);
}

TEST_F(LiveControlTest, AReloadIsDoneWhenItIsDurable) {
  Outcome<std::vector<std::string>> reload;
  control_.Reload(reload.Taker());
  EXPECT_EQ(reload.Get().value(), std::vector<std::string>{"links wait"});
  log_.SetDurable(0);
  Outcome<std::vector<std::string>> late;
  hasty_.Reload(late.Taker());
  EXPECT_EQ(late.Get().error(), "applied; not yet durable: a crash may undo it");
  reloaded_ = Error{"a mistake in line 3"};
  Outcome<std::vector<std::string>> wrong;
  control_.Reload(wrong.Taker());
  EXPECT_EQ(wrong.Get().error(), "a mistake in line 3");
}

TEST_F(LiveControlTest, AReloadReadsTheOwnCertificateAndGoesToTheServerThatLeads) {
  int forwarded = 0;
  int read = 0;
  LiveParts parts = Parts(std::chrono::hours(1));
  LiveCluster others;
  others.has_leader = [] { return true; };
  others.forward = [&](const cluster::OperatorChange& change, const auto& done) {
    EXPECT_TRUE(std::holds_alternative<cluster::ReloadRequest>(change.change));
    ++forwarded;
    cluster::OperatorResult result;
    result.ok = true;
    result.notes = {"there"};
    done(result);
    return true;
  };
  parts.cluster = std::move(others);
  parts.reload = [] { return Error{"another server has the configuration"}; };
  parts.reload_secrets = [&] {
    ++read;
    return reloaded_secrets_;
  };
  LiveControl control(std::move(parts));
  Outcome<std::vector<std::string>> reload;
  control.Reload(reload.Taker());
  EXPECT_EQ(reload.Get().value(), std::vector<std::string>{"there"});
  EXPECT_EQ(read, 1);
  reloaded_secrets_ = Error{"lab.key: found no private key"};
  Outcome<std::vector<std::string>> wrong;
  control.Reload(wrong.Taker());
  EXPECT_EQ(wrong.Get().error(), "the configuration of this server: lab.key: found no private key");
  EXPECT_EQ(forwarded, 1);
}

TEST_F(LiveControlTest, ASnapshotIsNamedWhenItIsMade) {
  Outcome<std::optional<std::string>> made;
  control_.Snapshot(made.Taker());
  EXPECT_FALSE(made.is_there());
  snapshot_(std::optional<std::string>("7.snapshot"));
  EXPECT_EQ(made.Get().value(), "7.snapshot");
  Outcome<std::optional<std::string>> late;
  hasty_.Snapshot(late.Taker());
  EXPECT_EQ(late.Get().error(),
            "snapshot requested but not finished; its completion will be logged");
  snapshot_(std::optional<std::string>());
  EXPECT_EQ(late.times(), 1u);
}

TEST_F(LiveControlTest, ARecordingIsStartedAndStoppedWhenItsFilesAreThere) {
  const TemporaryFolder folder;
  config_.capture = {.folder = folder / "captures", .file_mb = 1, .most_files = 0};
  {
    Captures captures(&service_, config_);
    LiveParts parts = Parts(std::chrono::minutes(1));
    parts.captures = &captures;
    LiveControl control(std::move(parts));
    Outcome<> started;
    control.StartCapture(started.Taker());
    ASSERT_TRUE(started.Get().ok());
    const control::CaptureView during = control.GetCapture();
    EXPECT_TRUE(std::filesystem::exists(during.file));
    Outcome<> again;
    control.StartCapture(again.Taker());
    EXPECT_FALSE(again.Get().ok());
    Outcome<> stopped;
    control.StopCapture(stopped.Taker());
    EXPECT_TRUE(stopped.Get().ok());
    EXPECT_FALSE(control.GetCapture().recording);
  }
}

TEST_F(LiveControlTest, LogAndDeadlinesRaceAndEveryAnswerComesOnce) {
  constexpr int kRounds = 200;
  LiveControl control(Parts(std::chrono::milliseconds(1)));
  std::vector<Outcome<std::vector<std::string>>> answers(kRounds);
  log_.SetDurable(0);
  std::thread disk([this] {
    for (int i = 0; i < kRounds; ++i) {
      log_.Heal();
      std::this_thread::yield();
      log_.SetDurable(0);
    }
  });
  for (auto& answer : answers) {
    control.Reload(answer.Taker());
  }
  disk.join();
  control.Stop();
  for (const auto& answer : answers) {
    EXPECT_EQ(answer.times(), 1u);
  }
}

}  // namespace
}  // namespace pheromone::daemon
