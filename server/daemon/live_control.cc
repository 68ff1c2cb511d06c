#include "server/daemon/live_control.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <variant>

#include "server/base/format.h"

namespace pheromone::daemon {
namespace {

constexpr std::chrono::milliseconds kBetweenLooks{5};   // at a recording
constexpr std::chrono::milliseconds kHaltPatience{20};  // with the log; robots drive meanwhile
constexpr char kNotYetDurable[] = "applied; not yet durable: a crash may undo it";
constexpr char kSnapshotLate[] =
    "snapshot requested but not finished; its completion will be logged";
constexpr char kBusy[] = "the server is busy with earlier requests; nothing was changed";

Error UnknownLink(std::string_view name, const std::vector<links::LinkConfig>& configured) {
  std::string text = "unknown link \"" + std::string(name) + "\", expected one of ";
  for (const links::LinkConfig& it : configured) {
    text += (&it == &configured.front() ? "" : ", ") + it.name;
  }
  return Error{text};
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

void LiveControl::Submit(const engine::Event& change, const Done& done) {
  std::vector<engine::Outgoing> out;
  const Result<uint64_t> applied = parts_.service->Submit(change, &out);
  parts_.router->Deliver(out);
  DoneIfDurable(applied.ok() ? Ok() : Status(applied.error()), done);
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
  DoneIfDurable(issued, done);
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
    DoneIfDurable(parts_.service->CancelGoal(*index, id), done);
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
  bool logged = true;
  std::vector<engine::Outgoing> out;
  for (size_t i = 0; i < parts_.links->size(); ++i) {
    const engine::CommandIssued halt{static_cast<engine::LinkIndex>(i),
                                     protocol::kBroadcastId,
                                     protocol::CommandCode::kHalt,
                                     {}};
    logged = parts_.service->Issue(halt, &out).ok() && logged;
  }
  parts_.router->Deliver(out);
  if (!logged) {
    SendHaltsUnlogged(engine::RobotsPart::kBroadcastTransmissions);
    done(ServedLinks());
    return;
  }
  AwaitDurable(std::min(parts_.patience, kHaltPatience),
               [this, done = std::move(done)](const Status& durable) {
                 if (!durable.ok()) {
                   SendHaltsUnlogged(engine::RobotsPart::kBroadcastTransmissions);
                 }
                 done(ServedLinks());
               });
}

std::vector<std::string> LiveControl::ServedLinks() const {
  std::vector<std::string> names;
  for (const auto& link : *parts_.links) {
    if (link->role() == links::LinkRole::kServes) {
      names.push_back(link->name());
    }
  }
  return names;
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
    DoneIfDurable(parts_.change_tau(type, tau_ms), done);
  };
  if (!parts_.run_operation(change)) {
    done(Error{kBusy});
  }
}

void LiveControl::Reload(DoneWith<std::vector<std::string>> done) {
  const auto reload = [this, done] {
    if (parts_.cluster && parts_.cluster->has_leader()) {
      // Each server has a certificate and files with keys of its own.
      if (const Status read = parts_.reload_secrets(); !read.ok()) {
        done(Error{"the configuration of this server: " + read.error()});
        return;
      }
      const auto tell = [done](const Result<std::vector<std::string>>& notes) {
        if (notes.ok()) {
          spdlog::info("cluster: the server that leads has read its configuration again");
        } else {
          spdlog::error("cluster: the server that leads did not read its configuration again: {}",
                        notes.error());
        }
        done(notes);
      };
      if (Forwards<std::vector<std::string>>(
              cluster::ReloadRequest{}, tell,
              [](const cluster::OperatorResult& it) { return it.notes; })) {
        return;
      }
    }
    DoneIfDurable(parts_.reload(), done);
  };
  if (!parts_.run_operation(reload)) {
    spdlog::warn("the configuration is unchanged: {}", kBusy);
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

}  // namespace pheromone::daemon
