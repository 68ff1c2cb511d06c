#include "server/cluster/cluster.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <variant>

#include "server/base/bytes.h"
#include "server/core/engine/event_codec.h"
#include "server/store/journal/format.h"

namespace pheromone::cluster {
namespace {

using engine::Event;
using engine::Outgoing;

constexpr uint64_t kLocalLogPauseMs = 10;  // while the local log admits nothing
// The log keeps what a server that was away for a while needs, up to some 100 MB; beyond that a
// peer's state is asked for.
constexpr uint64_t kBetweenTrimsMs = 5'000;
constexpr uint64_t kAlwaysKept = 10'000;  // events that peers have seen, but perhaps not written
constexpr uint64_t kMaxKept = 1'000'000;  // events, for peers that are away
constexpr uint64_t kBetweenPosesMs = 100;
constexpr uint64_t kStalledMs = 1'000;
constexpr char kNobodyLeads[] = "no server of the cluster leads at present";

}  // namespace

Cluster::Cluster(ReplicaSettings settings, Sequence next, bool founds, ReplicatedLog* log,
                 Parts parts)
    : settings_(settings),
      log_(log),
      parts_(std::move(parts)),
      replica_(
          [&] {
            ReplicaSettings of_replica = settings;
            of_replica.id = founds ? "" : settings.id;
            return of_replica;
          }(),
          next, parts_.now_ms()),
      sender_({.freeze = parts_.freeze,
               .aside = parts_.aside,
               .send = [this](const std::string& to,
                              StatePortion portion) { parts_.send(to, std::move(portion)); }}),
      receiver_({.folder = parts_.folder,
                 .aside = parts_.aside,
                 .end_snapshots = parts_.end_snapshots,
                 .send = [this](const std::string& to,
                                StateRequest request) { parts_.send(to, request); },
                 .done = [this](const Result<uint64_t>& sequence) { OnJoined(sequence); }}),
      founds_(founds),
      noted_id_(founds ? "" : settings.id) {}

void Cluster::Start() {
  parts_.log->SetTrouble(kNobodyLeads);
  news_ms_ = parts_.now_ms();
  Follow();
  Continue();
}

void Cluster::Follow() {
  log_->Follow(replica_.follow_from(), [this](const Result<Page>& page) {
    if (!is_stopped_) {
      OnNews(page);
    }
  });
}

void Cluster::OnNews(const Result<Page>& page) {
  if (page.ok() && Found(page.value())) {
    return;
  }
  if (page.ok()) {
    news_ms_ = parts_.now_ms();
    floor_ = page.value().floor;
    replica_.OnPage(page.value(), news_ms_);
  }
  {
    const std::lock_guard lock(mutex_);
    view_.trouble = page.ErrorOr("");
    view_.id = replica_.id();
  }
  Continue();
}

void Cluster::Continue() {
  if (is_stopped_) {
    return;
  }
  const uint64_t now_ms = parts_.now_ms();
  if (!NoteId()) {
    return;
  }
  replica_.SetHealthy(parts_.local->Trouble().empty() && replica_.gap() == LogGap::kNone);
  EndLead();  // before what another one ordered is applied; what was submitted until now is
              // collected
  for (ClusterLog::Submitted& it : parts_.log->CollectSubmitted()) {
    replica_.Submit(it.sequence, std::move(it.record));
  }
  Replica::Actions actions = replica_.Next(now_ms);
  for (size_t i = 0; i < actions.committed.size(); ++i) {
    Group& group = actions.committed[i];
    if (i < actions.own) {
      parts_.log->Commit(group.first + group.count - 1);
    } else {
      to_apply_.push_back(std::move(group));
    }
  }
  if (actions.is_deposed) {
    parts_.restart("another server of the cluster leads, and changes made here are not in its log");
    Stop();
    return;
  }
  if (!ApplySome()) {
    return;
  }
  if (actions.take_lead) {
    log_->TakeLead(*actions.take_lead, settings_.node, [this](const Result<Leader>& leader) {
      if (!is_stopped_) {
        replica_.OnLead(leader, parts_.now_ms());
        Continue();
      }
    });
  }
  if (actions.append) {
    log_->Append(*actions.append, [this](Appended outcome) {
      if (!is_stopped_) {
        if (outcome == Appended::kFenced) {
          const std::lock_guard lock(mutex_);
          ++view_.fenced;
        }
        replica_.OnAppended(outcome, parts_.now_ms());
        Continue();
      }
    });
  }
  NoteHashes();
  if (actions.heartbeat) {
    Heartbeat& it = *actions.heartbeat;
    if (const auto* const newest = hashes_.Newest(it.next - 1); newest != nullptr) {
      it.hashed = newest->first;
      it.hash = newest->second;
    }
    parts_.send_all(it);
  }
  EndLead();  // Next may have handed over
  BeginLead();
  TrimSometimes(now_ms);
  TellPoses(now_ms);
  sender_.Continue(replica_.committed(), now_ms);
  Join(now_ms);
  TellView();
  const uint64_t deadline = replica_.Deadline();
  parts_.wake_at(to_apply_.empty() ? deadline : std::min(deadline, now_ms + kLocalLogPauseMs));
}

// False: this process ends.
bool Cluster::ApplySome() {
  while (!to_apply_.empty() && parts_.local->Admit() == protocol::Reason::kNone) {
    const Group group = std::move(to_apply_.front());
    to_apply_.pop_front();
    const Status applied = Apply(group);
    if (!applied.ok()) {
      parts_.restart(applied.error());
      Stop();
      return false;
    }
  }
  return true;
}

Status Cluster::Apply(const Group& group) {
  const auto fail = [&group](const std::string& why) {
    return Error{"the group at " + std::to_string(group.first) + " in the cluster's log: " + why};
  };
  std::vector<Outgoing> out;
  journal::RecordReader reader(group.records, 0);
  journal::Record record;
  auto found = reader.Next(&record);
  for (; found == journal::RecordReader::Found::kRecord; found = reader.Next(&record)) {
    if (record.kind != journal::RecordKind::kEvent) {
      return fail("found another record than an event");
    }
    const uint64_t next = parts_.log->appended() + 1;
    if (record.sequence < next) {
      continue;  // the first group may begin before what is needed
    }
    if (record.sequence != next) {
      return fail("found event " + std::to_string(record.sequence) + ", expected event " +
                  std::to_string(next));
    }
    ByteReader bytes(record.event);
    Event event = engine::DecodeEvent(&bytes);
    bytes.ExpectEnd();
    if (!bytes.ok()) {
      return fail(bytes.error());
    }
    const Status followed = parts_.service->Follow(record.stamp, std::move(event), &out);
    if (!followed.ok()) {
      DropState("event " + std::to_string(record.sequence) +
                " of the log is not possible in the state here: " + followed.error());
      break;
    }
  }
  if (found == journal::RecordReader::Found::kBad) {
    return fail(reader.why());
  }
  parts_.deliver(out);
  return Ok();
}

// Between the service's check and its change nothing comes: under its lock.
void Cluster::SetLead(bool leads) {
  parts_.service->Inspect([this, leads](const engine::Engine& /*engine*/) {
    leads ? parts_.log->Lead() : parts_.log->EndLead();
  });
  parts_.on_lead(leads);
}

void Cluster::EndLead() {
  if (parts_.log->leads() && !replica_.admits()) {
    SetLead(false);
  }
}

void Cluster::BeginLead() {
  if (!parts_.log->leads() && replica_.admits() && to_apply_.empty()) {
    SetLead(true);
  }
}

void Cluster::TrimSometimes(uint64_t now_ms) {
  if (!parts_.log->leads() || is_trimming_ || now_ms < trim_ms_) {
    return;
  }
  trim_ms_ = now_ms + kBetweenTrimsMs;
  Sequence seen = replica_.committed() + 1;
  for (const std::string& node : settings_.nodes) {
    const auto told = told_.find(node);
    if (node != settings_.node) {
      seen = std::min(seen, told != told_.end() ? told->second.next : 0);
    }
  }
  const Sequence end = replica_.committed() + 1;
  const Sequence floor =
      std::max(seen - std::min(seen, kAlwaysKept), end - std::min(end, kMaxKept));
  if (floor > trimmed_) {
    is_trimming_ = true;
    log_->Trim(floor, [this, floor](const Status& trimmed) {
      is_trimming_ = false;
      trimmed_ = trimmed.ok() ? floor : trimmed_;
    });
  }
}

// While a majority does not accept what is submitted, more is refused: a robot that waits for its
// answer would stand.
std::string Cluster::Stall(uint64_t now_ms) {
  const Sequence committed = replica_.committed();
  const bool waits = parts_.log->appended() != committed;
  if (!waits || !waited_ || committed != committed_) {
    committed_ = committed;
    progress_ms_ = now_ms;
  }
  waited_ = waits;
  if (now_ms - progress_ms_ < kStalledMs) {
    return "";
  }
  return "no majority of the log's engine (etcd) has accepted changes for " +
         std::to_string((now_ms - progress_ms_) / 1000) + " s";
}

void Cluster::TellView() {
  const Leader& leader = replica_.leader();
  const bool leads = parts_.log->leads();
  const LogGap gap = replica_.gap();
  const bool reaches = !leads && gap == LogGap::kNone && up_.contains(leader.node);
  uint64_t known = replica_.committed();
  for (const auto& [node, beat] : told_) {
    known = std::max(known, beat.next - 1);
  }
  // Not what was appended: the last events of a leader that hands over may never be committed.
  const uint64_t committed = parts_.log->DurableSequence();
  const std::lock_guard lock(mutex_);
  if (leader.term != view_.leader.term && view_.leader.term != 0) {
    ++view_.elections;
  }
  leader_up_ = reaches && forwards_ ? leader.node : "";
  view_.role = replica_.role();
  view_.leader = leader;
  view_.gap = gap;
  view_.divergences = divergences_;
  view_.transfer = DescribeTransfer();
  view_.committed = committed;
  view_.behind = known - std::min(known, committed);
  view_.news_ms = news_ms_;
  parts_.log->SetTrouble(gap != LogGap::kNone ? std::string(TextOf(gap))
                         : leads              ? Stall(parts_.now_ms())
                         : reaches            ? ""
                                              : kNobodyLeads);
}

void Cluster::OnUp(const std::string& node) {
  up_.insert(node);
  Continue();
}

void Cluster::OnDown(const std::string& node) {
  up_.erase(node);
  told_.erase(node);
  hashes_.Forget(node);
  sender_.OnDown(node);
  receiver_.OnDown(node);
  FinishLost("the connection to " + node + ", which leads, was lost",
             [&node](const Awaited& it) { return it.by == node; });
  Continue();
}

template <typename IsLost>
void Cluster::FinishLost(const std::string& why, IsLost&& is_lost) {
  std::vector<uint64_t> lost;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [number, it] : awaited_) {
      if (is_lost(it)) {
        lost.push_back(number);
      }
    }
  }
  for (const uint64_t number : lost) {
    OperatorResult result;
    result.number = number;
    result.text = why + "; the change may still take effect: check in a moment";
    Finish(result);
  }
}

