// The control interface over a real service, with a log and links that the test decides.

#include "server/daemon/live_control.h"

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <thread>

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
  uint64_t DurableSequence() const override { return durable; }
  // Nobody is called later: what is not durable stays so for the one who asked.
  bool WhenDurable(uint64_t wanted, std::function<void()> done) override {
    if (wanted <= durable) {
      done();
    }
    return true;
  }
  void Probe(std::function<void()> done) override { done(); }

  protocol::Reason admit = protocol::Reason::kNone;
  uint64_t sequence = 0;
  std::atomic<uint64_t> durable{UINT64_MAX};
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
    for (const engine::Outgoing& outgoing : messages) {
      sent.push_back(outgoing.message);
    }
  }
  std::string address() const override { return "here"; }

  std::vector<protocol::Message> sent;
};

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
  LiveControl control_{{.service = &service_,
                        .log = &log_,
                        .switchboard = &switchboard_,
                        .links = &links_,
                        .captures = &captures_,
                        .now_ms = [this] { return now_ms_.load(); },
                        .config = [this] { return config_; },
                        .reload = [] { return Error{"not here"}; },
                        .snapshot = [] { return false; },
                        .patience = std::chrono::milliseconds(20)}};
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
  const auto halted = control_.HaltAll();
  ASSERT_TRUE(halted.ok());
  EXPECT_EQ(halted.value(), (std::vector<std::string>{"radio-a", "radio-b"}));
  for (const FakeLink* link : fakes_) {
    ASSERT_EQ(link->sent.size(), 1u);
    protocol::Command command;
    ASSERT_TRUE(protocol::Decode(link->sent[0], &command));
    EXPECT_EQ(command.id, protocol::kBroadcastId);
    EXPECT_EQ(command.code, protocol::CommandCode::kHalt);
  }
}

TEST_F(LiveControlTest, HaltGoesOutThriceThoughTheLogRefusesItAndChangesNothing) {
  Handle(0, {Hello(3, 9)});
  log_.admit = protocol::Reason::kReadOnly;
  const uint64_t hash = service_.StateHash();
  const uint64_t sequence = log_.sequence;
  const auto halted = control_.HaltAll();
  ASSERT_TRUE(halted.ok()) << halted.error();
  EXPECT_EQ(halted.value(), (std::vector<std::string>{"radio-a", "radio-b"}));
  for (const FakeLink* link : fakes_) {
    ASSERT_EQ(link->sent.size(), 3u);
    for (const protocol::Message& message : link->sent) {
      protocol::Command command;
      ASSERT_TRUE(protocol::Decode(message, &command));
      EXPECT_EQ(command.id, protocol::kBroadcastId);
      EXPECT_EQ(command.code, protocol::CommandCode::kHalt);
    }
  }
  EXPECT_EQ(service_.StateHash(), hash);
  EXPECT_EQ(log_.sequence, sequence);
  EXPECT_FALSE(control_.Issue("radio-a", 3, protocol::CommandCode::kHalt, {}).ok());
}

TEST_F(LiveControlTest, HaltGoesOutThoughTheDiskIsStuck) {
  log_.durable = log_.sequence;  // what comes now is taken, and never durable
  ASSERT_TRUE(control_.HaltAll().ok());
  for (const FakeLink* link : fakes_) {
    EXPECT_EQ(link->sent.size(), 3u);
  }
}

TEST_F(LiveControlTest, ACommandIsSentWithItsArguments) {
  EXPECT_EQ(control_.Issue("radio-c", 3, protocol::CommandCode::kHalt, {}).error(),
            "there is no link \"radio-c\"");
  EXPECT_FALSE(control_.Issue("radio-a", 3, protocol::CommandCode::kHalt, {}).ok());
  Handle(0, {Hello(3, 9)});
  const std::vector<uint8_t> speed = {0x2C, 0x01};
  EXPECT_TRUE(control_.Issue("radio-a", 3, protocol::CommandCode::kSpeed, speed).ok());
  protocol::Command command;
  ASSERT_EQ(fakes_[0]->sent.size(), 1u);
  ASSERT_TRUE(protocol::Decode(fakes_[0]->sent[0], &command));
  EXPECT_EQ(command.arguments[0], 0x2C);
  EXPECT_EQ(command.arguments[1], 0x01);
  EXPECT_EQ(control_.GetClients()[0].robot.command.outcome, engine::CommandOutcome::kPending);
}

TEST_F(LiveControlTest, AnEditIsDoneOnlyWhenItIsDurable) {
  field::FieldEdit edit;
  edit.shape = field::FieldEdit::Shape::kStroke;
  edit.level = 64;
  edit.points = {{1'000'000, 1'000'000}};
  log_.durable = log_.sequence;
  const Status early = control_.Edit(edit);
  ASSERT_FALSE(early.ok());
  EXPECT_NE(early.error().find("has not made it durable"), std::string::npos);
  EXPECT_LT(control_.GetStatus(false).durable_sequence, control_.GetStatus(false).sequence);
  log_.durable = UINT64_MAX;
  EXPECT_TRUE(control_.Edit(edit).ok());
  log_.admit = protocol::Reason::kReadOnly;
  EXPECT_FALSE(control_.Edit(edit).ok());
  EXPECT_FALSE(control_.CheckHealth().ok());
}

TEST_F(LiveControlTest, StatusAddsUpAndReadsTheProcess) {
  Handle(0, {Hello(3, 9), Sense(3)});
  Handle(0, {Sense(3)});
  const engine::StatusView status = control_.GetStatus(true);
  EXPECT_EQ(status.version, "1.2.3");
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
