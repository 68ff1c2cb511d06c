// The control interface over a real service, with a log and links that the test decides.

#include "server/daemon/live_control.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <variant>

#include "server/engine/testing/bench.h"

namespace pheromone::daemon {
namespace {

using engine::testing::Hello;
using engine::testing::Sense;
using engine::testing::Trace;

// Durable when the test says so; takes changes as long as it says so.
class ScriptedLog final : public engine::OrderedLog {
 public:
  protocol::Reason Admit() override { return admit; }
  uint64_t Append(const engine::Stamp&, const engine::Event&) override { return ++sequence; }
  uint64_t DurableSequence() const override { return durable_; }
  bool WhenDurable(uint64_t wanted, std::function<void()> done) override {
    {
      const std::lock_guard lock(mutex_);
      if (wanted > durable_) {
        if (!full) {
          waiting_.emplace_back(wanted, std::move(done));
        }
        return !full;
      }
    }
    done();
    return true;
  }
  std::string Trouble() const override { return trouble; }
  void Probe(std::function<void()> done) override { done(); }

  void SetDurable(uint64_t durable) {
    std::vector<std::function<void()>> ready;
    {
      const std::lock_guard lock(mutex_);
      durable_ = durable;
      std::erase_if(waiting_, [&](auto& it) {
        if (it.first <= durable) {
          ready.push_back(std::move(it.second));
        }
        return it.first <= durable;
      });
    }
    for (const auto& done : ready) {
      done();
    }
  }
  // What comes from now on is taken, and not durable.
  void GetStuck() { SetDurable(sequence); }
  void Heal() { SetDurable(UINT64_MAX); }

  protocol::Reason admit = protocol::Reason::kNone;
  std::string trouble;
  uint64_t sequence = 0;
  bool full = false;  // of callbacks

 private:
  std::mutex mutex_;
  std::atomic<uint64_t> durable_{UINT64_MAX};
  std::vector<std::pair<uint64_t, std::function<void()>>> waiting_;
};

// Remembers what it is to send.
class FakeLink final : public links::Link {
 public:
  FakeLink(std::string name, engine::LinkIndex index)
      : Link({std::move(name), index, nullptr, [](links::Severity, const std::string&) {}}) {}
  Status Start() override {
    ReportUp("somewhere");
    return Ok();
  }
  void Stop() override { ReportDown("unplugged"); }
  void Fail(std::chrono::seconds until_next) {
    ReportFailure("not there");
    record()->SetNextAttempt(std::chrono::steady_clock::now() + until_next);
  }
  void Hear() {
    record()->Count([](links::LinkCounters& counters) {
      counters.heard = std::chrono::steady_clock::now() - std::chrono::seconds(60);
    });
  }
  void FallSilent() { ReportSilence(std::chrono::seconds(30)); }
  void Send(std::vector<engine::Outgoing> messages) override {
    const std::lock_guard lock(mutex_);
    for (const engine::Outgoing& outgoing : messages) {
      sent_.push_back(outgoing.message);
    }
    more_.notify_all();
  }
  std::string address() const override { return "here"; }

  std::vector<protocol::Message> sent() const {
    const std::lock_guard lock(mutex_);
    return sent_;
  }
  std::vector<protocol::Message> AwaitSent(size_t count) {
    std::unique_lock lock(mutex_);
    more_.wait(lock, [&] { return sent_.size() >= count; });
    return sent_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable more_;
  std::vector<protocol::Message> sent_;
};

// The outcome of something that is answered later, once.
template <typename T = std::monostate>
class Outcome {
 public:
  std::function<void(const Result<T>&)> Taker() {
    return [shared = shared_](const Result<T>& result) { shared->push_back(result); };
  }
  /// To be called where the answer has come, or comes soon and from one thread.
  const Result<T>& Get() const {
    while (!is_there()) {
      std::this_thread::yield();
    }
    return shared_->Front();
  }
  bool is_there() const { return shared_->size() != 0; }
  size_t times() const { return shared_->size(); }

