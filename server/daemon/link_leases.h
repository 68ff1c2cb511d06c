// Which links this server may send on, of those that several servers have: the thread, the timer
// and the registers around cluster::LinkOwners. A thread of its own, since a lease must not end
// because a large change of the map is being applied.
//
//   LinkLeases leases("a", process, {{&link, &permit, settings}}, make_log);
//   leases.Start();
//   leases.Stop();        // frees what it has, so that another server takes it at once
//
// Start and Stop: one thread. Links and permits outlive it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include "server/cluster/link_owners.h"
#include "server/cluster/replicated_log.h"
#include "server/robots/links/link.h"
#include "server/robots/links/send_permit.h"

namespace pheromone::daemon {

class LinkLeases {
 public:
  struct Shared {
    const links::Link* link = nullptr;
    links::SendPermit* permit = nullptr;
    cluster::SharedLink settings;
  };
  using MakeLog = std::function<std::unique_ptr<cluster::ReplicatedLog>(
      const boost::asio::any_io_executor& executor)>;

  /// `process`: random.
  LinkLeases(const std::string& node, uint64_t process, std::vector<Shared> links,
             const MakeLog& make_log);
  LinkLeases(const LinkLeases&) = delete;
  LinkLeases& operator=(const LinkLeases&) = delete;
  ~LinkLeases() { Stop(); }

  void Start();
  void Stop();

 private:
  void Continue();

  boost::asio::io_context io_;
  boost::asio::steady_timer timer_;
  const std::vector<Shared> links_;
  cluster::LinkOwners owners_;
  const std::unique_ptr<cluster::ReplicatedLog> log_;
  uint64_t end_ms_ = UINT64_MAX;  // for how long it tries to free them
  bool is_ended_ = false;
  std::thread thread_;
};

}  // namespace pheromone::daemon
