#include "server/web/changing.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/web/codes.h"
#include "server/web/json_text.h"
#include "server/web/reading.h"
#include "server/web/views.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using field::FieldEdit;

constexpr size_t kMostPoints = 1024;  // as the engine takes
constexpr double kWidestM = 1000;

Response Done(json::object what) {
  what["done"] = true;
  return {.body = ToText(what)};
}

Response Outcome(const Status& status) {
  return status.ok() ? Done({}) : Refuse(409, {status.error(), "", ""});
}

std::string HowMany(size_t count, const std::string& what) {
  return (count == 0 ? "no" : std::to_string(count)) + ' ' + what + (count == 1 ? "" : "s");
}

// Reads exactly one of area_m, points_m and all.
void ReadShape(Fields* fields, FieldEdit* edit) {
  const int shapes =
      int{fields->Has("area_m")} + int{fields->Has("points_m")} + int{fields->Has("all")};
  if (shapes != 1) {
    fields->Note({"found " + std::to_string(shapes) + " shapes", "area_m, points_m, all",
                  "exactly one of them"});
    return;
  }
  std::optional<std::vector<field::PointUm>> points;
  if (fields->Has("area_m")) {
    edit->shape = FieldEdit::Shape::kRectangle;
    points = fields->Corners("area_m");
  } else if (fields->Has("points_m")) {
    edit->shape = FieldEdit::Shape::kStroke;
    points = fields->Points("points_m", kMostPoints);
    edit->radius_um = std::llround(fields->Number("radius_m", 0, kWidestM, 0.05).value_or(0) * 1e6);
  } else {
    edit->shape = FieldEdit::Shape::kAll;
    if (!fields->Boolean("all", false).value_or(true)) {
      fields->Expected("all", "true");
    }
  }
  edit->points = points.value_or(std::vector<field::PointUm>());
}

}  // namespace

Response Deposit(engine::Control* control, Fields* fields) {
  const engine::FieldView view = control->GetField();
  const field::PheromoneLaw* law = ReadLaw(view.config, false, fields);
  const auto x = fields->Metres("x_m", -1e6);
  const auto y = fields->Metres("y_m", -1e6);
  const auto quanta = fields->Integer("quanta", 1, law != nullptr ? law->max_count : 1, 1);
  fields->AllowOnly({"pheromone", "x_m", "y_m", "quanta"});
  if (fields->problem() || law == nullptr) {
    return Refuse(400, *fields->problem());
  }
  const field::PointUm point{*x, *y};
  const field::MapGeometry& map = view.config.map;
  if (!map.Contains(point)) {
    return Refuse(409, {"the place is off the map", "x_m, y_m", "a place on the map"});
  }
  const field::NodeIndex node = map.NearestNode(point);
  if (view.config.obstacles && view.config.obstacles->Blocked(node)) {
    return Refuse(409, {"there is an obstacle", "x_m, y_m", "a place that robots can reach"});
  }
  FieldEdit edit;
  edit.type = law->type;
  edit.shape = FieldEdit::Shape::kRectangle;
  edit.action = FieldEdit::Action::kAdd;
  edit.level = static_cast<uint32_t>(*quanta) * field::kLevelsPerQuantum;
  edit.points = {map.PositionOf(node), map.PositionOf(node)};
  return Outcome(control->Edit(edit));
}

Response Erase(engine::Control* control, Fields* fields) {
  const engine::FieldView view = control->GetField();
  const field::PheromoneLaw* law = ReadLaw(view.config, false, fields);
  FieldEdit edit;
  edit.action = FieldEdit::Action::kErase;
  ReadShape(fields, &edit);
  fields->AllowOnly({"pheromone", "area_m", "points_m", "radius_m", "all"});
  if (fields->problem() || law == nullptr) {
    return Refuse(400, *fields->problem());
  }
  edit.type = law->type;
  return Outcome(control->Edit(edit));
}

