#include "server/daemon/watchdog.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>

#include "server/core/engine/testing/scripted_log.h"

namespace pheromone::daemon {
namespace {

using std::chrono::milliseconds;

// Long against the interval: who feeds the watchdog without a probe does so many times in it. A
// machine that is busy makes these tests weaker, but never fail.
constexpr milliseconds kInterval{1};
constexpr milliseconds kWhile{50};

/// A watchdog on a thread of its own.
class WatchdogTest : public ::testing::Test {
 protected:
  WatchdogTest()
      : service_(&log_, [] { return engine::ClockReading{}; }),
        strand_(boost::asio::make_strand(io_)),
        watchdog_(strand_, &service_, kInterval, [this] { ++fed_; }) {}

  void SetUp() override {
    boost::asio::post(strand_, [this] { watchdog_.Start(); });
    thread_ = std::thread([this] { io_.run(); });
    AwaitFedMoreThan(0);
  }

  void TearDown() override {
    boost::asio::post(strand_, [this] { watchdog_.Stop(); });
    work_.reset();
    thread_.join();
  }

  void AwaitFedMoreThan(int count) const {
    while (fed_ <= count) {
      std::this_thread::yield();
    }
  }

  engine::testing::ScriptedLog log_;
  engine::Service service_;
  boost::asio::io_context io_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      io_.get_executor()};
  boost::asio::strand<boost::asio::io_context::executor_type> strand_;
  std::atomic<int> fed_{0};
  Watchdog watchdog_;
  std::thread thread_;
};

TEST_F(WatchdogTest, IsFedAgainAndAgainWhileAllIsWell) {
  AwaitFedMoreThan(10);
}

TEST_F(WatchdogTest, IsNotFedWhileTheEngineIsStuck) {
  const int before = service_.Inspect([this](const engine::Engine&) {
    const int fed = fed_;
    std::this_thread::sleep_for(kWhile);
    EXPECT_LE(fed_, fed + 1);  // the probe that was past the lock already
    return fed;
  });
  AwaitFedMoreThan(before + 1);
}

TEST_F(WatchdogTest, IsNotFedWhileTheInputThreadsAreStuck) {
  std::mutex stuck;
  std::unique_lock held(stuck);
  boost::asio::post(strand_, [&stuck] { const std::lock_guard wait(stuck); });
  const int fed = fed_;
  std::this_thread::sleep_for(kWhile);
  EXPECT_LE(fed_, fed + 1);
  held.unlock();
  AwaitFedMoreThan(fed + 1);
}

}  // namespace
}  // namespace pheromone::daemon