 private:
  struct Results {
    void push_back(const Result<T>& result) {
      const std::lock_guard lock(mutex);
      all.push_back(result);
    }
    size_t size() const {
      const std::lock_guard lock(mutex);
      return all.size();
    }
    const Result<T>& Front() const {
      const std::lock_guard lock(mutex);
      return all.front();
    }
    mutable std::mutex mutex;
    std::deque<Result<T>> all;  // whose first one stays where it is
  };
  std::shared_ptr<Results> shared_ = std::make_shared<Results>();
};

void ExpectHalts(const std::vector<protocol::Message>& sent) {
  for (const protocol::Message& message : sent) {
    protocol::Command command;
    ASSERT_TRUE(protocol::Decode(message, &command));
    EXPECT_EQ(command.id, protocol::kBroadcastId);
    EXPECT_EQ(command.code, protocol::CommandCode::kHalt);
  }
}

field::FieldEdit Dot() {
  field::FieldEdit edit;
  edit.shape = field::FieldEdit::Shape::kStroke;
  edit.level = 64;
  edit.radius_um = 100'000;
  edit.points = {{1'000'000, 1'000'000}};
  return edit;
}

class LiveControlTest : public ::testing::Test {
 protected:
  LiveControlTest()
      : service_(&log_,
                 [this] {
                   return engine::ClockReading{now_ms_, 0};
                 }),
        switchboard_(&service_) {
    config_.engine = engine::testing::SmallConfig();
    config_.engine.frames = {engine::MakeFrame("radio-b", 7, {1'000'000, 0}, 90)};
    config_.links.resize(2);
    config_.links[1].kind = config::LinkKind::kSerial;
    config_.links[1].baud = 9600;
    EXPECT_TRUE(service_.Configure(config_.engine, 7).ok());
    for (engine::LinkIndex i = 0; i < 2; ++i) {
      auto link = std::make_unique<FakeLink>(config_.engine.links[i].name, i);
      fakes_.push_back(link.get());
      switchboard_.Add(link.get());
      links_.push_back(std::move(link));
    }
  }

  void Handle(engine::LinkIndex link, const std::vector<protocol::Message>& messages) {
    std::vector<engine::Outgoing> answers;
    switchboard_.Handle(link, messages, {}, &answers);
  }

  ScriptedLog log_;
  std::atomic<uint64_t> now_ms_{0};  // of both clocks: field time begins with 0
  engine::Service service_;
  links::Switchboard switchboard_;
  config::Config config_;
  Captures captures_{&service_, config_};  // none is begun here; captures_test.cc
  std::vector<std::unique_ptr<links::Link>> links_;
  std::vector<FakeLink*> fakes_;
  LiveParts Parts(std::chrono::milliseconds patience) {
    const auto run = [this](const std::function<void()>& work) {
      if (has_room_) {
        work();
      }
      return has_room_;
    };
    return {.service = &service_,
            .log = &log_,
            .switchboard = &switchboard_,
            .links = &links_,
            .link_configs = &config_.links,
            .captures = &captures_,
            .now_ms = [this] { return now_ms_.load(); },
            .config = [this] { return config_; },
            .run_edit = run,
            .run_operation = run,
            .reload = [this] { return reloaded_; },
            .snapshot = [this](auto done) { snapshot_ = std::move(done); },
            .patience = patience,
            .snapshot_patience = patience};
  }