Response Paint(engine::Control* control, Fields* fields) {
  const engine::FieldView view = control->GetField();
  const field::PheromoneLaw* law = ReadLaw(view.config, false, fields);
  FieldEdit edit;
  ReadShape(fields, &edit);
  const double maximum = law != nullptr ? MaximumOf(*law) : 0;
  const auto units = fields->Number("units", 0, maximum, maximum);
  const auto add = fields->Boolean("add", false);
  fields->AllowOnly({"pheromone", "area_m", "points_m", "radius_m", "all", "units", "add"});
  if (fields->problem() || law == nullptr) {
    return Refuse(400, *fields->problem());
  }
  edit.type = law->type;
  edit.action = *add ? FieldEdit::Action::kAdd : FieldEdit::Action::kSet;
  const double levels =
      *units * 1e6 * field::kLevelsPerQuantum / static_cast<double>(law->quantum_micro);
  edit.level = static_cast<uint32_t>(std::llround(levels));
  return Outcome(control->Edit(edit));
}

Response Command(engine::Control* control, Fields* fields) {
  const auto link = fields->String("link");
  const auto id = fields->Integer("id", 1, 254);
  const auto name = fields->String("command");
  const CommandSpec* command = name ? FindCommand(*name) : nullptr;
  if (name && command == nullptr) {
    fields->Expected("command", "one of " + ListOfCommands());
  }
  const auto arguments = fields->Integers("arguments", protocol::kMaxCommandArguments);
  fields->AllowOnly({"link", "id", "command", "arguments"});
  if (command != nullptr && arguments) {
    bool good = arguments->size() == command->arguments.size();
    std::string expected = HowMany(command->arguments.size(), "argument");
    for (size_t i = 0; i < command->arguments.size(); ++i) {
      const CommandSpec::Argument& it = command->arguments[i];
      good = good && (*arguments)[i] >= it.least && (*arguments)[i] <= it.most;
      expected += (i == 0 ? ": " : ", ") + std::string(it.name) + " from " +
                  std::to_string(it.least) + " to " + std::to_string(it.most);
    }
    if (!good) {
      fields->Expected("arguments", expected);
    }
  }
  if (fields->problem() || command == nullptr) {
    return Refuse(400, *fields->problem());
  }
  return Outcome(control->Issue(*link, static_cast<uint8_t>(*id), command->code,
                                EncodeArguments(*command, *arguments)));
}

Response Halt(engine::Control* control, Fields* fields) {
  fields->AllowOnly({});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  const Result<std::vector<std::string>> halted = control->HaltAll();
  if (!halted.ok()) {
    return Refuse(409, {halted.error(), "", ""});
  }
  return Done({{"links", json::array(halted.value().begin(), halted.value().end())}});
}

Response Reload(engine::Control* control, Fields* fields) {
  fields->AllowOnly({});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  const Result<std::vector<std::string>> notes = control->Reload();
  if (!notes.ok()) {
    return Refuse(409, {notes.error(), "", ""});
  }
  return Done({{"notes", json::array(notes.value().begin(), notes.value().end())}});
}

Response Snapshot(engine::Control* control, Fields* fields) {
  fields->AllowOnly({});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  const Result<std::string> made = control->Snapshot();
  if (!made.ok()) {
    return Refuse(501, {made.error(), "", ""});
  }
  return Done({{"snapshot", made.value()}});
}

Response Capture(engine::Control* control, Fields* fields) {
  const auto action = fields->String("action");
  if (action && *action != "start" && *action != "stop") {
    fields->Expected("action", "one of start, stop");
  }
  fields->AllowOnly({"action"});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  const Status done = *action == "start" ? control->StartCapture() : control->StopCapture();
  return done.ok() ? Done(ToJson(control->GetCapture()).as_object())
                   : Refuse(409, {done.error(), "", ""});
}

}  // namespace pheromone::web
