// The watchdog of a server with a journal on a disk, as it is run by default.

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>

#include "server/core/engine/testing/bench.h"
#include "server/daemon/watchdog.h"
#include "server/store/journal/local_journal.h"
#include "server/store/journal/testing/crash_folder.h"

namespace pheromone::daemon {
namespace {

using journal::AppendFile;
using journal::Folder;
using journal::LocalJournal;
using journal::SlotFile;
using std::chrono::milliseconds;

constexpr milliseconds kInterval{1};
constexpr std::chrono::seconds kLong{60};  // for the failure of a test, not for its success

// Stops whoever comes by while it is closed.
class Gate {
 public:
  void Close() {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
  }
  void Open() {
    const std::lock_guard lock(mutex_);
    is_closed_ = false;
    changed_.notify_all();
  }
  void Pass() {
    std::unique_lock lock(mutex_);
    ++waiting_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !is_closed_; });
    --waiting_;
  }
  bool AwaitSomebody() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLong, [this] { return waiting_ > 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_closed_ = false;
  int waiting_ = 0;
};

// A disk whose syncs can get stuck.
class StuckFile final : public AppendFile {
 public:
  StuckFile(std::unique_ptr<AppendFile> file, Gate* gate) : file_(std::move(file)), gate_(gate) {}
  Status Append(std::string_view bytes) override { return file_->Append(bytes); }
  Status Sync() override {
    gate_->Pass();
    return file_->Sync();
  }
  Reserved Reserve(uint64_t bytes) override { return file_->Reserve(bytes); }
  void ReleaseReserve() override { file_->ReleaseReserve(); }

 private:
  std::unique_ptr<AppendFile> file_;
  Gate* gate_;
};

class StuckFolder final : public Folder {
 public:
  const std::string& path() const override { return folder_.path(); }
  Result<std::vector<std::string>> List() const override { return folder_.List(); }
  Result<std::vector<std::string>> ListOthers() const override { return folder_.ListOthers(); }
  Result<uint64_t> Size(const std::string& name) const override { return folder_.Size(name); }
  Result<std::unique_ptr<SlotFile>> OpenSlots(const std::string& name, uint64_t bytes) override {
    return folder_.OpenSlots(name, bytes);
  }
  Result<std::string> Read(const std::string& name, uint64_t offset, size_t most) const override {
    return folder_.Read(name, offset, most);
  }
  Result<std::unique_ptr<AppendFile>> Create(const std::string& name) override {
    PHEROMONE_TRY(std::unique_ptr<AppendFile> file, folder_.Create(name));
    return std::unique_ptr<AppendFile>(std::make_unique<StuckFile>(std::move(file), &gate));
  }
  Status Rename(const std::string& from, const std::string& to) override {
    return folder_.Rename(from, to);
  }
  Status Remove(const std::string& name) override { return folder_.Remove(name); }
  Status Sync() override { return folder_.Sync(); }

  Gate gate;

 private:
  journal::testing::CrashFolder folder_{1};
};

uint64_t SteadyUs() {
  return static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(
                                   std::chrono::steady_clock::now().time_since_epoch())
                                   .count());
}

class JournalWatchdogTest : public ::testing::Test {
 protected:
  JournalWatchdogTest()
      : journal_(
            &folder_, {}, SteadyUs, [](bool, const std::string&) {}, LocalJournal::Start{}),
        service_(&journal_, [] { return engine::ClockReading{}; }),
        strand_(boost::asio::make_strand(io_)),
        watchdog_(strand_, &service_, kInterval, [this] { Feed(); }) {}

  void SetUp() override {
    journal_.WriteOnce();
    ASSERT_TRUE(service_.Configure(engine::testing::SmallConfig(), 1).ok());
    writer_ = std::thread([this] { journal_.WriteUntilStopped(); });
    boost::asio::post(strand_, [this] { watchdog_.Start(); });
    runner_ = std::thread([this] { io_.run(); });
  }

  void TearDown() override {
    folder_.gate.Open();
    boost::asio::post(strand_, [this] { watchdog_.Stop(); });
    journal_.Stop();
    writer_.join();
    work_.reset();
    runner_.join();
  }

  void Feed() {
    const std::lock_guard lock(mutex_);
    ++fed_;
    was_fed_.notify_all();
  }
  int fed() {
    const std::lock_guard lock(mutex_);
    return fed_;
  }
  bool AwaitFedMoreThan(int count) {
    std::unique_lock lock(mutex_);
    return was_fed_.wait_for(lock, kLong, [&] { return fed_ > count; });
  }

  void Change(uint8_t seq) {
    std::vector<engine::Outgoing> out;
    const protocol::Message messages[] = {engine::testing::Hello(1, 1),
                                          engine::testing::Deposit(1, seq)};
    service_.Handle(0, messages, &out);
  }

  boost::asio::io_context io_;
  StuckFolder folder_;
  LocalJournal journal_;
  engine::Service service_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      io_.get_executor()};
  boost::asio::strand<boost::asio::io_context::executor_type> strand_;
  std::mutex mutex_;
  std::condition_variable was_fed_;
  int fed_ = 0;
  Watchdog watchdog_;
  std::thread writer_;
  std::thread runner_;
};

TEST_F(JournalWatchdogTest, IsFedWhileNothingIsWrittenAndWhileMuchIs) {
  ASSERT_TRUE(AwaitFedMoreThan(10));
  for (uint8_t seq = 1; seq < 100; ++seq) {
    Change(seq);
    if (seq % 10 == 0) {
      ASSERT_TRUE(AwaitFedMoreThan(fed() + 1));
    }
  }
}

TEST_F(JournalWatchdogTest, IsFedWhileTheDiskIsStuck) {
  ASSERT_TRUE(AwaitFedMoreThan(0));
  folder_.gate.Close();
  Change(1);
  ASSERT_TRUE(folder_.gate.AwaitSomebody());
  ASSERT_TRUE(AwaitFedMoreThan(fed() + 10));
}

}  // namespace
}  // namespace pheromone::daemon
