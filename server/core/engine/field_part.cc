#include "server/core/engine/field_part.h"

#include <algorithm>
#include <cassert>
#include <string>
#include <utility>

#include "server/core/engine/event_codec.h"
#include "server/core/engine/refusal.h"
#include "server/core/engine/wire_units.h"
#include "server/core/field/extent.h"
#include "server/core/field/frozen_field.h"

namespace pheromone::engine {
namespace {

using protocol::Message;
using protocol::Reason;

Reason ToReason(field::SenseError error) {
  return error == field::SenseError::kOffTheMap ? Reason::kOffTheMap : Reason::kUnknownPheromone;
}

Reason ToReason(field::DepositResult result) {
  switch (result) {
    case field::DepositResult::kOffTheMap:
      return Reason::kOffTheMap;
    case field::DepositResult::kUnknownPheromone:
      return Reason::kUnknownPheromone;
    case field::DepositResult::kMapFull:
      return Reason::kMapFull;
    case field::DepositResult::kBlocked:
      return Reason::kBlockedByObstacle;
    case field::DepositResult::kNotPermitted:
      return Reason::kNotPermitted;
    case field::DepositResult::kDone:
      break;
  }
  return Reason::kNone;
}

class FrozenFieldPart final : public FrozenPart {
 public:
  explicit FrozenFieldPart(std::unique_ptr<field::FrozenField> field) : field_(std::move(field)) {}
  uint64_t bytes() const override { return field_->bytes(); }
  bool CopySome(std::string* to, int tiles) override { return field_->CopySome(to, tiles); }
  bool failed() const override { return field_->failed(); }
  void LetGo() override { field_->LetGo(); }

