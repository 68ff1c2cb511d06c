#include "server/daemon/live_control.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>
#include <variant>

#include "server/base/format.h"
#include "server/config/describe.h"
#include "server/config/folders.h"
#include "server/core/field/raster.h"
#include "server/daemon/process_stats.h"
#include "server/operators/control/engine_views.h"

namespace pheromone::daemon {
namespace {

constexpr double kMemoryS = 10;                         // of the links' byte rates
constexpr std::chrono::milliseconds kBetweenLooks{5};   // at a recording
constexpr std::chrono::milliseconds kHaltPatience{20};  // with the log; robots drive meanwhile
constexpr char kNotYetDurable[] = "applied; not yet durable: a crash may undo it";
constexpr char kSnapshotLate[] =
    "snapshot requested but not finished; its completion will be logged";
constexpr char kBusy[] = "the server is busy with earlier requests; nothing was changed";

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

// A byte on a serial line takes ten bits, start and stop included.
std::optional<double> ByteRateOf(const links::LinkConfig& link) {
  return link.kind == links::LinkKind::kSerial ? std::optional(link.baud / 10.0) : std::nullopt;
}

Error UnknownLink(std::string_view name, const std::vector<links::LinkConfig>& configured) {
  std::string text = "unknown link \"" + std::string(name) + "\", expected one of ";
  for (const links::LinkConfig& it : configured) {
    text += (&it == &configured.front() ? "" : ", ") + it.name;
  }
  return Error{text};
}

uint64_t BytesOf(const links::Link& link) {
  const links::LinkCounters counters = link.counters();
  return counters.bytes_in + counters.bytes_out;
}

// An answer that is given once: by the awaited event or by a deadline, whichever comes first. The
// log and the journal may keep it for their lifetime.
template <typename T>
class OneAnswer {
 public:
  OneAnswer(control::Control::DoneWith<T> done, std::weak_ptr<Deadlines> deadlines)
      : done_(std::move(done)), deadlines_(std::move(deadlines)) {}

  void Give(const Result<T>& result) {
    control::Control::DoneWith<T> done;
    std::optional<Deadlines::Id> deadline;
    {
      const std::lock_guard lock(mutex_);
      done.swap(done_);
      deadline.swap(deadline_);
    }
    Cancel(deadline);
    if (done) {
      done(result);
    }
  }

  bool given() const {
    const std::lock_guard lock(mutex_);
    return done_ == nullptr;
  }

  /// The deadline is not needed any more once the answer was given.
  void SetDeadline(Deadlines::Id deadline) {
    {
      const std::lock_guard lock(mutex_);
      if (done_ != nullptr) {
        deadline_ = deadline;
        return;
      }
    }
    Cancel(deadline);
  }

 private:
  void Cancel(const std::optional<Deadlines::Id>& deadline) const {
    const auto deadlines = deadline ? deadlines_.lock() : nullptr;
    if (deadlines != nullptr) {
      deadlines->Cancel(*deadline);
    }
  }

