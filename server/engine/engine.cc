#include "server/engine/engine.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "server/base/hash.h"
#include "server/engine/config_codec.h"
#include "server/engine/config_hash.h"

namespace pheromone::engine {

using protocol::Message;
using protocol::Reason;

Engine::Engine(ComponentList components) : components_(std::move(components)) {
  for (size_t i = 0; i < components_.size(); ++i) {
    for (const MessageRule& rule : components_[i]->messages()) {
      assert(!protocol::IsFromServer(rule.opcode));
      assert(!routes_[rule.opcode].rule && "an opcode of two components");
      assert(rule.effect == MessageRule::Effect::kReads || rule.length.least >= 1);
      assert(!rule.is_session() || i == kRobotsIndex);
      routes_[rule.opcode] = {i, rule};
    }
    for (const EventKind kind : components_[i]->event_kinds()) {
      assert(i <= kFieldIndex || kind >= EventKind::kFirstOfComponents);
      const bool is_new = owners_of_kinds_.emplace(kind, i).second;
      assert(is_new && "an event kind of two components");
      (void)is_new;
    }
  }
}

// Null if no component has that kind. Not for kinds that the engine itself handles.
const Component* Engine::Owner(const Event& event) const {
  const auto found = owners_of_kinds_.find(KindOf(event));
  return found != owners_of_kinds_.end() ? &*components_[found->second] : nullptr;
}
Component* Engine::Owner(const Event& event) {
  const auto found = owners_of_kinds_.find(KindOf(event));
  return found != owners_of_kinds_.end() ? &*components_[found->second] : nullptr;
}

// --- Requests

// What is wrong with the form of a client's message, if anything.
Reason Engine::FaultOf(const Message& message) const {
  if (protocol::IsFromServer(message.opcode) || !routes_[message.opcode].rule) {
    return Reason::kUnknownOpcode;
  }
  const std::optional<MessageRule>& rule = routes_[message.opcode].rule;
  const bool fits = message.length >= rule->length.least && message.length <= rule->length.most;
  return fits ? Reason::kNone : Reason::kBadLength;
}

Handling Engine::Classify(LinkIndex link, const Message& message) const {
  const bool invalid_id = message.id == 0 || message.id == protocol::kBroadcastId;
  if (invalid_id || message.opcode == 0 || protocol::IsFromServer(message.opcode) ||
      link >= config_->links.size()) {
    return Handling::kIgnore;
  }
  const std::optional<MessageRule>& rule = routes_[message.opcode].rule;
  const bool has_fault = FaultOf(message) != Reason::kNone;
  if (rule && (rule->effect == MessageRule::Effect::kAck ||
               (rule->effect == MessageRule::Effect::kHello && !has_fault))) {
    return RobotsIn(components_).Classify(link, message);
  }
  if (has_fault || rule->effect != MessageRule::Effect::kChanges || !SaidHello(link, message.id)) {
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
  const Route& route = routes_[message.opcode];
  if (route.rule->effect == MessageRule::Effect::kReads) {
    Context context = Now();
    context.now_ms = std::max(stamp.field_time_ms, field_time_ms_);
    context.utc_ms = stamp.utc_ms;
    out->push_back({link, 0, components_[route.component]->Answer(context, link, message)});
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
  const Route& route = routes_[request.message.opcode];
  const Context context = Now();
  if (route.rule->is_session()) {
    RobotsIn(components_).TakeSession(context, request, out);
    return;
  }
  const Message answer =
      components_[route.component]->Change(context, request.link, request.message);
  RobotsIn(components_).Remember(context, request.link, request.message, answer);
  out.Send(context, request.link, answer);
}

// --- Events

// Of the event that is being applied.
class Engine::AppliedAtOnce final : public Consequences {
 public:
  AppliedAtOnce(Engine* engine, Output* out) : engine_(engine), out_(out) {
    out->consequences = this;
  }
  Status Raise(const ComponentEvent& raised) override {
    const Event event = raised;
    Component* const owner = engine_->Owner(event);
    assert(owner != nullptr);
    const Status possible = owner->Check(engine_->Now(), event);
    if (possible.ok()) {
      owner->Apply(engine_->Now(), event, *out_);
    }
    return possible;
  }

 private:
  Engine* engine_;
  Output* out_;
};

void Engine::Apply(uint64_t sequence, const Stamp& stamp, const Event& event,
                   std::vector<Outgoing>* messages) {
  sequence_ = sequence;
  last_stamp_ = stamp;
  field_time_ms_ = std::max(stamp.field_time_ms, field_time_ms_);
  finished_.clear();
  Output out{messages, &finished_};
  AppliedAtOnce consequences(this, &out);
  if (const auto* const request = std::get_if<RequestReceived>(&event)) {
    On(*request, out);
  } else if (const auto* const change = std::get_if<ConfigChanged>(&event)) {
    On(*change, out);
  } else if (std::holds_alternative<engine::Advance>(event)) {
    for (Polymorphic<Component>& component : components_) {
      component->Advance(Now(), out);
    }
  } else {
    Component* const owner = Owner(event);
    assert(owner != nullptr && "an event that Check refuses");
    owner->Apply(Now(), event, out);
  }
  for (Polymorphic<Component>& component : components_) {
    component->Notice(Now());
  }
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
  if (const auto* change = std::get_if<ConfigChanged>(&event)) {
    return CheckConfig(*change->config, change->plan.get());
  }
  if (!configured()) {
    return Error{"an event before the first configuration"};
  }
  if (const auto* request = std::get_if<RequestReceived>(&event)) {
    return Classify(request->link, request->message) == Handling::kChange
               ? Ok()
               : Error{"the request does not change the state"};
  }
  if (std::holds_alternative<Advance>(event)) {
    return Ok();
  }
  const Component* const owner = Owner(event);
  return owner != nullptr
             ? owner->Check(Now(), event)
             : Error{"unknown event kind " + std::to_string(static_cast<int>(KindOf(event)))};
}

Status Engine::Prepare(const SharedConfig& present, Event* event) {
  return FieldComponent::Prepare(present, event);
}

Status Engine::Prepare(const SharedConfig& present, const tags::Survey& survey, Event* event) {
  const Status status = FieldComponent::Prepare(present, event);
  auto* const change = std::get_if<ConfigChanged>(event);
  return status.ok() && change != nullptr ? TagsComponent::Prepare(present, survey, change)
                                          : status;
}

tags::Survey Engine::Look() const {
  const auto* const tags = FindIn<TagsComponent>(components_);
  return tags != nullptr ? tags->store().Look() : tags::Store().Look();
}

// --- Configuration

ConfigFigures FiguresOf(const EngineConfig& config) {
  return {HashConfig(config), EncodedBytes(config)};
}

Status Engine::CheckConfig(const EngineConfig& next, const ConfigPlan* plan) const {
  for (const ComponentConfig& it : next.components) {
    const bool is_known =
        std::any_of(components_.begin(), components_.end(),
                    [&](const auto& component) { return component->name() == it.component; });
    if (!is_known) {
      return Error{"unknown component \"" + it.component + "\" in the configuration"};
    }
  }
  for (const Polymorphic<Component>& component : components_) {
    Status status = component->CheckConfig(Now(), next, plan);
    if (!status.ok()) {
      return status;
    }
  }
  return Ok();
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
  for (Polymorphic<Component>& component : components_) {
    component->Configure(context, {is_new ? nullptr : &*before, plan.get(), in_portions}, out);
  }
  if (in_portions) {
    ++field_time_ms_;  // distinguishes what was stored before from what comes later
  }
  TakeConfig(change.config, plan != nullptr ? plan->figures : FiguresOf(*change.config));
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
  for (const Polymorphic<Component>& component : components_) {
    const std::optional<uint64_t> its = component->NextDeadline();
    next = next && its ? std::min(*next, *its) : next ? next : its;
  }
  return next;
}

uint64_t Engine::StateHash() const {
  uint64_t hash = Hash64({'E', epoch_});
  for (const Polymorphic<Component>& component : components_) {
    hash += component->Hash();
  }
  return configured() ? hash + config_figures_.hash : hash;
}

}  // namespace pheromone::engine
