// What the running server does beside serving robots, once a second: it says what is wrong, tells
// operators and the service manager what has changed, notes the clock, and returns memory that the
// map has released to the system.
//
//   Upkeep upkeep(strand, {.service = &service, .journal = journal.get(), ...});
//   upkeep.Start();
//   upkeep.BeReady();         // the start is over
//   upkeep.Stop();
//   upkeep.Summarise();       // to the log, at the end
//
// From Start to Stop on the executor, which runs one thing at a time, except for DescribeState,
// which any thread may call.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/core/engine/service/service.h"
#include "server/daemon/journal_owner.h"
#include "server/daemon/link_set.h"
#include "server/daemon/live_control.h"
#include "server/daemon/work_queue.h"

namespace pheromone::daemon {

class Upkeep {
 public:
  /// All outlive it.
  struct Parts {
    engine::Service* service = nullptr;
    JournalOwner* journal = nullptr;
    const LinkSet* links = nullptr;
    LiveControl* control = nullptr;
    WorkQueue* operations = nullptr;  ///< for what may take long
    bool is_member = false;           ///< of a cluster: the clock is to be noted
  };
  Upkeep(const boost::asio::any_io_executor& executor, const Parts& parts)
      : parts_(parts), second_(executor), releaser_(executor) {}
  Upkeep(const Upkeep&) = delete;
  Upkeep& operator=(const Upkeep&) = delete;

  void Start();
  void Stop();

  /// Tells the service manager that the start is over.
  void BeReady();
  /// For the service manager.
  std::string DescribeState() const;
  /// Logs what there was.
  void Summarise() const;

 private:
  void ReportTrouble();
  void ReportFieldTime(uint64_t field_ms);
  void NoteClock(uint64_t field_ms);
  void ReleaseMemory();
  void ReleaseMore();
  std::string Trouble() const;

  const Parts parts_;
  boost::asio::steady_timer second_;
  boost::asio::steady_timer releaser_;
  bool is_stopped_ = false;
  bool is_releasing_ = false;
  std::atomic<bool> notes_clock_{false};
  std::string trouble_;  // as reported
  bool has_reported_field_time_ = false;
  std::string told_;  // the service manager
};

}  // namespace pheromone::daemon
