// Snapshots and their end; what the journal itself does is in server/store/journal and
// journal_test.py.

#include "server/daemon/journal_owner.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/base/testing/temporary_folder.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/journal/service_state.h"

namespace pheromone::daemon {
namespace {

constexpr char kWhy[] = "another state is taken in its place";

// A state, the last portion of which comes when somebody lets it.
class HeldState final : public journal::StateSource {
 public:
  struct Hold {
    std::promise<void> begun;
    std::promise<void> released;
    std::atomic<bool> is_over{false};
  };
  HeldState(Hold* hold, std::unique_ptr<journal::StateSource> state)
      : hold_(hold), state_(std::move(state)) {}
  ~HeldState() override { hold_->is_over = true; }

  journal::SnapshotHeader header() const override { return state_->header(); }
  Result<std::string> Next() override {
    if (!std::exchange(has_begun_, true)) {
      hold_->begun.set_value();
      hold_->released.get_future().wait();
    }
    return state_->Next();
  }

 private:
  Hold* const hold_;
  const std::unique_ptr<journal::StateSource> state_;
  bool has_begun_ = false;
};

class JournalOwnerTest : public ::testing::Test {
 protected:
  JournalOwnerTest() {
    config::JournalConfig config;
    config.folder = folder_ / "journal";
    journal_ = JournalOwner::Open(config, false).value();
    service_.emplace(
        journal_->log(),
        [] {
          return engine::ClockReading{1, 1};
        },
        0, journal_->TakeEngine());
  }

  void TearDown() override { journal_->Stop(std::nullopt); }

  // The log has an event.
  void Start(JournalOwner::Freeze freeze) {
    journal_->Start([] {}, std::move(freeze));
    ASSERT_TRUE(service_->Configure(engine::testing::SmallConfig(), 7).ok());
  }

  std::unique_ptr<journal::StateSource> State() {
    return journal::ServiceState::Freeze(&*service_);
  }

  std::future<Result<std::string>> AskForSnapshot() {
    auto made = std::make_shared<std::promise<Result<std::string>>>();
    journal_->Snapshot([made](const Result<std::string>& it) { made->set_value(it); });
    return made->get_future();
  }

  size_t CountSnapshots() const {
    size_t count = 0;
    for (const auto& it : std::filesystem::directory_iterator(folder_ / "journal")) {
      count += it.path().extension() == ".snapshot" ? 1u : 0u;
    }
    return count;
  }

  TemporaryFolder folder_;
  std::unique_ptr<JournalOwner> journal_;
  std::optional<engine::Service> service_;
};

TEST_F(JournalOwnerTest, ASnapshotIsAFileOnceItIsMade) {
  Start([this] { return State(); });
  const Result<std::string> made = AskForSnapshot().get();
  ASSERT_TRUE(made.ok()) << made.error();
  EXPECT_TRUE(std::filesystem::exists(made.value()));
  EXPECT_EQ(CountSnapshots(), 1u);
}

TEST_F(JournalOwnerTest, SnapshotsThatAreEndedAreRefused) {
  Start([this] { return State(); });
  journal_->EndSnapshots(kWhy);
  journal_->EndSnapshots("the first reason stays");
  EXPECT_EQ(AskForSnapshot().get().error(), kWhy);
  EXPECT_EQ(CountSnapshots(), 0u);
}

TEST_F(JournalOwnerTest, SnapshotsEndWhenTheOneThatIsMadeIsWritten) {
  HeldState::Hold hold;
  Start([&] { return std::make_unique<HeldState>(&hold, State()); });
  auto first = AskForSnapshot();
  hold.begun.get_future().wait();
  auto was_over = std::async(std::launch::async, [&] {
    journal_->EndSnapshots(kWhy);
    return hold.is_over.load();
  });
  // Requests are refused for that reason at once, while EndSnapshots waits for the first.
  std::vector<std::future<Result<std::string>>> accepted;
  for (bool is_refused = false; !is_refused; std::this_thread::yield()) {
    auto made = AskForSnapshot();
    if (made.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
      is_refused = made.get().error() == kWhy;  // or too many wait
    } else {
      accepted.push_back(std::move(made));
    }
  }
  hold.released.set_value();
  EXPECT_TRUE(was_over.get());
  EXPECT_EQ(CountSnapshots(), first.get().ok() ? 1u : 0u);  // not if the log was not on the disk
  for (auto& made : accepted) {
    EXPECT_EQ(made.get().error(), kWhy);
  }
}

TEST_F(JournalOwnerTest, SnapshotsEndWhileTheStateCannotBeFrozen) {
  std::promise<void> tried;
  std::atomic<bool> has_tried{false};
  journal_->Start([] {},
                  [&]() -> std::unique_ptr<journal::StateSource> {
                    if (!has_tried.exchange(true)) {
                      tried.set_value();
                    }
                    return nullptr;
                  });
  auto made = AskForSnapshot();
  tried.get_future().wait();
  journal_->EndSnapshots(kWhy);
  EXPECT_EQ(made.get().error(), kWhy);
  EXPECT_EQ(CountSnapshots(), 0u);
}

// A snapshot waits for the log up to its last event; here that never comes.
TEST_F(JournalOwnerTest, SnapshotsEndWhileOneWaitsForTheLog) {
  engine::Engine later;
  std::vector<engine::Outgoing> none;
  later.Apply(5, {1, 1}, engine::ConfigChanged{engine::testing::SmallConfig(), 7}, &none);
  HeldState::Hold hold;
  Start([&] {
    return std::make_unique<HeldState>(
        &hold, std::make_unique<journal::CopiedState>(later, engine::Stamp{1, 1}));
  });
  auto made = AskForSnapshot();
  hold.begun.get_future().wait();
  hold.released.set_value();
  journal_->EndSnapshots(kWhy);
  EXPECT_EQ(made.get().error(), kWhy);
  EXPECT_EQ(CountSnapshots(), 0u);
}

}  // namespace
}  // namespace pheromone::daemon