  bool has_room_ = true;  // the queues for what takes long
  Result<std::vector<std::string>> reloaded_ = std::vector<std::string>{"links wait"};
  engine::Control::DoneWith<std::optional<std::string>> snapshot_;
  // Nothing is waited for until the patience ends, but where a test is about that.
  LiveControl control_{Parts(std::chrono::hours(1))};
  LiveControl hasty_{Parts(std::chrono::milliseconds(20))};
};

TEST_F(LiveControlTest, ClientsAreThoseThatSaidHelloAndThoseThatWereHeard) {
  Handle(0, {Hello(3, 9), Trace(3, 1, 2000, 3000, 16384), Trace(3, 1, 2000, 3000, 16384)});
  Handle(1, {Sense(7, 500, 250, 0)});  // from its own frame, without HELLO
  now_ms_ = 2'500;
  const auto clients = control_.GetClients();
  ASSERT_EQ(clients.size(), 2u);
  EXPECT_EQ(clients[0].link, "radio-a");
  EXPECT_EQ(clients[0].id, 3);
  EXPECT_TRUE(clients[0].known);
  EXPECT_EQ(clients[0].robot.nonce, 9);
  EXPECT_EQ(clients[0].traffic.requests, 3u);
  EXPECT_EQ(clients[0].traffic.repeats, 1u);
  EXPECT_EQ(clients[0].silent_ms, 2'500u);
  EXPECT_EQ(clients[0].pose_source, engine::PoseSource::kRobot);
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
  EXPECT_EQ(control_.GetClients()[0].pose_source, engine::PoseSource::kTracker);
  EXPECT_EQ(control_.GetClients()[0].pose.position, seen.pose.position);
  now_ms_ = 500;
  EXPECT_EQ(control_.GetClients()[0].pose_source, engine::PoseSource::kRobot);
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
  const engine::LinkView down = control_.GetLinks()[0];
  EXPECT_EQ(down.failed_attempts, 3u);
  ASSERT_TRUE(down.next_attempt_s.has_value());
  EXPECT_GT(*down.next_attempt_s, 0);
  EXPECT_LE(*down.next_attempt_s, 3600);
  fakes_[0]->Fail(std::chrono::seconds(0));  // due, and perhaps a moment ago
  EXPECT_EQ(control_.GetLinks()[0].next_attempt_s, 0.0);
  EXPECT_TRUE(links_[0]->Start().ok());
  const engine::LinkView up = control_.GetLinks()[0];
  EXPECT_EQ(up.failed_attempts, 0u);
  EXPECT_FALSE(up.next_attempt_s.has_value());
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

TEST_F(LiveControlTest, HaltGoesOutThriceThoughTheLogRefusesItAndChangesNothing) {
  Handle(0, {Hello(3, 9)});
  log_.admit = protocol::Reason::kReadOnly;
  const uint64_t hash = service_.StateHash();
  const uint64_t sequence = log_.sequence;
  Outcome<std::vector<std::string>> halted;
  control_.HaltAll(halted.Taker());
  ASSERT_TRUE(halted.is_there());
  EXPECT_EQ(halted.Get().value(), (std::vector<std::string>{"radio-a", "radio-b"}));
  for (FakeLink* link : fakes_) {
    EXPECT_GE(link->sent().size(), 1u) << "it is sent before it is called sent";
    ExpectHalts(link->AwaitSent(3));
  }
  EXPECT_EQ(service_.StateHash(), hash);
  EXPECT_EQ(log_.sequence, sequence);
  Outcome<> single;
  control_.Issue("radio-a", 3, protocol::CommandCode::kHalt, {}, single.Taker());
  EXPECT_FALSE(single.Get().ok());
}

TEST_F(LiveControlTest, HaltGoesOutWhileEditsWaitForAStuckDiskAndTheQueuesAreFull) {
  log_.GetStuck();
  std::array<Outcome<engine::EditOutcome>, 2> edits;
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
            "there is no link \"radio-c\"");
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
  Outcome<engine::EditOutcome> edit;
  control_.Edit(Dot(), edit.Taker());
  EXPECT_FALSE(edit.is_there());
  EXPECT_LT(control_.GetStatus(false).durable_sequence, control_.GetStatus(false).sequence);
  log_.Heal();
  ASSERT_TRUE(edit.is_there());
  ASSERT_TRUE(edit.Get().ok()) << edit.Get().error();
  EXPECT_EQ(edit.Get().value().nodes, 5u);  // the node and its neighbours, a radius away

  log_.admit = protocol::Reason::kReadOnly;
  Outcome<engine::EditOutcome> refused;
  control_.Edit(Dot(), refused.Taker());
  EXPECT_FALSE(refused.Get().ok());
  EXPECT_FALSE(control_.CheckHealth().ok());
}

TEST_F(LiveControlTest, AnEditThatTheDiskDoesNotTakeIsToldOnceAlsoIfItDoesInTheEnd) {
  log_.GetStuck();
  Outcome<engine::EditOutcome> edit;
  hasty_.Edit(Dot(), edit.Taker());
  EXPECT_EQ(edit.Get().error(), "applied; not yet durable: a crash may undo it");
  log_.Heal();
  EXPECT_EQ(edit.times(), 1u);
}

TEST_F(LiveControlTest, WhoWaitsForTheDiskIsAnsweredWhenTheServerStopsOrTooManyWait) {
  log_.GetStuck();
  Outcome<engine::EditOutcome> waiting;
  control_.Edit(Dot(), waiting.Taker());
  log_.full = true;
  Outcome<engine::EditOutcome> refused;
  control_.Edit(Dot(), refused.Taker());
  EXPECT_EQ(refused.Get().error(), "applied; not yet durable: a crash may undo it");
  EXPECT_FALSE(waiting.is_there());
  control_.Stop();
  EXPECT_EQ(waiting.Get().error(), "applied; not yet durable: a crash may undo it");
  log_.Heal();
  EXPECT_EQ(waiting.times(), 1u);
  Outcome<engine::EditOutcome> after;
  control_.Edit(Dot(), after.Taker());
  EXPECT_TRUE(after.Get().ok());
}

TEST_F(LiveControlTest, AnEditThatTouchesNoNodeChangesNothing) {
  const uint64_t sequence = log_.sequence;
  field::FieldEdit beside = Dot();
  beside.points = {{-200'000, 0}};
  Outcome<engine::EditOutcome> edit;
  control_.Edit(beside, edit.Taker());
  EXPECT_EQ(edit.Get().error(), "no node of the map lies there");
  EXPECT_EQ(log_.sequence, sequence);
  field::FieldEdit all = Dot();
  all.shape = field::FieldEdit::Shape::kAll;
  all.action = field::FieldEdit::Action::kErase;
  Outcome<engine::EditOutcome> erased;
  control_.Edit(all, erased.Taker());
  ASSERT_TRUE(erased.Get().ok());
  EXPECT_EQ(erased.Get().value().nodes, 101u * 101u);
}

TEST_F(LiveControlTest, WhatFindsNoRoomInItsQueueIsRefusedAndChangesNothing) {
  has_room_ = false;
  const uint64_t sequence = log_.sequence;
  Outcome<engine::EditOutcome> edit;
  control_.Edit(Dot(), edit.Taker());
  Outcome<std::vector<std::string>> reload;
  control_.Reload(reload.Taker());
  Outcome<> capture;
  control_.StartCapture(capture.Taker());
  const std::string busy = "the server is busy with what was asked for before; nothing was changed";
  EXPECT_EQ(edit.Get().error(), busy);
  EXPECT_EQ(reload.Get().error(), busy);
  EXPECT_EQ(capture.Get().error(), busy);
  EXPECT_EQ(log_.sequence, sequence);
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

TEST_F(LiveControlTest, ASnapshotIsNamedWhenItIsMade) {
  Outcome<std::optional<std::string>> made;
  control_.Snapshot(made.Taker());
  EXPECT_FALSE(made.is_there());
  snapshot_(std::optional<std::string>("7.snapshot"));
  EXPECT_EQ(made.Get().value(), "7.snapshot");
  Outcome<std::optional<std::string>> late;
  hasty_.Snapshot(late.Taker());
  EXPECT_EQ(late.Get().error(), "asked for, and not made yet: the log tells when it is");
  snapshot_(std::optional<std::string>());
  EXPECT_EQ(late.times(), 1u);
}

TEST_F(LiveControlTest, HealthSaysThatTheDiskDoesNotAdvanceAndThatFieldTimeIsOver) {
  EXPECT_TRUE(control_.CheckHealth().ok());
  EXPECT_EQ(control_.GetStatus(false).warning, "");
  log_.trouble = "the disk has taken nothing for 2.1 s";
  EXPECT_EQ(control_.CheckHealth().error(), log_.trouble);
  EXPECT_EQ(control_.GetStatus(false).warning, log_.trouble);
  log_.trouble.clear();
  now_ms_ = engine::kMostFieldTimeMs - 1;
  EXPECT_TRUE(control_.CheckHealth().ok());
  now_ms_ = engine::kMostFieldTimeMs;
  const Status over = control_.CheckHealth();
  ASSERT_FALSE(over.ok());
  EXPECT_NE(over.error().find("field time has reached its end"), std::string::npos);
}

TEST_F(LiveControlTest, ARecordingIsStartedAndStoppedWhenItsFilesAreThere) {
  const std::string folder = ::testing::TempDir() + "/live_control_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  config_.capture = {.folder = folder + "/captures", .file_mb = 1, .most_files = 0};
  {
    Captures captures(&service_, config_);
    LiveParts parts = Parts(std::chrono::minutes(1));
    parts.captures = &captures;
    LiveControl control(std::move(parts));
    Outcome<> started;
    control.StartCapture(started.Taker());
    ASSERT_TRUE(started.Get().ok());
    const engine::CaptureView during = control.GetCapture();
    EXPECT_TRUE(std::filesystem::exists(during.file));
    Outcome<> again;
    control.StartCapture(again.Taker());
    EXPECT_FALSE(again.Get().ok());
    Outcome<> stopped;
    control.StopCapture(stopped.Taker());
    EXPECT_TRUE(stopped.Get().ok());
    EXPECT_FALSE(control.GetCapture().recording);
  }
  std::filesystem::remove_all(folder);
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

TEST_F(LiveControlTest, StatusAddsUpAndReadsTheProcess) {
  Handle(0, {Hello(3, 9), Sense(3)});
  Handle(0, {Sense(3)});
  const engine::StatusView status = control_.GetStatus(true);
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
    const engine::FieldView view = control_.GetField();
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