void Cluster::OnNotSent(const PeerMessage& message) {
  if (const auto* change = std::get_if<OperatorChange>(&message)) {
    OperatorResult result;
    result.number = change->number;
    result.text = "the server that leads is not reached; nothing was changed";
    Finish(result);
  }
}

void Cluster::StepDown(const std::string& successor) {
  replica_.StepDown(successor);
  Continue();
}

void Cluster::Stop() {
  is_stopped_ = true;
  log_->Stop();
  sender_.Stop();
  receiver_.Stop();
  EndForwarding();
}

void Cluster::EndForwarding() {
  {
    const std::lock_guard lock(mutex_);
    forwards_ = false;
    leader_up_.clear();
  }
  FinishLost("this server stops", [](const Awaited& /*it*/) { return true; });
}

void Cluster::OnMessage(const std::string& from, const PeerMessage& message) {
  if (is_stopped_) {
    return;
  }
  std::visit(
      [&](const auto& it) {
        using Message = std::decay_t<decltype(it)>;
        if constexpr (std::is_same_v<Message, Heartbeat>) {
          told_[from] = it;
          Compare(from, it);
          replica_.OnHeartbeat(from, it, parts_.now_ms());
          Continue();
        } else if constexpr (std::is_same_v<Message, ForwardedRequest>) {
          Accept(from, it);
        } else if constexpr (std::is_same_v<Message, DirectAnswer>) {
          std::vector<Outgoing> out;
          parts_.service->AnswerForwarded(it.link, it.message, &out);
          parts_.deliver(out);
        } else if constexpr (std::is_same_v<Message, ForwardedEvent>) {
          Accept(it);
        } else if constexpr (std::is_same_v<Message, PosesHeard>) {
          Accept(it);
        } else if constexpr (std::is_same_v<Message, OperatorChange>) {
          parts_.change(it,
                        [this, from](const OperatorResult& result) { parts_.send(from, result); });
        } else if constexpr (std::is_same_v<Message, OperatorResult>) {
          Finish(it);
        } else if constexpr (std::is_same_v<Message, HaltAll>) {
          parts_.halt();
        } else if constexpr (std::is_same_v<Message, StateRequest>) {
          if (replica_.gap() != LogGap::kNone) {
            parts_.send(from, StatePortion{.number = it.number,
                                           .offset = it.offset,
                                           .error = std::string(TextOf(replica_.gap()))});
          } else {
            sender_.OnRequest(from, it, replica_.committed(), parts_.now_ms());
          }
        } else if constexpr (std::is_same_v<Message, StatePortion>) {
          receiver_.OnPortion(from, it, parts_.now_ms());
        }
      },
      message);
}

