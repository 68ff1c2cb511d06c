#include "client_fw/verify/replica_world.h"

#include <algorithm>
#include <string_view>
#include <tuple>
#include <utility>

namespace pheromone::verify {
namespace {

using cluster::Appended;
using cluster::Group;
using cluster::Leader;
using cluster::Replica;
using cluster::Role;
using cluster::Sequence;
using cluster::Term;

// A record: the change, the node and the process that submitted it.
constexpr size_t kRecordBytes = 3;
// A daemon waits so often for so long, longer than all timers together: a step shorter than what
// Replica takes for not having run.
constexpr int kWaits = 8;
constexpr uint64_t kWaitMs = 140;

std::string NameOf(size_t node) {
  return std::string(1, static_cast<char>('a' + node));
}

std::string RecordOf(int change, size_t node, uint8_t process) {
  return {static_cast<char>('0' + change), static_cast<char>('a' + node),
          static_cast<char>('0' + process)};
}

std::vector<int> ChangesIn(std::string_view records) {
  std::vector<int> changes;
  for (size_t at = 0; at < records.size(); at += kRecordBytes) {
    changes.push_back(records[at] - '0');
  }
  return changes;
}

bool Has(std::string_view records, int change) {
  const std::vector<int> changes = ChangesIn(records);
  return std::find(changes.begin(), changes.end(), change) != changes.end();
}

// The same bytes, shorter if many are 0.
std::string Packed(const std::string& bytes) {
  std::string packed;
  for (size_t at = 0; at < bytes.size(); at += 8) {
    const size_t mask_at = packed.size();
    packed += '\0';
    for (size_t i = at; i < std::min(at + 8, bytes.size()); ++i) {
      if (bytes[i] != 0) {
        packed[mask_at] = static_cast<char>(packed[mask_at] | 1 << (i - at));
        packed += bytes[i];
      }
    }
  }
  return packed;
}

}  // namespace

ReplicaWorld::ReplicaWorld(const ReplicaLimits& limits)
    : left_(limits), log_(limits.log), acknowledged_(static_cast<size_t>(limits.changes)) {
  for (size_t node = 0; node < limits.nodes; ++node) {
    auto it = std::make_shared<Node>(Start(node, 1, 0));
    it->has_page = true;
    it->replica.OnPage(log_.PageOf(0, 0, 1), 0);
    Settle(node, it.get());
    nodes_.push_back(std::move(it));
  }
}

Replica ReplicaWorld::Start(size_t node, Sequence next, uint64_t now_ms) const {
  cluster::ReplicaSettings settings{
      .node = NameOf(node), .nodes = {}, .meet_ms = 300, .group_ms = 0};
  for (size_t one = 0; one < left_.nodes; ++one) {
    settings.nodes.push_back(NameOf(one));
  }
  return Replica(std::move(settings), next, now_ms);
}

void ReplicaWorld::Edit(size_t node, const std::function<void(Node*)>& edit) {
  auto it = std::make_shared<Node>(*nodes_[node]);
  edit(it.get());
  Settle(node, it.get());
  nodes_[node] = std::move(it);
  Forget();
}

// Does all that the replica asks for.
void ReplicaWorld::Perform(size_t node, Node* it) {
  Replica::Actions actions = it->replica.Next(it->now_ms);
  for (size_t i = 0; i < actions.committed.size(); ++i) {
    Deliver(node, it, actions.committed[i], i < actions.own);
  }
  if (actions.is_deposed) {
    if (left_.daemon == DaemonMutant::kContinues) {
      const std::string state = it->state;
      Restart(node, it, it->journal.size() / kRecordBytes, false);
      it->state = state;
    } else {
      Restart(node, it, it->journal.size() / kRecordBytes, false);
    }
    actions = it->replica.Next(it->now_ms);  // nothing, before the first page
  }
  if (actions.take_lead && left_.asks > 0) {  // else it is lost
    --left_.asks;
    it->has_asked = true;
    it->awaits_lead = true;
    Send({.node = node, .is_awaited = true, .seen = *actions.take_lead, .group = {}});
  }
  if (actions.append) {
    it->awaits_append = true;
    if (left_.daemon == DaemonMutant::kReleasesEarly) {
      Acknowledge(actions.append->records, actions.append->term);
    }
    if (left_.daemon == DaemonMutant::kResendsElsewhere &&
        actions.append->first == it->unanswered) {
      actions.append->first = log_.end();
    }
    Send({.node = node, .is_awaited = true, .seen = {}, .group = *actions.append});
  }
}

void ReplicaWorld::Settle(size_t node, Node* it) {
  Perform(node, it);
  ByteWriter writer;
  it->replica.Encode(&writer);
  writer.U8(it->process);
  writer.Text(it->journal);
  writer.Text(it->state);
  writer.U8(static_cast<uint8_t>(it->has_page ? it->shown : it->first_page));
  for (const bool flag : {it->has_page, it->has_asked, it->awaits_lead, it->awaits_append,
                          it->lead_answer.has_value(), it->append_answer.has_value()}) {
    writer.Flag(flag);
  }
  if (it->lead_answer) {
    writer.U64(it->lead_answer->term);
  }
  if (it->append_answer) {
    writer.U8(static_cast<uint8_t>(*it->append_answer));
  }
  writer.U64(it->unanswered);
  it->key = Packed(writer.bytes());
}

void ReplicaWorld::Deliver(size_t node, Node* it, const Group& group, bool is_own) {
  const Sequence next = it->journal.size() / kRecordBytes + 1;
  if (group.first > next) {
    fault_ = NameOf(node) + " was given a group after a gap";
    return;
  }
  const std::string news = group.records.substr((next - group.first) * kRecordBytes);
  it->journal += news;
  if (!is_own) {
    it->state += news;
  } else {
    Acknowledge(news, group.term);
  }
}

void ReplicaWorld::Acknowledge(const std::string& records, Term term) {
  for (const int change : ChangesIn(records)) {
    acknowledged_[static_cast<size_t>(change)] = term;
  }
}

void ReplicaWorld::Restart(size_t node, Node* it, size_t events, bool is_stale) {
  it->journal.resize(events * kRecordBytes);
  it->state = it->journal;
  it->replica = Start(node, events + 1, it->now_ms);
  ++it->process;
  it->first_page = is_stale ? 0 : log_.now();
  it->shown = 0;
  it->has_page = false;
  it->lead_answer.reset();
  it->append_answer.reset();
  it->awaits_lead = false;
  it->awaits_append = false;
  it->unanswered = 0;
  for (Request& request : requests_) {
    request.is_awaited = request.is_awaited && request.node != node;
  }
}

void ReplicaWorld::Send(Request request) {
  requests_.push_back(std::move(request));
}

void ReplicaWorld::Execute(size_t place, bool also_later) {
  const Request request = requests_[place];
  requests_[place].is_awaited = false;
  if (!also_later) {
    requests_.erase(requests_.begin() + static_cast<std::ptrdiff_t>(place));
  }
  auto it = std::make_shared<Node>(*nodes_[request.node]);
  if (request.seen) {
    const Leader answer = log_.TakeLead(*request.seen, NameOf(request.node));
    if (request.is_awaited) {
      it->lead_answer = answer;
    }
  } else {
    const Appended answer = log_.Append(request.group);
    if (request.is_awaited) {
      it->append_answer = answer;
    }
  }
  Settle(request.node, it.get());
  nodes_[request.node] = std::move(it);
  Forget();
}

// Has no answer to an append, or to asking for the lead. False if it is lost and cannot be.
bool ReplicaWorld::GiveUp(size_t node, bool is_append, bool is_lost) {
  --left_.unknowns;
  const auto awaited =
      std::find_if(requests_.begin(), requests_.end(), [&](const Request& request) {
        return request.is_awaited && request.node == node && request.seen.has_value() != is_append;
      });
  if (awaited != requests_.end()) {  // else it was executed, and the answer is lost
    awaited->is_awaited = false;
    if (is_lost) {
      requests_.erase(awaited);
    }
  } else if (is_lost) {
    return false;
  }
  Edit(node, [&](Node* to) {
    if (is_append) {
      to->awaits_append = false;
      to->append_answer.reset();
      if (left_.daemon == DaemonMutant::kResendsElsewhere) {
        to->unanswered = to->replica.committed() + 1;
      }
      to->replica.OnAppended(Appended::kUnknown, to->now_ms);
    } else {
      to->awaits_lead = false;
      to->lead_answer.reset();
      to->replica.OnLead(Error{"no answer"}, to->now_ms);
    }
  });
  return true;
}

// Requests that nobody awaits and the log can only refuse, now and later.
void ReplicaWorld::Forget() {
  std::erase_if(requests_, [&](const Request& request) {
    return !request.is_awaited &&
           !(request.seen ? log_.CanTakeLead(*request.seen) : log_.CanAppend(request.group));
  });
  const auto order = [](const Request& one) {
    return std::tuple(one.node, one.is_awaited, one.seen.value_or(0), one.seen.has_value(),
                      one.group.first, one.group.term, std::string_view(one.group.records));
  };
  std::sort(requests_.begin(), requests_.end(),
            [&](const Request& a, const Request& b) { return order(a) < order(b); });
  requests_.erase(std::unique(requests_.begin(), requests_.end()), requests_.end());
}

void ReplicaWorld::NextOfNode(size_t node, const Visit& visit) const {
  const Node& it = *nodes_[node];
  const auto step = [&](const std::string& name, const std::function<void(Node*)>& edit) {
    ReplicaWorld world = *this;
    world.Edit(node, edit);
    visit(NameOf(node) + name, std::move(world));
  };
  for (size_t moment = it.has_page ? it.shown + 1 : it.first_page; moment <= log_.now(); ++moment) {
    step(" sees the log at moment " + std::to_string(moment), [&](Node* to) {
      to->replica.OnPage(log_.PageOf(it.shown, moment, to->replica.follow_from()), to->now_ms);
      to->has_page = true;
      to->shown = moment;
    });
  }
  if (it.lead_answer) {
    step(" is told that " + it.lead_answer->node + " leads", [&](Node* to) {
      to->awaits_lead = false;
      to->lead_answer.reset();
      to->replica.OnLead(*it.lead_answer, to->now_ms);
    });
  }
  if (it.append_answer) {
    step(*it.append_answer == Appended::kCommitted ? " is told: committed" : " is told: fenced",
         [&](Node* to) {
           to->awaits_append = false;
           to->append_answer.reset();
           to->replica.OnAppended(*it.append_answer, to->now_ms);
         });
  }
  for (int change = 0; it.replica.admits() && change < left_.changes && change <= introduced_;
       ++change) {
    if (!Has(it.state, change)) {
      ReplicaWorld world = *this;
      world.introduced_ = std::max(introduced_, change + 1);
      world.Edit(node, [&](Node* to) {
        const std::string record = RecordOf(change, node, to->process);
        to->state += record;
        to->replica.Submit(to->state.size() / kRecordBytes, record);
      });
      visit(NameOf(node) + " makes change " + std::to_string(change), std::move(world));
    }
  }
}

void ReplicaWorld::NextOfTime(size_t node, const Visit& visit) const {
  const Node& it = *nodes_[node];
  const bool may_ask = left_.asks > 0 && it.replica.role() == Role::kFollows &&
                       (it.has_asked || node == 0 || nodes_[node - 1]->has_asked);
  if (may_ask || it.replica.role() == Role::kLeads) {
    ReplicaWorld world = *this;
    world.Edit(node, [&](Node* to) {
      for (int i = 0; i < kWaits; ++i) {
        to->now_ms += kWaitMs;
        world.Perform(node, to);
      }
    });
    visit(NameOf(node) + " waits", std::move(world));
  }
  for (const bool is_append : {false, true}) {
    if (left_.unknowns == 0 || !(is_append ? it.awaits_append : it.awaits_lead)) {
      continue;
    }
    const std::string what = NameOf(node) + (is_append ? "'s append" : "'s asking");
    ReplicaWorld late = *this;
    late.GiveUp(node, is_append, false);
    visit(what + " has no answer", std::move(late));
    ReplicaWorld lost = *this;
    if (lost.GiveUp(node, is_append, true)) {
      visit(what + " is lost", std::move(lost));
    }
  }
  if (left_.step_downs > 0 && it.replica.admits()) {
    ReplicaWorld world = *this;
    --world.left_.step_downs;
    world.Edit(node, [](Node* to) { to->replica.StepDown(""); });
    visit(NameOf(node) + " steps down", std::move(world));
  }
  for (size_t events = 0; left_.crashes > 0 && events <= it.journal.size() / kRecordBytes;
       ++events) {
    for (const bool is_stale : {false, true}) {
      if (is_stale && left_.stale_reads == 0) {
        continue;
      }
      ReplicaWorld world = *this;
      --world.left_.crashes;
      world.left_.stale_reads -= is_stale ? 1 : 0;
      world.Edit(node, [&](Node* to) { world.Restart(node, to, events, is_stale); });
      visit(NameOf(node) + " restarts with " + std::to_string(events) + " events" +
                (is_stale ? ", from the past" : ""),
            std::move(world));
    }
  }
}

void ReplicaWorld::NextOfRequests(const Visit& visit) const {
  for (size_t at = 0; at < requests_.size(); ++at) {
    const Request& request = requests_[at];
    const std::string name = NameOf(request.node) +
                             (request.seen ? "'s asking after term " + std::to_string(*request.seen)
                                           : "'s append of " + request.group.records + " at " +
                                                 std::to_string(request.group.first)) +
                             (request.is_awaited ? " arrives" : " arrives late");
    ReplicaWorld world = *this;
    world.Execute(at, false);
    if (left_.doubles > 0) {
      ReplicaWorld twice = *this;
      --twice.left_.doubles;
      twice.Execute(at, true);
      if (twice.requests_.size() > world.requests_.size()) {
        visit(name + ", and will again", std::move(twice));
      }
    }
    visit(name, std::move(world));
  }
}

void ReplicaWorld::Next(const Visit& visit) const {
  for (size_t node = 0; node < nodes_.size(); ++node) {
    NextOfNode(node, visit);
    NextOfTime(node, visit);
  }
  NextOfRequests(visit);
}

bool ReplicaWorld::Finished() const {
  std::string records;
  for (const Group& group : log_.groups()) {
    records += group.records;
  }
  return records.size() == kRecordBytes * static_cast<size_t>(left_.changes);
}

bool ReplicaWorld::MustFinish() const {
  return left_.asks > 0 || std::any_of(nodes_.begin(), nodes_.end(), [&](const auto& node) {
           const Role role = node->replica.role();
           return (role == Role::kCatchesUp || role == Role::kLeads) &&
                  node->replica.leader() == log_.leader();
         });
}

std::string ReplicaWorld::Key() const {
  ByteWriter writer;
  for (const int left : {left_.asks, left_.unknowns, left_.crashes, left_.stale_reads,
                         left_.step_downs, left_.doubles, introduced_}) {
    writer.U8(static_cast<uint8_t>(left));
  }
  for (const Term term : acknowledged_) {
    writer.U8(static_cast<uint8_t>(term));
  }
  log_.Encode(&writer);
  writer.Count(requests_.size());
  for (const Request& request : requests_) {
    writer.U8(static_cast<uint8_t>(request.node));
    writer.Flag(request.is_awaited);
    writer.Flag(request.seen.has_value());
    writer.U64(request.seen.value_or(0));
    writer.U64(request.group.first);
    writer.U64(request.group.term);
    writer.Text(request.group.records);
  }
  writer.Text(fault_);
  std::string key = Packed(writer.bytes());
  for (const auto& node : nodes_) {
    key += node->key;
  }
  return key;
}

std::string ReplicaWorld::Wrong() const {
  std::string wrong = fault_.empty() ? WrongInLog() : fault_;
  for (size_t node = 0; node < nodes_.size() && wrong.empty(); ++node) {
    wrong = WrongAt(node);
  }
  return wrong;
}

std::string ReplicaWorld::WrongInLog() const {
  Sequence next = 1;
  Term term = 0;
  std::string records;
  for (const Group& group : log_.groups()) {
    if (group.first != next) {
      return "the log has a gap or an overlap";
    }
    if (group.term < term) {
      return "a group of term " + std::to_string(group.term) + " is after one of term " +
             std::to_string(term);
    }
    for (size_t at = 0; at < group.records.size(); at += kRecordBytes) {
      if (group.records.substr(at + 1, 1) != log_.LeaderOf(group.term)) {
        return "a group of term " + std::to_string(group.term) + " is not its leader's";
      }
    }
    next += group.count;
    term = group.term;
    records += group.records;
  }
  const std::vector<int> changes = ChangesIn(records);
  for (int change = 0; change < left_.changes; ++change) {
    const auto times = std::count(changes.begin(), changes.end(), change);
    if (times > 1) {
      return "change " + std::to_string(change) + " is in the log " + std::to_string(times) +
             " times";
    }
    if (times == 0 && acknowledged_[static_cast<size_t>(change)] != 0) {
      return "change " + std::to_string(change) + " was acknowledged and is not in the log";
    }
  }
  return {};
}

std::string ReplicaWorld::WrongAt(size_t node) const {
  const Node& it = *nodes_[node];
  std::string log;
  for (const Group& group : log_.groups()) {
    log += group.records;
  }
  if (!log.starts_with(it.journal)) {
    return NameOf(node) + " was given what is not the log";
  }
  const bool leads = it.replica.role() == Role::kLeads;
  if (leads ? !it.state.starts_with(it.journal) : it.state != it.journal) {
    return NameOf(node) + " has uncommitted events in its state and does not lead";
  }
  for (size_t at = it.journal.size(); at < it.state.size(); at += kRecordBytes) {
    if (it.state.substr(at + 1, 2) != RecordOf(0, node, it.process).substr(1)) {
      return NameOf(node) + " has uncommitted events of another process in its state";
    }
  }
  for (int change = 0; change < left_.changes && !left_.only_the_log; ++change) {
    const Term term = acknowledged_[static_cast<size_t>(change)];
    if (leads && term != 0 && term <= it.replica.leader().term && !Has(it.state, change)) {
      return "change " + std::to_string(change) + " was acknowledged and is not in the state of " +
             NameOf(node) + ", which leads later";
    }
  }
  return {};
}

Explored ExploreReplicas(const ReplicaLimits& limits, size_t max_states) {
  return Explore<ReplicaWorld>(
      ReplicaWorld(limits),
      {.key = [](const ReplicaWorld& world) { return world.Key(); },
       .next = [](const ReplicaWorld& world,
                  const ReplicaWorld::Visit& visit) { world.Next(visit); },
       .wrong = [](const ReplicaWorld& world) { return world.Wrong(); },
       .finished = [](const ReplicaWorld& world) { return world.Finished(); },
       .must_finish = [](const ReplicaWorld& world) { return world.MustFinish(); },
       .max_states = max_states});
}

}  // namespace pheromone::verify
