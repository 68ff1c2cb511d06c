#include "server/daemon/link_set.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "server/base/random.h"
#include "server/daemon/cluster_member.h"
#include "server/daemon/describe.h"
#include "server/daemon/make_link.h"

namespace pheromone::daemon {
namespace {

void LogOfLink(const links::LinkNotice& notice) {
  const bool good = notice.severity == links::Severity::kInfo;
  spdlog::log(good ? spdlog::level::info : spdlog::level::warn, "{}", links::ToText(notice));
}

// The number of links that open a port; at least one, since a pool must have a thread.
size_t CountPorts(const std::vector<links::LinkConfig>& links) {
  const auto ports = std::count_if(links.begin(), links.end(), [](const links::LinkConfig& it) {
    return it.kind == links::LinkKind::kSerial || it.kind == links::LinkKind::kPty;
  });
  return static_cast<size_t>(std::max<std::ptrdiff_t>(ports, 1));
}

// A port that several servers have, this one among them.
std::optional<cluster::SharedLink> SharedLinkOf(const links::LinkConfig& link,
                                                const std::string& node) {
  // What does not fit into the rest of a lease is not sent. Most transmissions are far shorter.
  constexpr uint64_t kLongBytes = 512;
  const auto own = std::find(link.on.begin(), link.on.end(), node);
  if (link.on.size() < 2 || own == link.on.end()) {
    return std::nullopt;
  }
  cluster::SharedLink shared;
  shared.name = link.name;
  shared.rank = static_cast<uint32_t>(own - link.on.begin());
  shared.lease_ms = std::clamp(2 * kLongBytes * 10'000 / link.baud, cluster::kLinkLeaseMs,
                               cluster::kMaxLinkLeaseMs);
  return shared;
}

}  // namespace

LinkSet::LinkSet(boost::asio::io_context& io, const config::Config& config,
                 engine::Service* service, links::LinkRouter* router, links::Tap* tap)
    : service_(service), keys_(config.keys), used_(config.keys), ports_(CountPorts(config.links)) {
  const std::string node = config.cluster ? config.cluster->node : "";
  std::vector<LinkLeases::Shared> shared;
  for (size_t i = 0; i < config.links.size(); ++i) {
    links::SendPermit* permit = nullptr;
    if (const auto settings = SharedLinkOf(config.links[i], node)) {
      permit = permits_.emplace_back(std::make_unique<links::SendPermit>()).get();
      shared.push_back({nullptr, permit, *settings});
    }
    signing::Signing* signing = nullptr;
    if (config.links[i].security != signing::Security::kOff) {
      signing = signings_
                    .emplace_back(std::make_unique<signing::Signing>(
                        config.links[i].security, keys_[config.links[i].name], FillRandom))
                    .get();
    }
    links_.push_back(MakeLink(io, config.links[i],
                              {.index = static_cast<engine::LinkIndex>(i),
                               .router = router,
                               .log = LogOfLink,
                               .tap = tap,
                               .permit = permit,
                               .signing = signing,
                               .aside = ports_.get_executor(),
                               .backoff = {.seed = static_cast<uint32_t>(Random64())}},
                              node));
    if (permit != nullptr) {
      shared.back().link = links_.back().get();
    }
    required_.push_back(config.links[i].required);
    router->Add(links_.back().get());
  }
  for (const links::TrackerConfig& tracker : config.trackers) {
    const auto log = [name = tracker.name](links::LinkNotice notice) {
      notice.source = name + ": " + notice.source;
      LogOfLink(notice);
    };
    trackers_.push_back(MakeTracker(io, tracker, config.datum, service, log,
                                    {.seed = static_cast<uint32_t>(Random64())}));
  }
  if (!shared.empty()) {
    leases_ = std::make_unique<LinkLeases>(node, Random64(), std::move(shared),
                                           [&config](const boost::asio::any_io_executor& executor) {
                                             return MakeReplicatedLog(executor, *config.cluster);
                                           });
  }
}

bool LinkSet::Start() {
  DropRevoked();
  bool good = true;
  size_t up = 0;
  for (size_t i = 0; i < links_.size(); ++i) {
    const Status status = links_[i]->Start();
    up += status.ok() ? 1u : 0u;
    if (!status.ok() && required_[i]) {
      spdlog::critical("link {} is required but could not be opened: {}", links_[i]->name(),
                       status.error());
      good = false;
    }
  }
  for (const auto& tracker : trackers_) {
    (void)tracker->Start();  // reports errors itself, and retries
  }
  if (good && leases_ != nullptr) {
    leases_->Start();
  }
  if (good) {
    spdlog::info("ready: {} of {} links up", up, links_.size());
  }
  return good;
}

void LinkSet::SetKeys(const LinkKeys& keys) {
  const std::lock_guard lock(keys_mutex_);
  for (auto& [link, its] : keys_) {
    if (const auto read = keys.find(link); read != keys.end()) {
      its = read->second;  // else not signed any more: that requires a restart
    }
  }
  UpdateKeys();
}

void LinkSet::DropRevoked() {
  const std::lock_guard lock(keys_mutex_);
  UpdateKeys();
}

void LinkSet::UpdateKeys() {
  const auto revoked =
      service_->Inspect([](const engine::Engine& engine) { return engine.revoked_keys(); });
  for (const auto& link : links_) {
    const auto used = used_.find(link->name());
    if (used == used_.end()) {
      continue;  // not signed
    }
    signing::Keys valid = Sift(keys_[link->name()], revoked).valid;
    if (valid != used->second) {
      spdlog::info("link {}: keys {}", link->name(), DescribeKeys(used->second, valid));
      used->second = valid;
      link->SetKeys(std::move(valid));
    }
  }
}

void LinkSet::Stop() {
  if (leases_ != nullptr) {
    leases_->Stop();
  }
  for (const auto& link : links_) {
    link->Stop();
  }
  for (const auto& tracker : trackers_) {
    tracker->Stop();
  }
}

size_t LinkSet::CountUp() const {
  return static_cast<size_t>(std::count_if(links_.begin(), links_.end(),
                                           [](const auto& link) { return link->state().up; }));
}

void LinkSet::Summarise() const {
  for (const auto& link : links_) {
    spdlog::info("{}", DescribeLink(link->name(), link->counters()));
  }
}

}  // namespace pheromone::daemon
