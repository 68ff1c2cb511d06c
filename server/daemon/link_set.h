// All links and trackers of the configuration: made, started and stopped together.
//
//   LinkSet links(io, config, &service, &router, &captures);
//   if (links.Start()) ...
//   links.Stop();           // then `io` runs dry
//   links.Summarise();
//
// The messages of links go to the log. Start and Stop: one thread. All arguments outlive it.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/config/config.h"
#include "server/core/engine/service/service.h"
#include "server/daemon/link_leases.h"
#include "server/daemon/revocations.h"
#include "server/robots/links/link.h"
#include "server/robots/links/link_router.h"
#include "server/robots/links/send_permit.h"
#include "server/robots/links/tap.h"
#include "server/robots/links/tracker_link.h"
#include "server/robots/signing/signing.h"

namespace pheromone::daemon {

class LinkSet {
 public:
  LinkSet(boost::asio::io_context& io, const config::Config& config, engine::Service* service,
          links::LinkRouter* router, links::Tap* tap);
  LinkSet(const LinkSet&) = delete;
  LinkSet& operator=(const LinkSet&) = delete;

  /// False if a required link could not be opened. The others keep retrying.
  bool Start();
  void Stop();

  /// Takes the keys of the signed links that are here, without those that the state has as revoked
  /// (engine::RevokedKeys): robots without one are ignored at once. Logs which robots' keys
  /// changed. Any thread.
  void SetKeys(const LinkKeys& keys);
  /// Does that again with the last ones. Any thread, but not under the service's lock.
  void DropRevoked();

  /// In the order of the configuration; always the same.
  const std::vector<std::unique_ptr<links::Link>>& links() const { return links_; }
  /// Likewise.
  const std::vector<std::unique_ptr<links::TrackerLink>>& trackers() const { return trackers_; }
  /// How many are up; any thread.
  size_t CountUp() const;

  /// Logs the statistics of each link.
  void Summarise() const;

 private:
  void UpdateKeys();

  engine::Service* const service_;
  std::mutex keys_mutex_;  // of the next two; before the service's
  LinkKeys keys_;          // of signed links, as read
  LinkKeys used_;          // as the links have them
  std::vector<std::unique_ptr<signing::Signing>> signings_;
  std::vector<std::unique_ptr<links::SendPermit>> permits_;  // of ports that others have, too
  boost::asio::thread_pool ports_;  // opens and closes them: a thread for each
  std::vector<std::unique_ptr<links::Link>> links_;
  std::vector<bool> required_;
  std::vector<std::unique_ptr<links::TrackerLink>> trackers_;
  std::unique_ptr<LinkLeases> leases_;  // null: there are no such ports
};

}  // namespace pheromone::daemon
