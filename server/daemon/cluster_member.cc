#include "server/daemon/cluster_member.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <utility>
#include <variant>

#include <boost/asio/post.hpp>

#include "server/base/format.h"
#include "server/base/random.h"
#include "server/cluster/etcd_log.h"
#include "server/daemon/service_manager.h"

namespace pheromone::daemon {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr size_t kMaxSending = 4'096;  // messages on their way to the thread; robots repeat theirs
constexpr uint64_t kBetweenViewsMs = 20;
constexpr milliseconds kBetweenLooks{20};
constexpr milliseconds kBetweenTold{5'000};
constexpr milliseconds kHandOverPatience{2'000};

uint64_t NowMs() {
  return static_cast<uint64_t>(
      std::chrono::duration_cast<milliseconds>(steady_clock::now().time_since_epoch()).count());
}

std::string_view NameOf(cluster::Role role) {
  switch (role) {
    case cluster::Role::kLeads:
      return "leads";
    case cluster::Role::kTakes:
      return "takes the lead";
    case cluster::Role::kCatchesUp:
      return "catches up";
    case cluster::Role::kFollows:
    case cluster::Role::kDeposed:
      break;
  }
  return "follows";
}

cluster::ReplicaSettings ReplicaSettingsOf(const config::ClusterSettings& settings,
                                           const std::string& id) {
  cluster::ReplicaSettings replica;
  replica.id = id;
  replica.node = settings.node;
  for (const auto& node : settings.nodes) {
    replica.nodes.push_back(node.name);
  }
  replica.suspect_ms = settings.suspect_ms;
  replica.group_ms = settings.group_ms;
  return replica;
}

// The member on this machine is asked first.
cluster::EtcdSettings EtcdSettingsOf(const config::ClusterSettings& settings,
                                     const std::string& id_to_found) {
  cluster::EtcdSettings etcd;
  etcd.cluster = settings.name;
  etcd.members = settings.engine;
  const auto own = std::find_if(settings.nodes.begin(), settings.nodes.end(),
                                [&](const auto& node) { return node.name == settings.node; });
  const auto here = std::find_if(etcd.members.begin(), etcd.members.end(), [&](const auto& it) {
    return own != settings.nodes.end() && it.address == own->address.address;
  });
  etcd.has_own_member = here != etcd.members.end();
  std::rotate(etcd.members.begin(), etcd.has_own_member ? here : etcd.members.begin(),
              etcd.has_own_member ? std::next(here) : etcd.members.begin());
  etcd.new_id = id_to_found.empty() ? HexText(Random64()) : id_to_found;
  return etcd;
}

void ReportEtcd(const Endpoint& member, const Status& status) {
  if (status.ok()) {
    spdlog::info("cluster: etcd at {} responds again", ToText(member));
  } else {
    spdlog::warn("cluster: {}", status.error());
  }
}

}  // namespace

std::unique_ptr<cluster::ReplicatedLog> MakeReplicatedLog(
    const boost::asio::any_io_executor& executor, const config::ClusterSettings& settings,
    const std::string& id_to_found, cluster::EtcdClient::OnMember on_member) {
  cluster::EtcdSettings etcd = EtcdSettingsOf(settings, id_to_found);
  etcd.on_member = std::move(on_member);
  return std::make_unique<cluster::EtcdLog>(executor, std::move(etcd));
}

ClusterMember::ClusterMember(const config::ClusterSettings& settings, uint64_t links_hash,
                             Local local)
    : settings_(settings),
      local_(std::move(local)),
      work_(boost::asio::make_work_guard(io_)),
      timer_(io_),
      log_(local_.log, {.last = local_.last,
                        .submitted = [this] { Wake(); },
                        .committed = [this] { uses_.committed(); }}) {
  cluster::PeersSettings peers;
  peers.own.versions.program = PHEROMONE_VERSION;
  peers.own.cluster = settings_.name;
  peers.own.node = settings_.node;
  peers.own.id = local_.founds ? "" : local_.id;
  peers.own.links_hash = links_hash;
  peers.own.instance = Random64();
  for (const auto& node : settings_.nodes) {
    peers.nodes.emplace(node.name, node.address);
  }
  peers.secret = settings_.secret;
  peers.seed = static_cast<uint32_t>(Random64());
  peers_ = std::make_unique<cluster::Peers>(
      io_.get_executor(), std::move(peers),
      cluster::PeersCallbacks{
          .on_message =
              [this](const std::string& node, const cluster::PeerMessage& message) {
                cluster_->OnMessage(node, message);
              },
          .on_up =
              [this](const std::string& node, const cluster::Greeting& /*greeting*/) {
                spdlog::info("cluster: connected to {}", node);
                cluster_->OnUp(node);
              },
          .on_down =
              [this](const std::string& node, const std::string& why) {
                spdlog::warn("cluster: the connection to {} ended: {}", node, why);
                told_down_[node].insert(why);
                cluster_->OnDown(node);
              },
          .on_warning = [](const std::string& text) { spdlog::warn("cluster: {}", text); }});
  replicated_ =
      MakeReplicatedLog(io_.get_executor(), settings_, local_.founds ? local_.id : "", ReportEtcd);
}

ClusterMember::~ClusterMember() {
  Stop();
}

Status ClusterMember::Start(Uses uses) {
  uses_ = std::move(uses);
  cluster_ = std::make_unique<cluster::Cluster>(
      ReplicaSettingsOf(settings_, local_.id), log_.appended() + 1, local_.founds,
      replicated_.get(),
      cluster::Cluster::Parts{
          .service = uses_.service,
          .log = &log_,
          .local = local_.log,
          .now_ms = NowMs,
          .wake_at = [this](uint64_t at_ms) { WakeAt(at_ms); },
          .send = [this](const std::string& to,
                         cluster::PeerMessage message) { Send(to, std::move(message)); },
          .send_all = [this](const cluster::PeerMessage& message) { peers_->SendAll(message); },
          .deliver = [this](const std::vector<engine::Outgoing>& out) { uses_.deliver(out); },
          .on_lead =
              [this](bool leads) {
                spdlog::info("cluster: this server {}", leads ? "leads" : "does not lead any more");
                if (leads) {
                  replicated_->Transfer([](const Status& /*moved*/) {});
                }
              },
          .restart = [this](const std::string& why) { uses_.restart(why); },
          .change = uses_.change,
          .halt = uses_.halt,
          .on_id = [this](const std::string& id) { return NoteId(id); },
          .freeze = uses_.freeze,
          .aside =
              [this](std::function<void()> work, std::function<void()> done) {
                boost::asio::post(aside_, [this, work = std::move(work), done = std::move(done)] {
                  work();
                  boost::asio::post(io_, done);
                });
              },
          .folder = local_.folder,
          .end_snapshots = local_.end_snapshots,
          .warn = [](const std::string& text) { spdlog::error("cluster: {}", text); }});
  PHEROMONE_TRY_STATUS(peers_->Listen());
  boost::asio::post(io_, [this] { cluster_->Start(); });
  thread_ = std::thread([this] { io_.run(); });
  return Ok();
}

Status ClusterMember::NoteId(const std::string& id) {
  PHEROMONE_TRY_STATUS(local_.note_id(id));
  peers_->SetId(id);
  spdlog::info("cluster: the log of {} has the ID {}", settings_.name, id);
  return Ok();
}

// Each reason once, until there is a connection.
void ClusterMember::ReportPeers() {
  for (const cluster::PeerState& peer : peer_states_) {
    if (peer.is_up) {
      told_down_.erase(peer.node);
    } else if (!peer.why_down.empty() && told_down_[peer.node].insert(peer.why_down).second) {
      spdlog::warn("cluster: no connection to {}: {}", peer.node, peer.why_down);
    }
  }
}

void ClusterMember::Wake() {
  if (!wakes_.exchange(true)) {
    boost::asio::post(io_, [this] {
      wakes_ = false;
      cluster_->Continue();
    });
  }
}

void ClusterMember::WakeAt(uint64_t at_ms) {
  if (const uint64_t now_ms = NowMs(); now_ms >= told_ms_ + kBetweenViewsMs) {
    told_ms_ = now_ms;
    {
      const std::lock_guard lock(mutex_);
      peer_states_ = peers_->states();
      changed_.notify_all();
    }
    ReportPeers();
  }
  if (at_ms == UINT64_MAX) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(steady_clock::time_point(milliseconds(at_ms)));
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      cluster_->Continue();
    }
  });
}