void Cluster::Accept(const std::string& from, const ForwardedRequest& request) {
  engine::Asker asker;
  asker.is_forwarded = true;
  std::vector<Outgoing> out;
  parts_.service->Handle(request.link, {&request.message, 1}, &out, {&asker, 1});
  for (const Outgoing& it : out) {
    if (it.asker.is_forwarded && it.message.opcode != protocol::kCommand) {
      parts_.send(from, DirectAnswer{it.link, it.message});
    }
  }
  parts_.deliver(out);
}

void Cluster::Accept(const ForwardedEvent& forwarded) {
  std::vector<Outgoing> out;
  if (const auto* pose = std::get_if<engine::PoseObserved>(&forwarded.event)) {
    (void)parts_.service->Observe({pose, 1});
  } else {
    // A second one for the same arrival is refused.
    (void)parts_.service->Submit(std::get<engine::GoalEnded>(forwarded.event), &out);
  }
  parts_.deliver(out);
}

void Cluster::Accept(const PosesHeard& heard) {
  const uint64_t now_ms = FieldTime();
  std::vector<engine::HeardPose> poses;
  for (const PoseHeard& it : heard.poses) {
    poses.push_back({it.link, it.id, it.pose, now_ms - std::min<uint64_t>(now_ms, it.age_ms)});
  }
  parts_.service->NotePoses(poses);
}

