// The control interface over a real service, with a log and links that the test decides.
//
//   TEST_F(LiveControlTest, Halts) {
//     Outcome<std::vector<std::string>> halted;
//     control_.HaltAll(halted.Taker());
//     EXPECT_TRUE(halted.Get().ok());
//   }
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/scripted_log.h"
#include "server/daemon/live_control.h"

namespace pheromone::daemon::testing {

/// Remembers what it is to send.
class FakeLink final : public links::Link {
 public:
  FakeLink(std::string name, engine::LinkIndex index)
      : Link({.name = std::move(name)}, {.index = index, .log = [](const links::LinkNotice&) {}}) {}
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
  void SetRole(links::LinkRole role) { role_ = role; }
  links::LinkRole role() const override { return role_; }
  void FallSilent() { ReportSilence(std::chrono::seconds(30)); }
  void Send(std::vector<engine::Outgoing> messages) override {
    const std::lock_guard lock(mutex_);
    for (const engine::Outgoing& outgoing : messages) {
      sent_.push_back(outgoing.message);
    }
    more_.notify_all();
  }
  void SetKeys(signing::Keys /*keys*/) override {}
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
  std::atomic<links::LinkRole> role_{links::LinkRole::kServes};
};

/// The outcome of something that is answered later, once.
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

/// Of five nodes: one and its neighbours, a radius away.
inline field::FieldEdit Dot() {
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
        router_(&service_) {
    config_.engine = engine::testing::SmallConfig();
    config_.engine.frames = {engine::MakeFrame("radio-b", 7, {1'000'000, 0}, 90)};
    config_.links.resize(2);
    config_.links[1].kind = links::LinkKind::kSerial;
    config_.links[1].baud = 9600;
    EXPECT_TRUE(service_.Configure(config_.engine, 7).ok());
    for (engine::LinkIndex i = 0; i < 2; ++i) {
      config_.links[i].name = config_.engine.links[i].name;
      auto link = std::make_unique<FakeLink>(config_.links[i].name, i);
      fakes_.push_back(link.get());
      router_.Add(link.get());
      links_.push_back(std::move(link));
    }
  }

  void Handle(engine::LinkIndex link, const std::vector<protocol::Message>& messages) {
    std::vector<engine::Outgoing> answers;
    router_.Handle(link, messages, {}, &answers);
  }

  engine::testing::ScriptedLog log_;
  std::atomic<uint64_t> now_ms_{0};  // of both clocks: field time begins with 0
  engine::Service service_;
  links::LinkRouter router_;
  config::Config config_;
  Captures captures_{&service_, config_};  // none is begun here; captures_test.cc
  std::vector<std::unique_ptr<links::TrackerLink>> trackers_;
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
            .router = &router_,
            .links = &links_,
            .trackers = &trackers_,
            .link_configs = &config_.links,
            .captures = &captures_,
            .now_ms = [this] { return now_ms_.load(); },
            .config = [this] { return config_; },
            .run_edit = run,
            .run_operation = run,
            .reload = [this] { return reloaded_; },
            .reload_secrets = [this] { return reloaded_secrets_; },
            .change_tau =
                [this](uint8_t type, int64_t tau_ms) {
                  tau_ = {type, tau_ms};
                  return reloaded_.ok() ? Ok() : Status(Error{reloaded_.error()});
                },
            .keys = [this] { return keys_; },
            .drop_revoked = [this] { ++drops_; },
            .snapshot = [this](auto done) { snapshot_ = std::move(done); },
            .patience = patience,
            .snapshot_patience = patience};
  }

  bool has_room_ = true;  // the queues for what takes long
  Result<std::vector<std::string>> reloaded_ = std::vector<std::string>{"links wait"};
  Status reloaded_secrets_ = Ok();
  std::pair<uint8_t, int64_t> tau_{};
  LinkKeys keys_;
  int drops_ = 0;  // how often the links were told to
  control::Control::DoneWith<std::optional<std::string>> snapshot_;
  // Nothing is waited for until the patience ends, but where a test is about that.
  LiveControl control_{Parts(std::chrono::hours(1))};
  LiveControl hasty_{Parts(std::chrono::milliseconds(20))};
};

}  // namespace pheromone::daemon::testing