  mutable std::mutex mutex_;
  control::Control::DoneWith<T> done_;
  std::optional<Deadlines::Id> deadline_;
  const std::weak_ptr<Deadlines> deadlines_;
};

// Calls `start` with a function that accepts its result; `late` is the result after `patience`.
template <typename T, typename Start>
void Await(const std::shared_ptr<Deadlines>& deadlines, std::chrono::milliseconds patience,
           const Error& late, control::Control::DoneWith<T> done, Start&& start) {
  const auto answer = std::make_shared<OneAnswer<T>>(std::move(done), deadlines);
  start([answer](const Result<T>& result) { answer->Give(result); });
  if (!answer->given()) {
    answer->SetDeadline(
        deadlines->After(patience, [answer, late](bool /*stopped*/) { answer->Give(late); }));
  }
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
  if (parts_.cluster && parts_.cluster->has_leader()) {
    return Ok();
  }
  if (const std::string trouble = parts_.log->Trouble(); !trouble.empty()) {
    return Error{trouble};
  }
  return parts_.service->Inspect([this](const engine::Engine&) {
    switch (parts_.log->Admit()) {
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

void LiveControl::Edit(const field::FieldEdit& edit, DoneWith<control::EditOutcome> done) {
  if (Forwards<control::EditOutcome>(
          engine::FieldEdited{edit}, done, [](const cluster::OperatorResult& it) {
            return control::EditOutcome{static_cast<uint64_t>(it.nodes), it.changed, it.edit};
          })) {
    return;
  }
  if (!parts_.run_edit([this, edit, done] { EditNow(edit, done); })) {
    done(Error{kBusy});
  }
}

void LiveControl::EditNow(const field::FieldEdit& edit,
                          const DoneWith<control::EditOutcome>& done) {
  const Result<engine::Service::Applied> made = parts_.service->Edit(edit);
  DoneIfDurable(made.ok() ? Result(control::EditOutcome{static_cast<uint64_t>(made.value().nodes),
                                                        made.value().changed, made.value().edit})
                          : made.error(),
                done);
}

void LiveControl::Reverse(bool redo, DoneWith<control::ReverseOutcome> done) {
  if (Forwards<control::ReverseOutcome>(
          engine::EditReversed{redo}, done, [](const cluster::OperatorResult& it) {
            return control::ReverseOutcome{it.info, it.text, it.changed};
          })) {
    return;
  }
  const auto reverse = [this, redo, done] { DoneIfDurable(parts_.service->Reverse(redo), done); };
  if (!parts_.run_edit(reverse)) {
    done(Error{kBusy});
  }
}

template <typename T>
void LiveControl::DoneIfDurable(const Result<T>& made, const DoneWith<T>& done) const {
  if (!made.ok()) {
    done(made);
    return;
  }
  AwaitDurable(parts_.patience, [done, made](const Status& durable) {
    done(durable.ok() ? made : Result<T>(durable.error()));
  });
}

// Waits until all events so far are durable.
void LiveControl::AwaitDurable(std::chrono::milliseconds patience, Done done) const {
  const uint64_t sequence =
      parts_.service->Inspect([](const engine::Engine& engine) { return engine.sequence(); });
  const Error late{kNotYetDurable};
  Await<std::monostate>(deadlines_, patience, late, std::move(done), [&](const Done& give) {
    if (!parts_.log->WhenDurable(sequence, [give] { give(Ok()); })) {
      give(late);  // too many wait already
    }
  });
}

void LiveControl::Issue(std::string_view link, uint8_t id, protocol::CommandCode code,
                        std::span<const uint8_t> arguments, Done done) {
  const auto index = parts_.service->FindLink(link);
  if (!index) {
    done(UnknownLink(link, *parts_.link_configs));
    return;
  }
  engine::CommandIssued command{*index, id, code, {}};
  std::copy_n(arguments.begin(), std::min(arguments.size(), command.arguments.size()),
              command.arguments.begin());
  if (Forwards(command, done)) {
    return;
  }
  std::vector<engine::Outgoing> out;
  const Status issued = parts_.service->Issue(command, &out);
  parts_.router->Deliver(out);
  DoneIfDurable(issued, std::move(done));
}

void LiveControl::DoneIfDurable(const Status& changed, Done done) const {
  if (changed.ok()) {
    AwaitDurable(parts_.patience, std::move(done));
  } else {
    done(changed);
  }
}

// The search for a route takes its time.
void LiveControl::SetGoal(std::string_view link, uint8_t id, field::PointUm point,
                          uint32_t tolerance_um, Done done) {
  const auto index = parts_.service->FindLink(link);
  if (!index) {
    done(UnknownLink(link, *parts_.link_configs));
    return;
  }
  if (Forwards(cluster::GoalRequest{*index, id, point, tolerance_um}, done)) {
    return;
  }
  const auto set = [this, index = *index, id, point, tolerance_um, done] {
    DoneIfDurable(parts_.service->SetGoal(index, id, point, tolerance_um), done);
  };
  if (!parts_.run_edit(set)) {
    done(Error{kBusy});
  }
}

void LiveControl::CancelGoal(std::string_view link, uint8_t id, Done done) {
  const auto index = parts_.service->FindLink(link);
  if (!index) {
    done(UnknownLink(link, *parts_.link_configs));
    return;
  }
  if (!Forwards(cluster::GoalCancellation{*index, id}, done)) {
    DoneIfDurable(parts_.service->CancelGoal(*index, id), std::move(done));
  }
}

// Robots must stop even if the disk does not accept the event. A halt of all robots does not affect
// the state: robots neither acknowledge it nor distinguish one from another. So if the log refuses
// it, or does not make it durable at once, it is sent without the log. Robots may then receive it
// more than three times.
void LiveControl::HaltAll(DoneWith<std::vector<std::string>> done) {
  if (parts_.cluster) {
    parts_.cluster->halt_peers();
  }
  std::vector<std::string> names;
  bool logged = true;
  std::vector<engine::Outgoing> out;
  for (size_t i = 0; i < parts_.links->size(); ++i) {
    const engine::CommandIssued halt{static_cast<engine::LinkIndex>(i),
                                     protocol::kBroadcastId,
                                     protocol::CommandCode::kHalt,
                                     {}};
    logged = parts_.service->Issue(halt, &out).ok() && logged;
    names.push_back((*parts_.links)[i]->name());
  }
  parts_.router->Deliver(out);
  if (!logged) {
    SendHaltsUnlogged(engine::RobotsPart::kBroadcastTransmissions);
    done(names);
    return;
  }
  AwaitDurable(std::min(parts_.patience, kHaltPatience),
               [this, names = std::move(names), done = std::move(done)](const Status& durable) {
                 if (!durable.ok()) {
                   SendHaltsUnlogged(engine::RobotsPart::kBroadcastTransmissions);
                 }
                 done(names);
               });
}

// Once now, and then as often and at the same intervals as the engine.
void LiveControl::SendHaltsUnlogged(int transmissions) {
  protocol::Command halt;
  halt.id = protocol::kBroadcastId;
  halt.code = protocol::CommandCode::kHalt;
  engine::Outgoing outgoing;
  protocol::Encode(halt, &outgoing.message);
  std::vector<engine::Outgoing> out;
  for (size_t i = 0; i < parts_.links->size(); ++i) {
    outgoing.link = static_cast<engine::LinkIndex>(i);
    parts_.captures->Unlogged(outgoing.link, outgoing.message);
    out.push_back(outgoing);
  }
  parts_.router->Deliver(out);
  if (transmissions > 1) {
    deadlines_->After(std::chrono::milliseconds(engine::RobotsPart::kBroadcastIntervalMs),
                      [this, transmissions](bool stopped) {
                        if (!stopped) {
                          SendHaltsUnlogged(transmissions - 1);
                        }
                      });
  }
}

void LiveControl::ChangeTau(uint8_t type, int64_t tau_ms, Done done) {
  if (Forwards(cluster::TauChange{type, tau_ms}, done)) {
    return;
  }
  const auto change = [this, type, tau_ms, done] {
    const Status changed = parts_.change_tau(type, tau_ms);
    if (!changed.ok()) {
      done(changed);
      return;
    }
    AwaitDurable(parts_.patience, done);
  };
  if (!parts_.run_operation(change)) {
    done(Error{kBusy});
  }
}

void LiveControl::Reload(DoneWith<std::vector<std::string>> done) {
  if (Forwards<std::vector<std::string>>(
          cluster::ReloadRequest{}, done,
          [](const cluster::OperatorResult& it) { return it.notes; })) {
    return;
  }
  const auto reload = [this, done] {
    const Result<std::vector<std::string>> notes = parts_.reload();
    if (!notes.ok()) {
      done(notes);
      return;
    }
    AwaitDurable(parts_.patience, [done, notes](const Status& durable) {
      done(durable.ok() ? notes : durable.error());
    });
  };
  if (!parts_.run_operation(reload)) {
    done(Error{kBusy});
  }
}

void LiveControl::Snapshot(DoneWith<std::optional<std::string>> done) {
  Await<std::optional<std::string>>(deadlines_, parts_.snapshot_patience, Error{kSnapshotLate},
                                    std::move(done), parts_.snapshot);
}

void LiveControl::StartCapture(Done done) {
  ChangeCapture(&Captures::Start, done);
}

void LiveControl::StopCapture(Done done) {
  ChangeCapture(&Captures::Stop, done);
}

void LiveControl::ChangeCapture(Status (Captures::*change)(), const Done& done) {
  const auto operation = [this, change, done] {
    const Status changed = (parts_.captures->*change)();
    if (changed.ok()) {
      TellCapture();
      AwaitCapture(std::chrono::steady_clock::now() + parts_.patience, done);
    } else {
      done(changed);
    }
  };
  if (!parts_.run_operation(operation)) {
    done(Error{kBusy});
  }
}

// The recorder's thread does not notify anyone when it has written: it is polled.
void LiveControl::AwaitCapture(TimePoint deadline, const Done& done) {
  if (const std::optional<Status> settled = parts_.captures->Settled()) {
    done(*settled);
    return;
  }
  const auto look_again = [this, deadline, done](bool stopped) {
    if (stopped || std::chrono::steady_clock::now() > deadline) {
      done(Error{parts_.captures->View().folder + ": applied; not yet durable"});
    } else {
      AwaitCapture(deadline, done);
    }
  };
  deadlines_->After(kBetweenLooks, look_again);
}

void LiveControl::TellConfigured() {
  board_.Publish({.topic = control::Notice::Topic::kConfiguration});
}

std::string LiveControl::TellArrival(const engine::GoalEnded& arrival) {
  const std::string robot = "robot " + std::to_string(arrival.id);
  const std::string& link = (*parts_.links)[arrival.link]->name();
  const std::string place = "arrived at (" +
                            FormatNumber(static_cast<double>(arrival.position.x) / 1e6) + ", " +
                            FormatNumber(static_cast<double>(arrival.position.y) / 1e6) + ") m";
  board_.Publish({.topic = control::Notice::Topic::kArrival,
                  .subject = link + ' ' + std::to_string(arrival.id),
                  .text = place});
  return robot + " on link " + link + ' ' + place;
}

void LiveControl::TellCapture() {
  const std::lock_guard lock(telling_);
  const control::CaptureView view = parts_.captures->View();
  if (view.recording != recording_told_) {
    recording_told_ = view.recording;
    board_.Publish(
        {.topic = control::Notice::Topic::kCapture, .is_on = view.recording, .text = view.error});
  }
}

void LiveControl::TellWhatChanged() {
  TellCapture();
  const std::lock_guard lock(telling_);
  const bool first = links_told_.size() != parts_.links->size();
  links_told_.resize(parts_.links->size());
  for (size_t i = 0; i < links_told_.size(); ++i) {
    const links::LinkRecord::State state = (*parts_.links)[i]->state();
    LinkTold now{state.up, state.since, state.reason};
    if (first ? state.up : now != links_told_[i]) {
      board_.Publish({.topic = control::Notice::Topic::kLink,
                      .is_on = state.up,
                      .subject = (*parts_.links)[i]->name(),
                      .text = state.reason});
    }
    links_told_[i] = std::move(now);
  }
  if (std::string trouble = parts_.log->Trouble(); trouble != trouble_told_) {
    board_.Publish(
        {.topic = control::Notice::Topic::kHealth, .is_on = trouble.empty(), .text = trouble});
    trouble_told_ = std::move(trouble);
  }
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
