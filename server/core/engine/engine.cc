#include "server/core/engine/engine.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "server/base/hash.h"
#include "server/core/engine/config_codec.h"
#include "server/core/engine/config_hash.h"

namespace pheromone::engine {

using protocol::Message;
using protocol::Reason;

namespace {

template <typename... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <typename... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

}  // namespace

// --- Requests

// What is wrong with the form of a client's message, if anything.
Reason Engine::FaultOf(const Message& message) {
  const Route& route = RouteOf(message.opcode);
  if (route.part == Route::Part::kNone) {
    return Reason::kUnknownOpcode;
  }
  const bool fits = message.length >= route.length.least && message.length <= route.length.most;
  return fits ? Reason::kNone : Reason::kBadLength;
}

Handling Engine::Classify(LinkIndex link, const Message& message) const {
  const bool invalid_id = message.id == 0 || message.id == protocol::kBroadcastId;
  if (invalid_id || message.opcode == 0 || protocol::IsFromServer(message.opcode) ||
      link >= config_->links.size()) {
    return Handling::kIgnore;
  }
  const Route::Effect effect = RouteOf(message.opcode).effect;
  const bool has_fault = FaultOf(message) != Reason::kNone;
  if (effect == Route::Effect::kAck || (effect == Route::Effect::kHello && !has_fault)) {
    return robots_.Classify(link, message);
  }
  if (has_fault || effect != Route::Effect::kChanges || !SaidHello(link, message.id)) {
    return Handling::kAnswer;
  }
  const RobotState* robot = robots().Find(link, message.id);
  switch (CompareSeq(*robot, message.data[0], protocol::MessageCrc(message))) {
    case SeqVerdict::kNew:
      return Handling::kChange;
    case SeqVerdict::kStale:
      return Handling::kIgnore;
    case SeqVerdict::kRepeat:
    case SeqVerdict::kReused:
      break;
  }
  return Handling::kAnswer;
}

void Engine::Answer(const Stamp& stamp, LinkIndex link, const Message& message,
                    std::vector<Outgoing>* out) const {
  const Reason fault = FaultOf(message);
  if (fault != Reason::kNone) {
    out->push_back({link, 0, ErrorMessage(message, fault)});
    return;
  }
  const Route& route = RouteOf(message.opcode);
  if (route.effect == Route::Effect::kReads) {
    Context context = Now();
    context.now_ms = std::max(stamp.field_time_ms, field_time_ms_);
    context.utc_ms = stamp.utc_ms;
    const auto answer = [&](const auto& part) {
      out->push_back({link, 0, part.Answer(context, link, message)});
    };
    route.part == Route::Part::kField  ? answer(field_)
    : route.part == Route::Part::kTags ? answer(tags_)
                                       : answer(robots_);
    return;
  }
  if (!SaidHello(link, message.id)) {
    out->push_back({link, 0, ErrorMessage(message, Reason::kSayHello)});
    return;
  }
  const RobotState* robot = robots().Find(link, message.id);
  const bool repeats =
      CompareSeq(*robot, message.data[0], protocol::MessageCrc(message)) == SeqVerdict::kRepeat;
  if (repeats) {
    out->push_back({link, robot->last_change, robot->last_answer});
  } else {
    out->push_back({link, 0, ErrorMessage(message, Reason::kSequenceReused)});
  }
}

void Engine::On(const RequestReceived& request, const Output& out) {
  assert(FaultOf(request.message) == Reason::kNone);
  const Route& route = RouteOf(request.message.opcode);
  const Context context = Now();
  if (route.effect != Route::Effect::kChanges) {
    robots_.TakeSession(context, request, out);
    return;
  }
  const auto change = [&](auto& part) {
    return part.Change(context, request.link, request.message);
  };
  const Message answer = route.part == Route::Part::kField  ? change(field_)
                         : route.part == Route::Part::kTags ? change(tags_)
                                                            : change(robots_);
  robots_.Remember(context, request.link, request.message, answer);
  out.Send(context, request.link, answer);
}

// --- Events

void Engine::Apply(uint64_t sequence, const Stamp& stamp, const Event& event,
                   std::vector<Outgoing>* messages) {
  sequence_ = sequence;
  last_stamp_ = stamp;
  field_time_ms_ = std::max(stamp.field_time_ms, field_time_ms_);
  finished_.clear();
  TagEditor editor = tags_.EditAt(field_time_ms_, stamp.utc_ms);
  const Output out{messages, &finished_, &editor};
  std::visit(Overloaded{
                 [&](const RequestReceived& it) { On(it, out); },
                 [&](const ConfigChanged& it) { On(it, out); },
                 [&](const engine::Advance&) {
                   ForEachPart(*this, [&](auto& part) { part.Advance(Now(), out); });
                 },
                 [&](const FieldEdited& it) { field_.Apply(Now(), it, out); },
                 [&](const EditReversed& it) { field_.Apply(Now(), it, out); },
                 [&](const NetsChanged& it) { nets_.Apply(Now(), it, out); },
                 [&](const TagsChanged& it) { tags_.Apply(Now(), it, out); },
                 [&](const auto& it) { robots_.Apply(Now(), it, out); },
             },
             event);
  nets_.Notice(Now());
  cost_ = kCostOfEvent + field_.TakeCost();
}

std::optional<GoalEnded> Engine::Arrival(const Stamp& stamp, LinkIndex link,
                                         const Message& message) const {
  const RobotState* robot = robots().Find(link, message.id);
  protocol::SenseRequest sense;
  protocol::TraceRequest trace;
  if (robot == nullptr || !robot->goal ||
      !(protocol::Decode(message, &sense) || protocol::Decode(message, &trace))) {
    return std::nullopt;
  }
  const protocol::WirePose& pose = protocol::Decode(message, &sense) ? sense.pose : trace.pose;
  const field::PointUm position =
      robots()
          .PoseOf(link, message.id, pose, std::max(stamp.field_time_ms, field_time_ms_))
          .position;
  return IsAt(*robot->goal, position) ? std::optional(GoalEnded{link, message.id, true, position})
                                      : std::nullopt;
}

Status Engine::Check(const Event& event) const {
  if (!configured() && !std::holds_alternative<ConfigChanged>(event)) {
    return Error{"an event before the first configuration"};
  }
  return std::visit(
      Overloaded{
          [&](const RequestReceived& it) {
            return Classify(it.link, it.message) == Handling::kChange
                       ? Ok()
                       : Error{"the request does not change the state"};
          },
          [&](const ConfigChanged& it) { return CheckConfig(*it.config, it.plan.get()); },
          [&](const engine::Advance&) { return Ok(); },
          [&](const FieldEdited& it) { return field_.Check(Now(), it); },
          [&](const EditReversed& it) { return field_.Check(Now(), it); },
          [&](const NetsChanged& it) { return nets_.Check(Now(), it); },
          [&](const TagsChanged& it) { return tags_.Check(Now(), it); },
          [&](const auto& it) { return robots_.Check(Now(), it); },
      },
      event);
}

Status Engine::Prepare(const SharedConfig& present, Event* event) {
  return FieldPart::Prepare(present, event);
}

Status Engine::Prepare(const SharedConfig& present, const tags::Survey& survey, Event* event) {
  const Status status = FieldPart::Prepare(present, event);
  auto* const change = std::get_if<ConfigChanged>(event);
  return status.ok() && change != nullptr ? TagsPart::Prepare(present, survey, change) : status;
}

// --- Configuration

ConfigFigures FiguresOf(const EngineConfig& config) {
  return {HashConfig(config), EncodedBytes(config)};
}

Status Engine::CheckConfig(const EngineConfig& next, const ConfigPlan* plan) const {
  Status found = Ok();
  ForEachPart(*this, [&](const auto& part) {
    found = found.ok() ? part.CheckConfig(Now(), next, plan) : found;
  });
  return found;
}

void Engine::On(const ConfigChanged& change, const Output& out) {
  const bool is_new = !configured();
  if (is_new || change.state_lost || !SameHello(*config_, *change.config)) {
    epoch_ = change.new_epoch;
  }
  Event planned = change;
  if (!is_new && change.plan == nullptr) {
    (void)Prepare(config_, &planned);
  }
  const std::shared_ptr<const ConfigPlan> plan = std::get<ConfigChanged>(planned).plan;
  // At the maximum time, no later stamp can distinguish new nodes from old ones.
  const bool in_portions = !is_new && field_time_ms_ < kMaxFieldTimeMs;
  const SharedConfig before = config_;
  const Context context = Now(change.config);
  const Reconfiguration reconfiguration{is_new ? nullptr : &*before, plan.get(), in_portions};
  ForEachPart(*this, [&](auto& part) { part.Configure(context, reconfiguration, out); });
  if (in_portions) {
    ++field_time_ms_;  // distinguishes what was stored before from what comes later
  }
  TakeConfig(change.config, plan != nullptr ? plan->figures : FiguresOf(*change.config));
}

Status Engine::ContinueTagsAndNets(const Engine& from) {
  PHEROMONE_TRY_STATUS(from.nets_.CheckConfig(from.Now(), *config_, nullptr));
  PHEROMONE_TRY_STATUS(from.tags_.CheckConfig(from.Now(), *config_, nullptr));
  nets_ = from.nets_;
  tags_ = from.tags_;
  TagEditor editor = tags_.EditAt(field_time_ms_, last_stamp_.utc_ms);
  std::vector<Outgoing> none;
  const Output out{&none, &finished_, &editor};
  const Reconfiguration change{&from.config(), nullptr, false};
  nets_.Configure(Now(), change, out);
  tags_.Configure(Now(), change, out);
  nets_.Notice(Now());
  return Ok();
}

// The configuration, and what is computed from it.
void Engine::TakeConfig(SharedConfig config, const ConfigFigures& figures) {
  config_ = std::move(config);
  config_figures_ = figures;
  is_configured_ = true;
}

// --- Time and hash

std::optional<uint64_t> Engine::NextDeadline() const {
  std::optional<uint64_t> next;
  ForEachPart(*this, [&](const auto& part) {
    const std::optional<uint64_t> its = part.NextDeadline();
    next = next && its ? std::min(*next, *its) : next ? next : its;
  });
  return next;
}

uint64_t Engine::StateHash() const {
  uint64_t hash = Hash64({'E', epoch_});
  ForEachPart(*this, [&](const auto& part) { hash += part.Hash(); });
  return configured() ? hash + config_figures_.hash : hash;
}

}  // namespace pheromone::engine
