// The log in memory, for tests: one engine, a client for each node, and faults.
//
//   MemoryEngine engine("id-1");
//   MemoryLog a(&engine, post);
//   a.SetFault(MemoryLog::Fault::kAnswerLost);
//   a.Append(group, done);        // done(kUnknown), and it is in the log
//
// A request is executed inside of its call, or never, or at Release; `post` runs a function later:
// what it is given is all that calls back. No clock: a lost request fails at once.
//
// One thread. The engine outlives its clients.
#pragma once

#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "server/base/result.h"
#include "server/cluster/replicated_log.h"

namespace pheromone::cluster {

class MemoryLog;

class MemoryEngine {
 public:
  explicit MemoryEngine(std::string new_id = "memory") : new_id_(std::move(new_id)) {}

  const Leader& leader() const { return leader_; }
  Sequence floor() const { return floor_; }
  const std::map<Sequence, Group>& groups() const { return groups_; }

  /// Requests that are under way, of all clients, also of those that are no more.
  size_t held() const { return held_.size(); }
  /// They arrive, in their order.
  void Release();

  /// Of a log that was lost and begun anew.
  void Wipe(std::string new_id);
  /// As if restored from a backup: forgets groups that begin at `from` or later.
  void Forget(Sequence from);

 private:
  friend class MemoryLog;

  Leader TakeLead(Term seen, const std::string& node);
  Appended Append(const Group& group);
  void Trim(Sequence floor);
  Register Set(const std::string& name, uint64_t seen, const std::string& value);
  void Publish();

  std::string new_id_;
  std::string id_;
  uint64_t revision_ = 0;
  Leader leader_;
  Sequence floor_ = 1;
  std::map<Sequence, Group> groups_;
  std::map<std::string, Register> registers_;
  std::list<std::function<void()>> held_;
  std::list<MemoryLog*> clients_;
};

class MemoryLog final : public ReplicatedLog {
 public:
  using Post = std::function<void(std::function<void()>)>;

  MemoryLog(MemoryEngine* engine, Post post);
  ~MemoryLog() override;

  enum class Fault : uint8_t {
    kNone,
    kRequestLost,  ///< on its way to the engine
    kAnswerLost,   ///< executed, but the caller is not told
    kDelayed,      ///< executed at Release; then the caller is told
    kDoubled,      ///< executed now, and its copy at Release
  };
  /// Of the requests from now on.
  void SetFault(Fault fault) { fault_ = fault; }
  /// Tells the callers of delayed requests that there was no answer. Release executes them yet.
  void GiveUp();
  /// Cut off from the engine: requests are lost, and there are no news.
  void SetCutOff(bool is_cut_off);
  /// As a process that is stopped: nothing calls back until it goes on.
  void SetPaused(bool is_paused);

  void TakeLead(Term seen, const std::string& node,
                std::function<void(const Result<Leader>&)> done) override;
  void Append(const Group& group, std::function<void(Appended)> done) override;
  void Follow(Sequence from, std::function<void(const Result<Page>&)> news) override;
  void Trim(Sequence floor, std::function<void(const Status&)> done) override;
  /// Counts; there is nothing to move.
  void Transfer(std::function<void(const Status&)> done) override;
  void ReadRegister(const std::string& name,
                    std::function<void(const Result<Register>&)> done) override;
  void SetRegister(const std::string& name, uint64_t seen, const std::string& value,
                   std::function<void(const Result<Register>&)> done) override;
  void Stop() override;

  int transfers() const { return transfers_; }

 private:
  friend class MemoryEngine;

  template <typename Outcome>
  void Request(std::function<Outcome()> execute, std::function<void(Outcome)> done,
               Outcome no_answer);
  void CallBack(std::function<void()> call);
  void TellNews();
  Result<Page> Read();

  MemoryEngine* engine_;
  Post post_;
  Fault fault_ = Fault::kNone;
  bool is_cut_off_ = false;
  bool is_paused_ = false;
  int transfers_ = 0;
  std::list<std::function<void()>> paused_calls_;
  std::list<std::function<void()>> give_up_;  // of delayed requests
  std::shared_ptr<MemoryLog*> self_;          // null in what is posted after Stop

  std::function<void(const Result<Page>&)> news_;
  uint64_t followed_ = 0;  // calls of Follow
  bool is_news_posted_ = false;
  bool is_found_ = false;
  Sequence next_ = 1;
};

}  // namespace pheromone::cluster
