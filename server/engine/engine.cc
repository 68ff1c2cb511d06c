#include "server/engine/engine.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "server/base/hash.h"
#include "server/engine/config_codec.h"
#include "server/engine/config_hash.h"
#include "server/engine/frozen_state.h"

namespace pheromone::engine {

void Engine::Apply(uint64_t sequence, const Stamp& stamp, const Event& event,
                   std::vector<Outgoing>* out) {
  sequence_ = sequence;
  last_stamp_ = stamp;
  field_time_ms_ = std::max(stamp.field_time_ms, field_time_ms_);
  finished_.clear();
  std::visit([&](const auto& it) { On(it, out); }, event);
  if (configured()) {
    field_->TakeFinished(&finished_);
  }
}

void Engine::Send(LinkIndex link, const protocol::Message& message,
                  std::vector<Outgoing>* out) const {
  out->push_back({link, sequence_, message});
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
               : Error{"a request that changes nothing"};
  }
  if (const auto* command = std::get_if<CommandIssued>(&event)) {
    return CheckCommand(*command);
  }
  if (const auto* edited = std::get_if<FieldEdited>(&event)) {
    const Status possible = CheckEdit(edited->edit);
    Event copy = *edited;
    return possible.ok() && edited->raster == nullptr ? Prepare(&copy) : possible;
  }
  if (const auto* seen = std::get_if<PoseObserved>(&event)) {
    return SaidHello(seen->link, seen->id)
               ? Ok()
               : Error{"a pose of robot " + std::to_string(seen->id) + ", which is not there"};
  }
  return Ok();
}

ConfigFigures FiguresOf(const EngineConfig& config) {
  return {HashConfig(config), EncodedBytes(config)};
}

Status Engine::Prepare(const SharedConfig& present, Event* event) {
  if (auto* edited = std::get_if<FieldEdited>(event)) {
    const Status shape = field::CheckShape(edited->edit);
    if (!shape.ok()) {
      return shape;
    }
    Result<field::Raster> raster = field::RasterFor(edited->edit, present->field.map);
    if (!raster.ok()) {
      return Error{raster.error()};
    }
    edited->raster = std::make_shared<const field::Raster>(std::move(raster).value());
  } else if (auto* change = std::get_if<ConfigChanged>(event)) {
    ConfigPlan plan;
    plan.figures = FiguresOf(*change->config);
    plan.laying = std::make_shared<const field::LayPlan>(
        field::PlanLaying(present->field, change->config->field));
    change->plan = std::make_shared<const ConfigPlan>(std::move(plan));
  }
  return Ok();
}

Status Engine::CheckConfig(const EngineConfig& next, const ConfigPlan* plan) const {
  Status frames = CheckFrames(next.frames);
  if (!frames.ok() || !configured()) {
    return frames;
  }
  return plan != nullptr ? field_->CheckReconfigure(next.field, *plan->laying)
                         : field_->CheckReconfigure(next.field, field_time_ms_);
}

void Engine::On(const ConfigChanged& change, std::vector<Outgoing>* /*out*/) {
  const EngineConfig& next = *change.config;
  const bool is_new = !configured();
  if (is_new || change.state_lost || !SameHello(*config_, next)) {
    epoch_ = change.new_epoch;
  }
  if (!is_new && config_->links != next.links) {
    broadcasts_.clear();  // their links may have other places now
  }
  if (is_new) {
    field_ =
        std::make_unique<field::Field>(change.config.field(), field::BestKernel(), field_time_ms_);
    finished_.push_back({sequence_, Ok()});
    TakeConfig(change.config, change.plan ? change.plan->figures : FiguresOf(next));
    return;
  }
  Event planned = change;
  if (change.plan == nullptr) {
    (void)Prepare(&planned);
  }
  const ConfigPlan& plan = *std::get<ConfigChanged>(planned).plan;
  // At the end of time there is no later moment to tell old nodes from new ones by.
  if (change.in_portions && field_time_ms_ < kMaxFieldTimeMs) {
    field_->BeginReconfigure(sequence_, change.config.field(), plan.laying, field_time_ms_);
    ++field_time_ms_;  // what was stored before can be told from what comes later
  } else {
    field_->Reconfigure(next.field, field_time_ms_);
    finished_.push_back({sequence_, Ok()});
  }
  TakeConfig(change.config, plan.figures);
}

// The configuration, and what is worked out from it.
void Engine::TakeConfig(SharedConfig config, const ConfigFigures& figures) {
  config_ = std::move(config);
  config_figures_ = figures;
  robots_.SetLinks(config_->links);
  frames_.clear();
  for (size_t link = 0; link < config_->links.size(); ++link) {
    for (const RobotFrame& frame : config_->frames) {
      if (frame.link == config_->links[link].name) {
        frames_.emplace(std::pair(static_cast<LinkIndex>(link), frame.id), frame);
      }
    }
  }
}

void Engine::On(const PoseObserved& observed, std::vector<Outgoing>* /*out*/) {
  assert(SaidHello(observed.link, observed.id));
  robots_.Update(observed.link, observed.id, [&](RobotState& robot) {
    robot.observed = ObservedPose{observed.pose, field_time_ms_ + observed.valid_ms};
  });
}

// A long gap is one bounded step: a command that has missed several retries is sent once, and the
// field does a portion of what is due. If more is, the next deadline is in the past.
void Engine::On(const Advance& /*advance*/, std::vector<Outgoing>* out) {
  // Before the commands: a resume waits for the last of them.
  for (Broadcast& broadcast : broadcasts_) {
    if (broadcast.next_ms <= field_time_ms_) {
      SendBroadcast(&broadcast, out);
    }
  }
  std::erase_if(broadcasts_, [](const Broadcast& broadcast) { return broadcast.left == 0; });
  std::vector<std::pair<LinkIndex, uint8_t>> due;
  robots_.ForEach([&](LinkIndex link, uint8_t id, const RobotState& robot) {
    if (robot.has_pending_command() && robot.command.next_retry_ms <= field_time_ms_) {
      due.emplace_back(link, id);
    }
  });
  for (const auto& [link, id] : due) {
    robots_.Update(link, id, [&, link = link, id = id](RobotState& robot) {
      SendCommand(link, id, &robot, out);
    });
  }
  field_->Advance(field_time_ms_);
}

std::optional<uint64_t> Engine::NextDeadline() const {
  if (!configured()) {
    return std::nullopt;
  }
  std::optional<uint64_t> next = field_->NextDeadline();
  const auto consider = [&next](uint64_t at) { next = next ? std::min(*next, at) : at; };
  if (robots_.pending_commands() != 0) {
    robots_.ForEach([&](LinkIndex, uint8_t, const RobotState& robot) {
      if (robot.has_pending_command()) {
        consider(robot.command.next_retry_ms);
      }
    });
  }
  for (const Broadcast& broadcast : broadcasts_) {
    consider(broadcast.next_ms);
  }
  return next;
}

uint64_t Engine::StateHash() const {
  uint64_t hash = Hash64({'E', epoch_, next_broadcast_seq_}) + robots_.hash();
  for (const Broadcast& broadcast : broadcasts_) {
    hash += Hash64({'B', broadcast.link, broadcast.seq, broadcast.left, broadcast.next_ms});
  }
  if (configured()) {
    hash += config_figures_.hash + field_->hash();
  }
  return hash;
}

}  // namespace pheromone::engine
