#include "server/operators/web/api/mutations.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/core/field/extent.h"
#include "server/operators/control/json_text.h"
#include "server/operators/control/names.h"
#include "server/operators/control/views.h"
#include "server/operators/web/api/queries.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using field::FieldEdit;

constexpr size_t kMaxPoints = 1024;  // the engine's limit
constexpr double kWidestM = 1000;
constexpr double kDefaultToleranceM = 0.1;

Response Outcome(const Status& status) {
  return status.ok() ? Done({}) : Refuse(409, {status.error(), "", ""});
}

// A link on which this server has not sent a halt.
json::object DescribeUntold(const control::LinkView& link) {
  return {{"name", link.name},
          {"state", link.state},
          {"role", link.role},
          {"nodes", json::array(link.nodes.begin(), link.nodes.end())},
          {"owner", link.owner.empty() ? json::value(nullptr) : json::value(link.owner)}};
}

// Notes are a list of strings: what was done, or what is pending.
Response Outcome(const std::string& name, const Result<std::vector<std::string>>& notes) {
  return notes.ok() ? Done({{name, json::array(notes.value().begin(), notes.value().end())}})
                    : Refuse(409, {notes.error(), "", ""});
}

// Whether a shape reaches beyond the map: its corners or points do, or the discs around them.
bool IsPartlyOff(const FieldEdit& edit, const field::MapGeometry& map) {
  const int64_t margin = edit.shape == FieldEdit::Shape::kStroke ? edit.radius_um : 0;
  const auto is_off = [&](field::PointUm point) {
    return point.x - margin < map.origin.x || point.y - margin < map.origin.y ||
           point.x + margin > map.origin.x + map.width_um ||
           point.y + margin > map.origin.y + map.height_um;
  };
  return std::any_of(edit.points.begin(), edit.points.end(), is_off);
}

void MakeEdit(control::Control* control, const FieldEdit& edit, const field::MapGeometry& map,
              Respond respond) {
  control->Edit(edit, [respond = std::move(respond), is_partly_off = IsPartlyOff(edit, map)](
                          const Result<control::EditOutcome>& outcome) {
    respond(outcome.ok()
                ? Done({{"nodes", outcome.value().nodes},
                        {"changed", outcome.value().changed},
                        {"edit", outcome.value().edit != 0 ? json::value(outcome.value().edit)
                                                           : json::value(nullptr)},
                        {"partly_off_the_map", is_partly_off}})
                : Refuse(409, {outcome.error(), "", ""}));
  });
}

std::string HowMany(size_t count, const std::string& what) {
  return (count == 0 ? "no" : std::to_string(count)) + ' ' + what + (count == 1 ? "" : "s");
}

// Reads exactly one of area_m, points_m and all.
void ReadShape(Parameters* fields, FieldEdit* edit) {
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
    points = fields->Points("points_m", kMaxPoints);
    edit->radius_um = std::llround(fields->Number("radius_m", 0, kWidestM, 0.05).value_or(0) * 1e6);
  } else {
    edit->shape = FieldEdit::Shape::kAll;
    if (!fields->Boolean("all", false).value_or(true)) {
      fields->Expected("all", "true");
    }
  }
  edit->points = points.value_or(std::vector<field::PointUm>());
  edit->continues =
      static_cast<uint64_t>(fields->Integer("continues", 0, int64_t{1} << 53, 0).value_or(0));
}

void Reverse(bool redo, control::Control* control, Parameters* fields, Respond respond) {
  fields->AllowOnly({});
  if (Refused(*fields, respond)) {
    return;
  }
  control->Reverse(redo,
                   [respond = std::move(respond)](const Result<control::ReverseOutcome>& reversed) {
                     if (!reversed.ok()) {
                       respond(Refuse(409, {reversed.error(), "", ""}));
                       return;
                     }
                     const control::ReverseOutcome& it = reversed.value();
                     respond(Done({{"edit", it.edit.id},
                                   {"what", NameOf(it.edit, it.pheromone)},
                                   {"time_s", static_cast<double>(it.edit.utc_ms) / 1e3},
                                   {"changed", it.changed}}));
                   });
}

}  // namespace

