// What an operator sees of the running server.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include "server/config/describe.h"
#include "server/config/folders.h"
#include "server/daemon/live_control.h"
#include "server/daemon/process_stats.h"
#include "server/operators/control/engine_views.h"

namespace pheromone::daemon {
namespace {

constexpr double kMemoryS = 10;  // of the links' byte rates

using TimePoint = std::chrono::steady_clock::time_point;

double SecondsSince(TimePoint then) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - then).count();
}

std::optional<double> SecondsSince(std::optional<TimePoint> then) {
  return then ? std::optional(SecondsSince(*then)) : std::nullopt;
}

// 0 for what is due.
std::optional<double> SecondsUntil(std::optional<TimePoint> then) {
  return then ? std::optional(std::max(0.0, -SecondsSince(*then))) : std::nullopt;
}

std::vector<control::NamedCount> CountsOf(const links::LinkCounters& counters) {
  std::vector<control::NamedCount> counts;
  for (const links::LinkCounter& it : links::kLinkCounters) {
    counts.push_back({it.name, it.help, it.count(counters), it.kind != links::CounterKind::kTraffic,
                      it.kind == links::CounterKind::kLoss});
  }
  return counts;
}

std::string_view NameOf(links::LinkKind kind) {
  switch (kind) {
    case links::LinkKind::kPty:
      return "pty";
    case links::LinkKind::kSerial:
      return "serial";
    case links::LinkKind::kTcp:
      return "tcp";
    case links::LinkKind::kUdp:
      break;
  }
  return "udp";
}

std::string_view NameOf(links::LinkRole role) {
  switch (role) {
    case links::LinkRole::kStandby:
      return "standby";
    case links::LinkRole::kElsewhere:
      return "elsewhere";
    case links::LinkRole::kServes:
      break;
  }
  return "serves";
}

// A byte on a serial line takes ten bits, start and stop included.
std::optional<double> ByteRateOf(const links::LinkConfig& link) {
  return link.kind == links::LinkKind::kSerial ? std::optional(link.baud / 10.0) : std::nullopt;
}

uint64_t BytesOf(const links::Link& link) {
  const links::LinkCounters counters = link.counters();
  return counters.bytes_in + counters.bytes_out;
}

}  // namespace

std::string TroubleWithFieldTime(uint64_t now_ms) {
  return now_ms < engine::kMaxFieldTimeMs
             ? std::string()
             : "field time has reached its end after 139 years and nothing evaporates any more: "
               "stop "
               "with --save-field, move the journal away and start with --load-field";
}

control::StatusView LiveControl::GetStatus(bool with_hash) const {
  control::StatusView status;
  parts_.service->InspectTraffic([&](const engine::Engine& engine, const engine::Traffic& traffic) {
    status.field_time_ms = parts_.now_ms();
    control::AddEngine(engine, traffic, &status);
    status.durable_sequence = std::min(parts_.log->DurableSequence(), engine.sequence());
    if (with_hash) {
      status.state_hash = engine.StateHash();
    }
  });
  status.latency = parts_.router->latency();
  status.version = PHEROMONE_VERSION;
  status.uptime_s = SecondsSince(started_);
  status.service = parts_.service->counters();
  status.is_kept = parts_.is_kept;
  status.links = parts_.links->size();
  for (const auto& link : *parts_.links) {
    status.links_up += link->state().up ? 1u : 0u;
  }
  const ProcessStats process = ReadProcessFigures();
  status.resident_bytes = process.resident_bytes;
  status.open_descriptors = process.open_descriptors;
  status.cpu_s = process.cpu_s;
  status.capture = GetCapture();
  if (parts_.cluster) {
    status.cluster = parts_.cluster->view();
  }
  if (const Status health = CheckHealth(); !health.ok()) {
    status.warning = health.error();
  }
  return status;
}

std::vector<control::LinkView> LiveControl::GetLinks() const {
  const std::vector<links::LinkConfig>& configured = *parts_.link_configs;
  const auto revoked =
      parts_.service->Inspect([](const engine::Engine& engine) { return engine.revoked_keys(); });
  const LinkKeys keys = revoked.keys().empty() ? LinkKeys() : parts_.keys();
  const std::lock_guard lock(mutex_);
  std::vector<control::LinkView> views;
  for (size_t i = 0; i < parts_.links->size(); ++i) {
    const links::Link& link = *(*parts_.links)[i];
    const links::LinkRecord::State state = link.state();
    const links::LinkCounters counters = link.counters();
    control::LinkView& view = views.emplace_back();
    view.name = link.name();
    view.kind = NameOf(configured[i].kind);
    view.address = link.address();
    view.terminal = configured[i].path.empty() ? "" : config::AbsolutePath(configured[i].path);
    view.role = NameOf(link.role());
    view.nodes = configured[i].on;
    view.owner = link.owner();
    view.up = state.up;
    view.state = state.reason;
    view.since_s = SecondsSince(state.since);
    view.last_error = state.last_error;
    view.failed_attempts = state.failed_attempts;
    view.next_attempt_s = SecondsUntil(state.next_attempt);
    view.silent_s = SecondsSince(counters.heard);
    view.silent = state.silent;
    view.byte_rate = ByteRateOf(configured[i]);
    view.bytes_per_s = i < samples_.size() ? samples_[i].bytes_per_s : 0;
    view.counters = CountsOf(counters);
    if (const auto its = keys.find(link.name()); its != keys.end()) {
      view.revoked = Sift(its->second, revoked).revoked;
    }
  }
  return views;
}