 private:
  std::unique_ptr<field::FrozenField> field_;
};

}  // namespace

// --- Configuration

Status FieldPart::Prepare(const SharedConfig& present, Event* event) {
  if (auto* edited = std::get_if<FieldEdited>(event)) {
    PHEROMONE_TRY_STATUS(field::CheckShape(edited->edit));
    Result<field::Raster> raster = field::RasterFor(edited->edit, present->field.map);
    if (!raster.ok()) {
      return raster.error();
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

Status FieldPart::CheckConfig(const Context& context, const EngineConfig& next,
                              const ConfigPlan* plan) const {
  if (field_ == nullptr) {
    return Ok();
  }
  return plan != nullptr ? field_->CheckReconfigure(next.field, *plan->laying)
                         : field_->CheckReconfigure(next.field, context.now_ms);
}

void FieldPart::Configure(const Context& context, const Reconfiguration& change,
                          const Output& out) {
  if (field_ != nullptr && change.in_portions) {
    field_->BeginReconfigure(context.sequence, context.config.field(), change.plan->laying,
                             context.now_ms, context.utc_ms);
    field_->TakeFinished(out.finished);
    return;
  }
  if (field_ == nullptr) {
    field_ =
        std::make_unique<field::Field>(context.config.field(), field::BestKernel(), context.now_ms);
  } else {
    field_->Reconfigure(context.config->field, context.now_ms);
  }
  out.finished->push_back({.id = context.sequence});
}

// --- Requests

// Of the field; a robot with a goal is led to it, and at the goal senses nothing.
std::optional<field::Intensities> FieldPart::Sense(const Context& context, LinkIndex link,
                                                   uint8_t id, uint8_t type,
                                                   const field::PoseUm& pose,
                                                   field::SenseError* error) const {
  std::optional<field::Intensities> p = field_->Sense(type, pose, context.now_ms, error);
  const RobotState* robot = context.robots.Find(link, id);
  if (!p || robot == nullptr || !robot->goal) {
    return p;
  }
  return IsAt(*robot->goal, pose.position) ? field::Intensities{} : LeadTo(*robot->goal, pose, *p);
}

Message FieldPart::Answer(const Context& context, LinkIndex link, const Message& request) const {
  protocol::SenseRequest sense;
  protocol::Decode(request, &sense);
  field::SenseError error = field::SenseError::kNone;
  const field::PoseUm pose = context.robots.PoseOf(link, sense.id, sense.pose, context.now_ms);
  const auto p = Sense(context, link, sense.id, sense.type, pose, &error);
  if (!p) {
    return ErrorMessage(request, ToReason(error));
  }
  const WireIntensities wire = ToWire(*p);
  Message answer;
  protocol::Encode(protocol::SenseAnswer{sense.id, sense.type, sense.wide, wire.left, wire.right},
                   &answer);
  return answer;
}

Message FieldPart::Change(const Context& context, LinkIndex link, const Message& request) {
  protocol::DepositRequest deposit;
  return protocol::Decode(request, &deposit) ? Deposit(context, link, request)
                                             : Trace(context, link, request);
}

Message FieldPart::Deposit(const Context& context, LinkIndex link, const Message& message) {
  protocol::DepositRequest request;
  protocol::Decode(message, &request);
  const field::PointUm point =
      context.robots.PoseOf(link, request.id, {request.x, request.y, 0}, context.now_ms).position;
  const field::PheromoneLaw* law = field_->FindLaw(request.type);
  const bool has_place =
      law != nullptr && !law->is_blend() && context.config->field.map.Contains(point);
  const Reason reason =
      has_place && request.quanta == 0
          ? Reason::kBadValue
          : ToReason(field_->Deposit(request.type, point, request.quanta, context.now_ms));
  if (reason != Reason::kNone) {
    return ErrorMessage(message, reason);
  }
  Message answer;
  protocol::Encode(protocol::DepositAnswer{request.id, request.type, request.seq}, &answer);
  return answer;
}

// Senses first, so that a robot does not sense the quantum that it is about to deposit. If the
// deposit fails, no intensity is reported: a robot that lays a trail must learn that there is none.
Message FieldPart::Trace(const Context& context, LinkIndex link, const Message& message) {
  protocol::TraceRequest request;
  protocol::Decode(message, &request);
  const field::PheromoneLaw* law = field_->FindLaw(request.type);
  if (law != nullptr && law->is_blend()) {
    return ErrorMessage(message, Reason::kNotPermitted);  // before the position, as for DEPOSIT
  }
  const field::PoseUm pose = context.robots.PoseOf(link, request.id, request.pose, context.now_ms);
  field::SenseError error = field::SenseError::kNone;
  const auto p = Sense(context, link, request.id, request.type, pose, &error);
  const Reason reason =
      p ? ToReason(field_->Deposit(request.type, pose.position, 1, context.now_ms))
        : ToReason(error);
  if (reason != Reason::kNone) {
    return ErrorMessage(message, reason);
  }
  const WireIntensities wire = ToWire(*p);
  Message answer;
  protocol::Encode(protocol::TraceAnswer{request.id, request.type, request.wide, request.seq,
                                         wire.left, wire.right},
                   &answer);
  return answer;
}

// --- Edits

Status FieldPart::CheckEdit(const field::FieldEdit& edit) const {
  const std::string type = "pheromone type " + std::to_string(edit.type);
  const field::PheromoneLaw* law = field_->FindLaw(edit.type);
  if (law == nullptr) {
    return Error{type + " is not configured"};
  }
  if (law->is_blend()) {
    return Error{type + " (\"" + law->name + "\") is a blend, which has no pheromone of its own"};
  }
  if (edit.action != field::FieldEdit::Action::kErase && edit.level > law->max_level()) {
    return Error{type + " (\"" + law->name + "\") holds at most " +
                 std::to_string(law->max_level()) + "/64 quanta, not " +
                 std::to_string(edit.level) + "/64"};
  }
  const Status shape = field::CheckShape(edit);
  if (!shape.ok()) {
    return Error{shape.error() + "; " + field::DescribeExtent(field_->config().map)};
  }
  if (!field_->accepts_work()) {
    return Error{"too many map edits are pending; try again in a moment"};
  }
  return Ok();
}

Status FieldPart::Check(const Context& context, const FieldEdited& edited) const {
  Status possible = CheckEdit(edited.edit);
  if (!possible.ok() || edited.raster != nullptr) {
    return possible;
  }
  Event copy = edited;
  return Prepare(context.config, &copy);
}

void FieldPart::Apply(const Context& context, const FieldEdited& edited, const Output& out) {
  assert(CheckEdit(edited.edit).ok());
  field_->BeginEdit(context.sequence, edited.edit, edited.raster, context.now_ms, context.utc_ms);
  field_->TakeFinished(out.finished);
}

Status FieldPart::Check(const Context& /*context*/, const EditReversed& reversed) const {
  return field_->CheckReverse(reversed.redo);
}

void FieldPart::Apply(const Context& context, const EditReversed& reversed, const Output& out) {
  field_->BeginReverse(context.sequence, reversed.redo, context.now_ms);
  field_->TakeFinished(out.finished);
}

// --- Time and state

// Does a bounded portion of what is due.
void FieldPart::Advance(const Context& context, const Output& out) {
  field_->Advance(context.now_ms);
  field_->TakeFinished(out.finished);
}

std::optional<uint64_t> FieldPart::NextDeadline() const {
  return field_ != nullptr ? field_->NextDeadline() : std::nullopt;
}

void FieldPart::Restore(const Context& context, ByteReader* reader) {
  field_ = field::Field::Restore(context.config.field(), reader);
}

std::unique_ptr<FrozenPart> FieldPart::Freeze(uint64_t most_kept_bytes) const {
  std::unique_ptr<field::FrozenField> frozen = field_->Freeze(most_kept_bytes);
  return frozen != nullptr ? std::make_unique<FrozenFieldPart>(std::move(frozen)) : nullptr;
}

}  // namespace pheromone::engine
