// What every ReplicatedLog does: the same cases for each of them.
//
//   INSTANTIATE_TEST_SUITE_P(Memory, LogContractTest, testing::Values(MakeMemoryHarness));
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

/// An empty log, and what runs its clients' executor.
class LogHarness {
 public:
  LogHarness() = default;
  LogHarness(const LogHarness&) = delete;
  LogHarness& operator=(const LogHarness&) = delete;
  virtual ~LogHarness() = default;

  virtual std::unique_ptr<ReplicatedLog> NewClient() = 0;
  /// Runs until `done` or much too long; true if it is done.
  virtual bool RunUntil(const std::function<bool()>& done) = 0;
  /// Runs what can be run now.
  virtual void RunReady() = 0;
};

/// The calls, each until its answer; a lack of one fails the test. They are repeated while the
/// outcome is unknown, as on a busy machine, but for those that say Try.
class WaitingLog {
 public:
  explicit WaitingLog(LogHarness* harness) : harness_(harness), log_(harness->NewClient()) {}

  ReplicatedLog& log() { return *log_; }
  Leader TakeLead(Term seen, const std::string& node);
  Result<Leader> TryTakeLead(Term seen, const std::string& node);
  Appended Append(const Group& group);
  Appended TryAppend(const Group& group);
  Status Trim(Sequence floor);

 private:
  static constexpr int kMaxTries = 100;

  LogHarness* harness_;
  std::unique_ptr<ReplicatedLog> log_;
};

/// Follows, and checks what each follower may rely on: groups in order, without a gap.
class Follower {
 public:
  Follower(LogHarness* harness, Sequence from);

  ReplicatedLog& log() { return *log_; }
  const std::vector<Group>& groups() const { return groups_; }
  /// The newest page.
  const Page& page() const { return page_; }
  size_t pages() const { return pages_; }
  const std::vector<std::string>& errors() const { return errors_; }

  /// Until one more page than now.
  bool AwaitPage();
  bool AwaitGroups(size_t count);
  bool Await(const std::function<bool(const Page&)>& is_so);

 private:
  void OnNews(const Result<Page>& news);

  LogHarness* harness_;
  std::unique_ptr<ReplicatedLog> log_;
  std::vector<Group> groups_;
  Page page_;
  size_t pages_ = 0;
  std::vector<std::string> errors_;
};

/// `count` events from `first`, with records that tell them from others.
Group MakeGroup(Term term, Sequence first, uint32_t count, size_t bytes = 40);

using MakeHarness = std::function<std::unique_ptr<LogHarness>()>;

class LogContractTest : public testing::TestWithParam<MakeHarness> {
 protected:
  LogContractTest();
  ~LogContractTest() override;

  LogHarness* harness() { return harness_.get(); }

 private:
  std::unique_ptr<LogHarness> harness_;
};

}  // namespace pheromone::cluster