std::vector<control::TrackerView> LiveControl::GetTrackers() const {
  std::vector<control::TrackerView> views;
  for (const auto& tracker : *parts_.trackers) {
    const links::LinkRecord::State state = tracker->state();
    const links::TrackerCounters counters = tracker->counters();
    control::TrackerView& view = views.emplace_back();
    view.name = tracker->name();
    view.address = state.address;
    view.up = state.up;
    view.state = state.reason;
    view.datagrams = counters.datagrams;
    view.poses = counters.poses;
    view.last_refusal = counters.last_fault;
    for (size_t i = 0; i < counters.faults.size(); ++i) {
      if (counters.faults[i] != 0) {
        const auto fault = static_cast<links::TrackerFault>(i);
        view.refusals.push_back({std::string(links::TextOf(fault)), counters.faults[i]});
      }
    }
  }
  return views;
}

// Link by link, so that robots wait for a copy of 254 robots at the most.
std::vector<control::ClientView> LiveControl::GetClients() const {
  std::vector<control::ClientView> views;
  bool is_last = false;
  for (engine::LinkIndex link = 0; !is_last; ++link) {
    parts_.service->InspectTraffic(
        [&](const engine::Engine& engine, const engine::Traffic& traffic) {
          is_last = link + size_t{1} >= engine.config().links.size();
          control::AddClients(engine, traffic, link, parts_.now_ms(), &views);
        });
  }
  return views;
}

control::FieldView LiveControl::GetField() const {
  return parts_.service->Inspect(
      [this](const engine::Engine& engine) { return control::FieldOf(engine, parts_.now_ms()); });
}

std::vector<field::Path> LiveControl::GetPaths() const {
  return parts_.service->Inspect(
      [](const engine::Engine& engine) { return engine.config().field.paths; });
}

control::ConfigView LiveControl::GetConfig() const {
  const config::Config config = parts_.config();
  std::vector<std::string> lines = config::DescribeConfig(config);
  const std::vector<std::string> reach =
      config::DescribeReach(config, std::getenv("RUNTIME_DIRECTORY"));
  const config::FolderReport folders =
      config::LookAtFolders(config, std::getenv("STATE_DIRECTORY"));
  lines.insert(lines.end(), reach.begin(), reach.end());
  lines.insert(lines.end(), folders.lines.begin(), folders.lines.end());
  return {std::move(lines), config.file,
          config::JournalFolder(config.journal, std::getenv("STATE_DIRECTORY"))};
}

Status LiveControl::CheckHealth() const {
  if (const std::string trouble = parts_.log->Trouble(); !trouble.empty()) {
    return Error{trouble};
  }
  const bool follows = parts_.cluster && parts_.cluster->has_leader();
  return parts_.service->Inspect([this, follows](const engine::Engine&) {
    switch (follows ? protocol::Reason::kNone : parts_.log->Admit()) {
      case protocol::Reason::kNone:
        break;
      case protocol::Reason::kBusy:
        return Status(Error{"the log is busy"});
      default:
        return Status(Error{"the log does not accept changes"});
    }
    const std::string trouble = TroubleWithFieldTime(parts_.now_ms());
    return trouble.empty() ? Ok() : Status(Error{trouble});
  });
}

// An exponential moving average, for any interval between calls.
void LiveControl::SampleLinks() {
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard lock(mutex_);
  const bool first = samples_.size() != parts_.links->size();
  samples_.resize(parts_.links->size());
  const double passed_s = std::chrono::duration<double>(now - sampled_).count();
  const double share = 1 - std::exp(-passed_s / kMemoryS);
  for (size_t i = 0; i < samples_.size(); ++i) {
    Sample& sample = samples_[i];
    const uint64_t bytes = BytesOf(*(*parts_.links)[i]);
    if (!first && passed_s > 0) {
      const double rate = static_cast<double>(bytes - sample.bytes) / passed_s;
      sample.bytes_per_s += share * (rate - sample.bytes_per_s);
    }
    sample.bytes = bytes;
  }
  sampled_ = now;
}

}  // namespace pheromone::daemon
