// Several servers of a cluster in one thread and in virtual time: each with its service, its
// journal on a disk of its own and a Cluster, over a log in memory and connected directly.
//
//   ClusterWorld world("ab");
//   world.Start("a");
//   ASSERT_TRUE(world.RunUntil([&] { return world.leader() == "a"; }));
//   world["a"].Handle({Hello(1, 1)});
//   world.Kill("a");
//
// Messages between servers are encoded and decoded, and take a millisecond. A process that asks to
// be restarted is killed; Start begins it again from its disk. The first that leads an empty log
// configures it as SmallConfig.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/cluster/cluster.h"
#include "server/cluster/testing/memory_log.h"
#include "server/store/journal/open.h"
#include "server/store/journal/testing/crash_folder.h"

namespace pheromone::cluster {

class ClusterWorld {
 public:
  /// A machine; what is in `process` ends with it.
  class Server {
   public:
    bool runs() const { return process_ != nullptr; }
    engine::Service& service() { return *process_->service; }
    MemoryLog& log() { return *process_->replicated; }
    journal::testing::CrashFolder& disk() { return disk_; }
    /// Requests of robots at this server; answers come into `sent`.
    void Handle(const std::vector<protocol::Message>& messages);
    uint64_t sequence() { return process_->log->appended(); }
    ClusterView view() { return process_->cluster->view(); }

    std::string id;                     ///< noted beside the journal
    bool founds = false;                ///< of the next process
    std::vector<std::string> restarts;  ///< why it asked for them
    std::vector<std::string> warnings;
    std::vector<engine::Outgoing> sent;  ///< to robots

   private:
    friend class ClusterWorld;
    struct Process {
      std::unique_ptr<journal::LocalJournal> journal;
      std::unique_ptr<ClusterLog> log;
      std::unique_ptr<engine::Service> service;
      std::unique_ptr<MemoryLog> replicated;
      std::unique_ptr<Cluster> cluster;
      uint64_t wake_ms = UINT64_MAX;
      bool wakes = false;
      bool is_to_end = false;
    };
    explicit Server(uint64_t seed) : disk_(seed) {}

    journal::testing::CrashFolder disk_;
    std::unique_ptr<Process> process_;
  };

  /// One letter a node.
  explicit ClusterWorld(std::string nodes);

  Server& operator[](const std::string& node) { return *servers_.at(node); }
  MemoryEngine& engine() { return engine_; }

  void Start(const std::string& node);
  void Kill(const std::string& node);
  /// Messages between them are lost from now on, or not any more.
  void SetCut(const std::string& a, const std::string& b, bool is_cut);

  void Run(uint64_t ms);
  /// False: not within a minute.
  bool RunUntil(const std::function<bool()>& done);
  /// The one that admits changes; its name, or empty.
  std::string leader();

 private:
  struct Message {
    std::string from;
    std::string to;
    std::string frame;
  };

  Cluster::Parts PartsOf(const std::string& node, Server::Process* process);
  void Send(const std::string& from, const std::string& to, const PeerMessage& message);
  bool AreConnected(const std::string& a, const std::string& b);
  void Step();

  const std::string nodes_;
  MemoryEngine engine_;
  uint64_t now_ms_ = 1'000;
  std::map<std::string, std::unique_ptr<Server>> servers_;
  std::set<std::pair<std::string, std::string>> cuts_;
  std::deque<std::function<void()>> calls_;
  std::deque<Message> messages_;
};

}  // namespace pheromone::cluster