void Deposit(control::Control* control, Parameters* fields, Respond respond) {
  const control::FieldView view = control->GetField();
  const field::PheromoneLaw* law = ReadLaw(view.config, false, fields);
  const auto x = fields->Metres("x_m", -1e6);
  const auto y = fields->Metres("y_m", -1e6);
  const auto quanta = fields->Integer("quanta", 1, law != nullptr ? law->max_count : 1, 1);
  fields->AllowOnly({"pheromone", "x_m", "y_m", "quanta"});
  if (Refused(*fields, respond) || law == nullptr) {
    return;
  }
  const field::PointUm point{*x, *y};
  const field::MapGeometry& map = view.config.map;
  if (!map.Contains(point)) {
    respond(Refuse(409, {"the position is off the map", "x_m, y_m",
                         "a position on " + field::DescribeExtent(map)}));
    return;
  }
  const field::NodeIndex node = map.NearestNode(point);
  if (view.config.obstacles && view.config.obstacles->Blocked(node)) {
    respond(Refuse(409, {"the position is blocked by an obstacle", "x_m, y_m",
                         "a position that is not blocked"}));
    return;
  }
  FieldEdit edit;
  edit.type = law->type;
  edit.shape = FieldEdit::Shape::kRectangle;
  edit.action = FieldEdit::Action::kAdd;
  edit.level = static_cast<uint32_t>(*quanta) * field::kLevelsPerQuantum;
  edit.points = {map.PositionOf(node), map.PositionOf(node)};
  control->Edit(edit, [respond = std::move(respond)](const Result<control::EditOutcome>& outcome) {
    respond(Outcome(outcome.ok() ? Ok() : Status(Error{outcome.error()})));
  });
}

void Erase(control::Control* control, Parameters* fields, Respond respond) {
  const control::FieldView view = control->GetField();
  const field::PheromoneLaw* law = ReadLaw(view.config, false, fields);
  FieldEdit edit;
  edit.action = FieldEdit::Action::kErase;
  ReadShape(fields, &edit);
  fields->AllowOnly({"pheromone", "area_m", "points_m", "radius_m", "all", "continues"});
  if (Refused(*fields, respond) || law == nullptr) {
    return;
  }
  edit.type = law->type;
  MakeEdit(control, edit, view.config.map, std::move(respond));
}

void Paint(control::Control* control, Parameters* fields, Respond respond) {
  const control::FieldView view = control->GetField();
  const field::PheromoneLaw* law = ReadLaw(view.config, false, fields);
  FieldEdit edit;
  ReadShape(fields, &edit);
  const double maximum = law != nullptr ? MaximumOf(*law) : 0;
  const auto units = fields->Number("units", 0, maximum, maximum);
  const auto add = fields->Boolean("add", false);
  fields->AllowOnly(
      {"pheromone", "area_m", "points_m", "radius_m", "all", "units", "add", "continues"});
  if (Refused(*fields, respond) || law == nullptr) {
    return;
  }
  edit.type = law->type;
  edit.action = *add ? FieldEdit::Action::kAdd : FieldEdit::Action::kSet;
  const double levels =
      *units * 1e6 * field::kLevelsPerQuantum / static_cast<double>(law->quantum_micro);
  edit.level = static_cast<uint32_t>(std::llround(levels));
  MakeEdit(control, edit, view.config.map, std::move(respond));
}

void Undo(control::Control* control, Parameters* fields, Respond respond) {
  Reverse(false, control, fields, std::move(respond));
}

void Redo(control::Control* control, Parameters* fields, Respond respond) {
  Reverse(true, control, fields, std::move(respond));
}

void Command(control::Control* control, Parameters* fields, Respond respond) {
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
  if (Refused(*fields, respond) || command == nullptr) {
    return;
  }
  control->Issue(*link, static_cast<uint8_t>(*id), command->code,
                 EncodeArguments(*command, *arguments), Report(std::move(respond)));
}

void GoTo(control::Control* control, Parameters* fields, Respond respond) {
  const auto link = fields->String("link");
  const auto id = fields->Integer("id", 1, 254);
  if (fields->Boolean("cancel", false).value_or(false)) {
    fields->AllowOnly({"link", "id", "cancel"});
    if (Refused(*fields, respond)) {
      return;
    }
    control->CancelGoal(*link, static_cast<uint8_t>(*id), Report(std::move(respond)));
    return;
  }
  const auto x = fields->Metres("x_m", -1e6);
  const auto y = fields->Metres("y_m", -1e6);
  const auto tolerance = fields->Number("tolerance_m", engine::kLeastToleranceUm / 1e6,
                                        engine::kMaxToleranceUm / 1e6, kDefaultToleranceM);
  fields->AllowOnly({"link", "id", "x_m", "y_m", "tolerance_m", "cancel"});
  if (Refused(*fields, respond)) {
    return;
  }
  control->SetGoal(*link, static_cast<uint8_t>(*id), {*x, *y},
                   static_cast<uint32_t>(std::llround(*tolerance * 1e6)),
                   Report(std::move(respond)));
}