uint64_t Cluster::FieldTime() const {
  return parts_.service->Inspect(
      [this](const engine::Engine& /*engine*/) { return parts_.service->FieldTimeInside(); });
}

void Cluster::TellPoses(uint64_t now_ms) {
  if (up_.empty() || now_ms < poses_ms_) {
    return;
  }
  poses_ms_ = now_ms + kBetweenPosesMs;
  const uint64_t field_time_ms = FieldTime();
  const std::vector<engine::HeardPose> poses = parts_.service->PosesSince(told_poses_ms_);
  told_poses_ms_ = field_time_ms;
  for (size_t begin = 0; begin < poses.size(); begin += kMaxPosesAtOnce) {
    PosesHeard message;
    for (size_t i = begin; i < std::min(poses.size(), begin + kMaxPosesAtOnce); ++i) {
      const engine::HeardPose& it = poses[i];
      const uint64_t age_ms = field_time_ms - std::min(field_time_ms, it.at_ms);
      message.poses.push_back({it.link, it.id, it.pose, static_cast<uint32_t>(age_ms)});
      told_poses_ms_ = std::max(told_poses_ms_, it.at_ms);
    }
    parts_.send_all(message);
  }
}

void Cluster::Finish(const OperatorResult& result) {
  std::function<void(OperatorResult)> done;
  {
    const std::lock_guard lock(mutex_);
    const auto found = awaited_.find(result.number);
    if (found == awaited_.end()) {
      return;
    }
    done = std::move(found->second.done);
    awaited_.erase(found);
  }
  done(result);
}

bool Cluster::Forward(const Event& event) {
  PeerMessage message;
  if (const auto* request = std::get_if<engine::RequestReceived>(&event)) {
    message = ForwardedRequest{request->link, request->message};
  } else if (const auto* pose = std::get_if<engine::PoseObserved>(&event)) {
    message = ForwardedEvent{*pose};
  } else if (const auto* ended = std::get_if<engine::GoalEnded>(&event)) {
    message = ForwardedEvent{*ended};
  } else {
    return false;
  }
  std::string to;
  {
    const std::lock_guard lock(mutex_);
    if (leader_up_.empty()) {
      return false;
    }
    to = leader_up_;
    ++view_.forwarded;
  }
  parts_.send(to, std::move(message));
  return true;
}

bool Cluster::Forward(OperatorChange change, std::function<void(OperatorResult)> done) {
  std::string to;
  {
    const std::lock_guard lock(mutex_);
    if (leader_up_.empty()) {
      return false;
    }
    to = leader_up_;
    change.number = ++last_number_;
    awaited_.emplace(change.number, Awaited{to, std::move(done)});
    ++view_.forwarded;
  }
  parts_.send(to, std::move(change));
  return true;
}

ClusterView Cluster::view() const {
  const std::lock_guard lock(mutex_);
  return view_;
}

}  // namespace pheromone::cluster