void ClusterMember::Send(const std::string& to, cluster::PeerMessage message) {
  // Somebody waits for the result of an operator's change; operators are few.
  const bool must_be_told = std::holds_alternative<cluster::OperatorChange>(message);
  if (sending_ >= kMaxSending && !must_be_told) {
    return;
  }
  ++sending_;
  boost::asio::post(io_, [this, to, message = std::move(message)] {
    --sending_;
    if (!peers_->Send(to, message)) {
      cluster_->OnNotSent(message);
    }
  });
}

ClusterMember::Begun ClusterMember::AwaitBegin() {
  auto told_at = steady_clock::now();
  service_manager::Starting("waiting for the cluster");
  for (;;) {
    const cluster::ClusterView view = cluster_->view();
    const bool is_configured =
        uses_.service->Inspect([](const engine::Engine& engine) { return engine.configured(); });
    if (log_.leads()) {
      return Begun::kLeads;
    }
    const bool is_barred =
        view.gap == cluster::LogGap::kRewound || view.gap == cluster::LogGap::kOtherLog;
    if (is_configured && is_barred) {
      spdlog::error("cluster: {}", TextOf(view.gap));
      return Begun::kFollows;
    }
    if (is_configured && view.behind == 0 && cluster_->has_leader()) {
      return Begun::kFollows;
    }
    if (steady_clock::now() - told_at >= kBetweenTold) {
      told_at = steady_clock::now();
      const std::string text = "waiting for the cluster: " + DescribeWait();
      service_manager::Starting(text);
      spdlog::info("{}", text);
    }
    std::unique_lock lock(mutex_);
    if (changed_.wait_for(lock, kBetweenLooks, [this] { return interrupted_; })) {
      return Begun::kStopped;
    }
  }
}