void ChangeLaw(control::Control* control, Parameters* fields, Respond respond) {
  const control::FieldView view = control->GetField();
  const field::PheromoneLaw* law = ReadLaw(view.config, false, fields);
  const auto tau_s = fields->Number("tau_s", 0, static_cast<double>(field::kMaxTauMs) / 1e3);
  const int64_t tau_ms = std::llround(tau_s.value_or(0) * 1e3);
  if (tau_s && tau_ms == 0 && *tau_s != 0) {
    fields->Expected("tau_s", "at least 0.001, or 0 for no evaporation");
  }
  fields->AllowOnly({"pheromone", "tau_s"});
  if (Refused(*fields, respond) || law == nullptr) {
    return;
  }
  const auto answer = [respond = std::move(respond), name = law->name,
                       tau_ms](const Status& changed) {
    respond(changed.ok()
                ? Done({{"pheromone", name},
                        {"tau_s", static_cast<double>(tau_ms) / 1e3},
                        {"note",
                         "until the configuration is reread or the server restarts; its file is "
                         "unchanged"}})
                : Refuse(409, {changed.error(), "", ""}));
  };
  control->ChangeTau(law->type, tau_ms, answer);
}

void Halt(control::Control* control, Parameters* fields, Respond respond) {
  fields->AllowOnly({});
  if (Refused(*fields, respond)) {
    return;
  }
  control->HaltAll(
      [control, respond = std::move(respond)](const Result<std::vector<std::string>>& links) {
        if (!links.ok()) {
          respond(Outcome("links", links));
          return;
        }
        json::array told;
        json::array down;
        for (const control::LinkView& link : control->GetLinks()) {
          if (link.up && link.role == "serves") {
            told.emplace_back(link.name);
          } else {
            down.push_back(DescribeUntold(link));
          }
        }
        respond(Done({{"links", std::move(told)}, {"down", std::move(down)}}));
      });
}

void Unlock(control::Control* /*control*/, Parameters* fields, Respond respond) {
  fields->AllowOnly({});
  respond(fields->problem() ? Refuse(400, *fields->problem()) : Done({}));
}

void RevokeKeys(control::Control* control, Parameters* fields, Respond respond) {
  constexpr int64_t kLastRobot = 254;
  constexpr const char* kExpected = "IDs of robots, whole numbers from 1 to 254";
  const auto ids = fields->Integers("ids", kLastRobot).value_or(std::vector<int64_t>());
  const auto none =
      std::find_if(ids.begin(), ids.end(), [](int64_t id) { return id < 1 || id > kLastRobot; });
  if (none != ids.end()) {
    fields->Note({"found " + std::to_string(*none), "ids", kExpected});
  } else if (ids.empty()) {
    fields->Expected("ids", kExpected);
  }
  fields->AllowOnly({"ids"});
  if (Refused(*fields, respond)) {
    return;
  }
  const std::vector<uint8_t> robots(ids.begin(), ids.end());
  const bool is_kept = control->GetStatus(false).is_kept;
  control->RevokeKeys(robots, [respond = std::move(respond),
                               is_kept](const Result<std::vector<std::string>>& links) {
    respond(links.ok() ? Done({{"links", json::array(links.value().begin(), links.value().end())},
                               {"kept", is_kept}})
                       : Refuse(409, {links.error(), "", ""}));
  });
}

void Reload(control::Control* control, Parameters* fields, Respond respond) {
  fields->AllowOnly({});
  if (Refused(*fields, respond)) {
    return;
  }
  control->Reload([respond = std::move(respond)](const Result<std::vector<std::string>>& notes) {
    respond(Outcome("notes", notes));
  });
}

void Snapshot(control::Control* control, Parameters* fields, Respond respond) {
  fields->AllowOnly({});
  if (Refused(*fields, respond)) {
    return;
  }
  control->Snapshot([respond = std::move(respond)](const Result<std::optional<std::string>>& made) {
    if (!made.ok()) {
      respond(Refuse(409, {made.error(), "", ""}));
    } else if (!made.value()) {
      respond(Refuse(501, {"this server keeps no journal, so it cannot make a snapshot; "
                           "--save-field and SIGUSR1 save the field",
                           "", ""}));
    } else {
      respond(Done({{"snapshot", *made.value()}}));
    }
  });
}

void StepDown(control::Control* control, Parameters* fields, Respond respond) {
  const std::string successor =
      fields->Has("successor") ? fields->String("successor").value_or("") : "";
  fields->AllowOnly({"successor"});
  if (Refused(*fields, respond)) {
    return;
  }
  control->StepDown(successor, Report(std::move(respond)));
}

void Capture(control::Control* control, Parameters* fields, Respond respond) {
  const auto action = fields->String("action");
  if (action && *action != "start" && *action != "stop") {
    fields->Expected("action", "one of start, stop");
  }
  fields->AllowOnly({"action"});
  if (Refused(*fields, respond)) {
    return;
  }
  const auto answer = [control, respond = std::move(respond)](const Status& done) {
    respond(done.ok() ? Done(ToJson(control->GetCapture()).as_object())
                      : Refuse(409, {done.error(), "", ""}));
  };
  if (*action == "start") {
    control->StartCapture(answer);
  } else {
    control->StopCapture(answer);
  }
}

}  // namespace pheromone::web
