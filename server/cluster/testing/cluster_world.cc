#include "server/cluster/testing/cluster_world.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/core/engine/testing/bench.h"
#include "server/store/journal/service_state.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::cluster {
namespace {

constexpr int64_t kUtcMs = 1'700'000'000'000;

// But for answers that another server sends.
void AppendSent(const std::vector<engine::Outgoing>& out, std::vector<engine::Outgoing>* sent) {
  for (const engine::Outgoing& it : out) {
    if (!it.asker.is_forwarded) {
      sent->push_back(it);
    }
  }
}

}  // namespace

void ClusterWorld::Server::Handle(const std::vector<protocol::Message>& messages) {
  std::vector<engine::Outgoing> out;
  process_->service->Handle(0, messages, &out);
  AppendSent(out, &sent);
}

ClusterWorld::ClusterWorld(std::string nodes) : nodes_(std::move(nodes)) {
  for (const char node : nodes_) {
    servers_.emplace(std::string(1, node),
                     std::unique_ptr<Server>(new Server(static_cast<uint64_t>(node))));
  }
}

void ClusterWorld::Start(const std::string& node) {
  Server& server = *servers_.at(node);
  auto opened = journal::OpenJournal(
      &server.disk_, journal::testing::SmallJournal(), [this] { return now_ms_ * 1'000; },
      [](bool /*is_trouble*/, const std::string& /*text*/) {});
  ASSERT_TRUE(opened.ok()) << opened.error();
  server.process_ = std::make_unique<Server::Process>();
  Server::Process& process = *server.process_;
  const uint64_t last = opened.value().engine.sequence();
  process.journal = std::move(opened.value().journal);
  process.log = std::make_unique<ClusterLog>(
      process.journal.get(),
      ClusterLog::Options{.last = last, .submitted = [&process] { process.wakes = true; }});
  process.service = std::make_unique<engine::Service>(
      process.log.get(),
      [this] {
        return engine::ClockReading{now_ms_, kUtcMs + static_cast<int64_t>(now_ms_)};
      },
      opened.value().stamp.field_time_ms, std::move(opened.value().engine));
  process.replicated = std::make_unique<MemoryLog>(
      &engine_, [this](std::function<void()> call) { calls_.push_back(std::move(call)); });
  ReplicaSettings settings{.node = node, .nodes = {}, .id = server.id};
  for (const char it : nodes_) {
    settings.nodes.emplace_back(1, it);
  }
  process.cluster = std::make_unique<Cluster>(settings, last + 1, server.founds,
                                              process.replicated.get(), PartsOf(node, &process));
  process.service->OnChange(
      [&process](const engine::Event& event) { return process.cluster->Forward(event); });
  process.cluster->Start();
  for (const auto& [other, it] : servers_) {
    if (other != node && it->runs()) {
      process.cluster->OnUp(other);
      it->process_->cluster->OnUp(node);
    }
  }
}

Cluster::Parts ClusterWorld::PartsOf(const std::string& node, Server::Process* process) {
  Server* const server = servers_.at(node).get();
  Cluster::Parts parts;
  parts.service = process->service.get();
  parts.log = process->log.get();
  parts.local = process->journal.get();
  parts.now_ms = [this] { return now_ms_; };
  parts.wake_at = [process](uint64_t at_ms) { process->wake_ms = at_ms; };
  parts.send = [this, node](const std::string& to, const PeerMessage& message) {
    Send(node, to, message);
  };
  parts.send_all = [this, node](const PeerMessage& message) {
    for (const auto& [other, it] : servers_) {
      if (other != node) {
        Send(node, other, message);
      }
    }
  };
  parts.deliver = [server](const std::vector<engine::Outgoing>& out) {
    AppendSent(out, &server->sent);
  };
  parts.on_lead = [this, process](bool leads) {
    if (leads) {
      calls_.emplace_back([this, process] {
        for (const auto& [name, it] : servers_) {
          if (it->process_.get() == process && process->log->leads() &&
              !process->service->Inspect([](const auto& engine) { return engine.configured(); })) {
            (void)process->service->Configure(engine::testing::SmallConfig(), 7);
          }
        }
      });
    }
  };
  parts.restart = [server, process](const std::string& why) {
    server->restarts.push_back(why);
    process->is_to_end = true;
  };
  parts.change = [](const OperatorChange& /*change*/,
                    const std::function<void(OperatorResult)>& done) { done({}); };
  parts.halt = [] {};
  parts.on_id = [server](const std::string& id) {
    server->id = id;
    server->founds = false;
    return Ok();
  };
  parts.freeze = [process]() -> std::unique_ptr<journal::StateSource> {
    return journal::ServiceState::Freeze(process->service.get());
  };
  parts.aside = [this](const std::function<void()>& work, std::function<void()> done) {
    work();
    calls_.push_back(std::move(done));
  };
  parts.folder = &server->disk_;
  parts.end_snapshots = [] {};
  parts.warn = [server](const std::string& text) { server->warnings.push_back(text); };
  return parts;
}

void ClusterWorld::Send(const std::string& from, const std::string& to,
                        const PeerMessage& message) {
  const Result<std::string> frame = EncodePeerMessage(message);
  ASSERT_TRUE(frame.ok()) << frame.error();
  messages_.push_back({from, to, frame.value()});
}

void ClusterWorld::Kill(const std::string& node) {
  Server& server = *servers_.at(node);
  server.process_->cluster->Stop();
  for (const auto& call : std::exchange(calls_, {})) {
    call();  // none is left that knows of the process
  }
  server.process_.reset();
  server.disk_.PowerOn();  // what was not synced may be lost
  for (const auto& [other, it] : servers_) {
    if (it->runs()) {
      it->process_->cluster->OnDown(node);
    }
  }
}

void ClusterWorld::SetCut(const std::string& a, const std::string& b, bool is_cut) {
  for (const auto& pair : {std::pair(a, b), std::pair(b, a)}) {
    if (is_cut) {
      cuts_.insert(pair);
    } else {
      cuts_.erase(pair);
    }
  }
}

bool ClusterWorld::AreConnected(const std::string& a, const std::string& b) {
  return servers_.at(a)->runs() && servers_.at(b)->runs() && !cuts_.contains({a, b});
}

void ClusterWorld::Step() {
  ++now_ms_;
  for (const Message& it : std::exchange(messages_, {})) {
    if (AreConnected(it.from, it.to)) {
      const Result<PeerMessage> message = DecodePeerMessage(std::string_view(it.frame).substr(4));
      ASSERT_TRUE(message.ok()) << message.error();
      servers_.at(it.to)->process_->cluster->OnMessage(it.from, message.value());
    }
  }
  while (!calls_.empty()) {
    const std::function<void()> call = std::move(calls_.front());
    calls_.pop_front();
    call();
  }
  for (const auto& [node, server] : servers_) {
    if (!server->runs()) {
      continue;
    }
    Server::Process& process = *server->process_;
    if (std::exchange(process.wakes, false) || process.wake_ms <= now_ms_) {
      process.cluster->Continue();
    }
    while (process.journal->WriteOnce()) {
    }
    std::vector<engine::Outgoing> out;
    process.service->Release(&out);
    AppendSent(out, &server->sent);
    if (process.is_to_end) {
      Kill(node);
    }
  }
}

void ClusterWorld::Run(uint64_t ms) {
  for (uint64_t i = 0; i < ms; ++i) {
    Step();
  }
}

bool ClusterWorld::RunUntil(const std::function<bool()>& done) {
  for (int i = 0; i < 60'000 && !done(); ++i) {
    Step();
  }
  return done();
}

std::string ClusterWorld::leader() {
  for (const auto& [node, server] : servers_) {
    if (server->runs() && server->process_->log->leads()) {
      return node;
    }
  }
  return "";
}

}  // namespace pheromone::cluster