std::string ClusterMember::DescribeWait() const {
  const cluster::ClusterView view = cluster_->view();
  std::string text = !view.trouble.empty()                ? view.trouble
                     : view.gap != cluster::LogGap::kNone ? std::string(TextOf(view.gap))
                     : view.leader.node.empty()           ? "no server leads"
                     : view.behind > 0 ? std::to_string(view.behind) + " events are to be applied"
                                       : view.leader.node + " is to lead";
  text += view.transfer.empty() ? "" : "; " + view.transfer;
  const std::lock_guard lock(mutex_);
  for (const cluster::PeerState& peer : peer_states_) {
    text += peer.is_up || peer.why_down.empty() ? "" : "; " + peer.node + ": " + peer.why_down;
  }
  return text;
}

void ClusterMember::Interrupt() {
  const std::lock_guard lock(mutex_);
  interrupted_ = true;
  changed_.notify_all();
}

LiveCluster ClusterMember::live() {
  return {
      .forward =
          [this](cluster::OperatorChange change,
                 std::function<void(cluster::OperatorResult)> done) {
            return cluster_->Forward(std::move(change), std::move(done));
          },
      .has_leader = [this] { return cluster_->has_leader(); },
      .halt_peers = [this] { HaltPeers(); },
      .view = [this] { return View(); },
      .step_down = [this](std::string_view successor,
                          control::Control::Done done) { StepDown(std::string(successor), done); }};
}

void ClusterMember::HaltPeers() {
  boost::asio::post(io_, [this] { peers_->SendAll(cluster::HaltAll{}); });
}

void ClusterMember::StepDown(const std::string& successor, const control::Control::Done& done) {
  if (!log_.leads()) {
    const std::string leader = cluster_->view().leader.node;
    done(Error{"this server does not lead; " +
               (leader.empty() ? "no server does" : "node " + leader + " does")});
    return;
  }
  const bool is_other =
      successor.empty() || (successor != settings_.node &&
                            std::any_of(settings_.nodes.begin(), settings_.nodes.end(),
                                        [&](const auto& node) { return node.name == successor; }));
  if (!is_other) {
    done(Error{"successor \"" + successor + "\": expected another node of the cluster"});
    return;
  }
  boost::asio::post(io_, [this, successor, done] {
    cluster_->StepDown(successor);
    done(Ok());
  });
}

void ClusterMember::HandOver() {
  if (thread_.joinable() && log_.leads()) {
    boost::asio::post(io_, [this] { cluster_->StepDown(""); });
    const auto until = steady_clock::now() + kHandOverPatience;
    while (steady_clock::now() < until && (log_.leads() || !cluster_->has_leader())) {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kBetweenLooks);
    }
  }
}

control::ClusterView ClusterMember::View() const {
  const cluster::ClusterView now = cluster_->view();
  control::ClusterView view;
  view.name = settings_.name;
  view.node = settings_.node;
  view.role = NameOf(now.role);
  view.leader = now.leader.node;
  view.term = now.leader.term;
  view.committed = now.committed;
  view.behind = now.behind;
  view.heard_s = static_cast<double>(NowMs() - std::min(NowMs(), now.news_ms)) / 1e3;
  view.elections = now.elections;
  view.fenced = now.fenced;
  view.forwarded = now.forwarded;
  view.divergences = now.divergences;
  view.transfer = now.transfer;
  view.trouble = now.trouble;
  view.gap = cluster::TextOf(now.gap);
  const std::lock_guard lock(mutex_);
  for (const cluster::PeerState& peer : peer_states_) {
    view.peers.push_back({peer.node, peer.is_up, peer.is_up ? peer.program : peer.why_down});
  }
  return view;
}

void ClusterMember::EndForwarding() {
  boost::asio::post(io_, [this] { cluster_->EndForwarding(); });
}

void ClusterMember::Stop() {
  if (!thread_.joinable()) {
    return;
  }
  boost::asio::post(io_, [this] {
    cluster_->Stop();
    peers_->Stop();
    timer_.cancel();
    work_.reset();
  });
  thread_.join();
  aside_.join();
  io_.restart();
  io_.poll();  // what was done aside is dropped while the service is there
}

std::unique_ptr<ClusterMember> MakeMember(const config::Config& config, JournalOwner* journal) {
  if (!config.cluster) {
    return nullptr;
  }
  const journal::Membership membership = journal->membership().Get();
  ClusterMember::Local local;
  local.log = journal->log();
  local.last = journal->last_sequence();
  local.folder = journal->files();
  local.id = membership.id;
  local.founds = membership.founds;
  local.note_id = [journal, name = config.cluster->name](const std::string& id) {
    return journal->membership().Note(name, id);
  };
  local.end_snapshots = [journal] {
    journal->EndSnapshots("the state of another server of the cluster is taken in its place");
  };
  return std::make_unique<ClusterMember>(*config.cluster, config::LinksHash(config),
                                         std::move(local));
}

}  // namespace pheromone::daemon
