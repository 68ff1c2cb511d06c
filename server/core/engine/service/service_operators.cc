// What operators change: the configuration, the map, goals, commands, tags and nets.

#include <string>
#include <utility>

#include "server/core/engine/service/service.h"
#include "server/core/engine/unknown_robot.h"
#include "server/core/field/extent.h"
#include "server/core/field/route.h"

namespace pheromone::engine {
namespace {

// How many times an operator's change retries a busy log: for some seconds.
constexpr int kBusyPortions = 20'000;

}  // namespace

using protocol::Reason;

Result<Service::Configured> Service::Configure(SharedConfig config, uint16_t new_epoch,
                                               bool state_lost) {
  constexpr int kLooks = 5;
  Status acceptable = Ok();
  for (int look = 0; look < kLooks; ++look) {
    std::optional<SharedConfig> present;
    std::array<uint64_t, field::kTypes> changes{};
    const field::Field* field = nullptr;
    tags::Survey survey;
    uint64_t now_ms = 0;
    {
      const std::lock_guard lock(mutex_);
      if (engine_.configured()) {
        survey = engine_.Look();
        present = engine_.shared_config();
        field = &engine_.field();
        now_ms = StampNow().field_time_ms;
        for (uint8_t type = 1; type < field::kTypes; ++type) {
          changes[type] = field->changes(type);
        }
      }
    }
    if (present && *present == config && !state_lost) {
      return Configured{};
    }
    Event event = ConfigChanged{config, new_epoch, state_lost};
    if (present) {
      acceptable = Prepare(*present, *config, *field, survey, now_ms, &event);
      if (!acceptable.ok()) {
        return acceptable.error();
      }
      acceptable = log_->WriteAhead(&event);
      if (!acceptable.ok()) {
        return acceptable.error();
      }
    }
    uint64_t id = 0;
    {
      const std::lock_guard lock(mutex_);
      const auto goes = [&](uint8_t type) {
        return present && present->operator->()->field.FindLaw(type) != nullptr &&
               config->field.FindLaw(type) == nullptr;
      };
      bool is_current = true;
      for (uint8_t type = 1; field != nullptr && type < field::kTypes; ++type) {
        is_current = is_current && (!goes(type) || field->changes(type) == changes[type]);
      }
      if (!is_current) {
        acceptable = Error{"a removed pheromone is still being deposited by robots"};
        continue;
      }
      const auto& change = std::get<ConfigChanged>(event);
      acceptable = engine_.CheckConfig(*config, change.plan.get());
      if (acceptable.ok()) {
        std::vector<Outgoing> none;
        PHEROMONE_TRY(id, ChangeNow(event, &none));
      } else if (!engine_.is_busy()) {
        return acceptable.error();
      }
    }
    std::get<ConfigChanged>(event).ahead.reset();
    const Result<Finished> finished = Finish(id);
    if (id != 0) {
      return Configured{finished.ok()};  // it is logged in any case
    }
    if (!finished.ok()) {
      return finished.error();
    }
  }
  return acceptable.error();
}

// Without the lock: its time depends on the size of configuration and map.
Status Service::Prepare(const SharedConfig& present, const EngineConfig& next,
                        const field::Field& field, const tags::Survey& survey, uint64_t now_ms,
                        Event* event) {
  Status status = Engine::Prepare(present, survey, event);
  const field::FieldReader reader(field);
  if (status.ok() && !reader.ok()) {
    return Error{"too many readers of the field; try again in a moment"};
  }
  return status.ok() ? field::Field::CheckLeaving(reader, present->field, next.field, now_ms)
                     : status;
}

// An operator's change: its sequence number in the log.
Result<uint64_t> Service::ChangeNow(const Event& event, std::vector<Outgoing>* out) {
  if (Change(StampNow(), event, out) != Reason::kNone) {
    const std::string trouble = log_->Trouble();
    return Error{"the log does not accept changes at present" +
                 (trouble.empty() ? "" : ": " + trouble)};
  }
  return engine_.sequence();
}

Result<uint64_t> Service::CheckAndChange(const Event& event, std::vector<Outgoing>* out) {
  PHEROMONE_TRY_STATUS(engine_.Check(event));
  return ChangeNow(event, out);
}

Status Service::Issue(const CommandIssued& command, std::vector<Outgoing>* out) {
  const std::lock_guard lock(mutex_);
  PHEROMONE_TRY_STATUS(engine_.Check(command));
  if (command.id == protocol::kBroadcastId) {  // it is sent in any case (LiveControl::HaltAll)
    traffic_.NoteHaltOfAll(command.link, StampNow().field_time_ms);
  }
  if (held_.commands() >= kMaxHeldCommands) {
    return Error{std::to_string(held_.commands()) + " commands are waiting for the log"};
  }
  const size_t before = out->size();
  PHEROMONE_TRY_STATUS(ChangeNow(command, out));
  HoldBack(out, before);
  return Ok();
}

Status Service::SetGoal(LinkIndex link, uint8_t id, field::PointUm point, uint32_t tolerance_um) {
  const std::string name = "robot " + std::to_string(id);
  std::optional<SharedConfig> config;
  field::PointUm from;
  {
    const std::lock_guard lock(mutex_);
    if (!engine_.SaidHello(link, id)) {
      return UnknownRobot(engine_.robots(), engine_.config().links, link, id);
    }
    const RobotTraffic* heard = traffic_.Find(link, id);
    const protocol::WirePose* pose = heard != nullptr && heard->pose ? &*heard->pose : nullptr;
    const uint64_t now_ms = StampNow().field_time_ms;
    const auto& observed = engine_.robots().Find(link, id)->observed;
    if (pose == nullptr && !(observed && now_ms < observed->until_ms)) {
      return Error{name + " has not reported its position yet"};
    }
    from = engine_.robots()
               .PoseOf(link, id, pose != nullptr ? *pose : protocol::WirePose{}, now_ms)
               .position;
    config = engine_.shared_config();
  }
  const field::FieldConfig& field = (*config)->field;
  PHEROMONE_TRY(std::vector<field::PointUm> route,
                field::FindRoute(field.map, field.obstacles, from, point));
  const GoalSet set{link, id, {std::move(route), tolerance_um}};
  const std::lock_guard lock(mutex_);
  std::vector<Outgoing> none;
  PHEROMONE_TRY_STATUS(CheckAndChange(set, &none));
  return Ok();
}

Status Service::CancelGoal(LinkIndex link, uint8_t id) {
  const std::lock_guard lock(mutex_);
  std::vector<Outgoing> none;
  PHEROMONE_TRY_STATUS(CheckAndChange(GoalEnded{link, id, false, {}}, &none));
  return Ok();
}

Result<uint64_t> Service::Submit(const Event& event, std::vector<Outgoing>* out) {
  const std::lock_guard lock(mutex_);
  const size_t before = out->size();
  PHEROMONE_TRY(const uint64_t sequence, CheckAndChange(event, out));
  HoldBack(out, before);
  return sequence;
}

Result<Service::Applied> Service::Edit(const field::FieldEdit& edit) {
  std::optional<SharedConfig> present;
  {
    const std::lock_guard lock(mutex_);
    PHEROMONE_TRY_STATUS(engine_.CheckEdit(edit));
    present = engine_.shared_config();
  }
  Event event = FieldEdited{edit};
  PHEROMONE_TRY_STATUS(Engine::Prepare(*present, &event));
  const bool takes_all = edit.shape == field::FieldEdit::Shape::kAll;
  const field::MapGeometry& map = (*present)->field.map;
  const int64_t nodes = takes_all ? int64_t{map.columns()} * map.rows()
                                  : std::get<FieldEdited>(event).raster->node_count;
  if (nodes == 0) {
    return Error{"the shape contains no node of " + field::DescribeExtent(map)};
  }
  uint64_t id = 0;
  std::vector<Outgoing> none;
  {
    const std::lock_guard lock(mutex_);
    PHEROMONE_TRY(id, CheckAndChange(event, &none));  // the configuration may have changed
  }
  PHEROMONE_TRY(const Finished finished, Finish(id));
  return Applied{finished.sequence, nodes, finished.work.changed, finished.work.edit};
}

Result<Service::Reversed> Service::Reverse(bool redo) {
  Reversed reversed;
  uint64_t id = 0;
  {
    const std::lock_guard lock(mutex_);
    if (const auto* next = engine_.field().history().Next(redo); next != nullptr) {
      reversed.edit = next->info;
      const field::PheromoneLaw* law = engine_.field().FindLaw(reversed.edit.type);
      reversed.pheromone = law != nullptr ? law->name : "";
    }
    std::vector<Outgoing> none;
    PHEROMONE_TRY(id, CheckAndChange(EditReversed{redo}, &none));
  }
  PHEROMONE_TRY(const Finished finished, Finish(id));
  reversed.changed = finished.work.changed;
  return reversed;
}

// Continues the work in progress until the change that event `id` began is complete; 0: all of it.
// Returns what became of that change, and the number of the last event. Errors: the change was not
// possible, or the log stopped accepting events.
Result<Service::Finished> Service::Finish(uint64_t id) {
  // A large configuration alone fills the log's queue for a moment.
  int patience = between_portions_ ? kBusyPortions : 0;
  if (between_portions_) {
    between_portions_({});  // after the first portion: many small edits are as much as a large one
  }
  for (;;) {
    std::vector<Outgoing> out;
    {
      const std::lock_guard lock(mutex_);
      const auto awaited = awaited_works_.find(id);
      if (awaited != awaited_works_.end() && awaited->second) {
        const Finished finished{engine_.sequence(), *awaited->second};
        awaited_works_.erase(awaited);
        return finished.work.outcome.ok() ? Result<Finished>(finished)
                                          : finished.work.outcome.error();
      }
      if (id == 0 && !engine_.is_busy()) {
        return Finished{engine_.sequence(), {}};
      }
      const Reason refused = Change(StampNow(), Advance{}, &out);
      if (refused != Reason::kNone && (refused != Reason::kBusy || --patience < 0)) {
        awaited_works_.erase(id);
        return Error{
            "the log stopped accepting changes during the edit; the rest follows when it accepts "
            "them again"};
      }
      HoldBack(&out, 0);
    }
    if (between_portions_) {
      between_portions_(out);
    }
  }
}

}  // namespace pheromone::engine
