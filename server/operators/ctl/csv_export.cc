#include "server/operators/ctl/csv_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>

#include "protocol/messages.h"
#include "server/base/file.h"
#include "server/base/format.h"
#include "server/base/text.h"
#include "server/base/units.h"
#include "server/core/field/law.h"
#include "server/operators/control/control.h"
#include "server/operators/control/names.h"
#include "server/operators/ctl/export_recording.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {
namespace {

constexpr uint64_t kNsPerMilli = 1'000'000;
constexpr uint64_t kNsPerSecond = 1'000'000'000;
constexpr double kPerUnit = 4096;  // intensities on the wire
// A longer silence is not filled with rows: the clock was set, or nobody was there.
constexpr uint64_t kLongestGapNs = 3600 * kNsPerSecond;

constexpr std::string_view kRobotColumns =
    "time_s,utc,link,robot,x_m,y_m,heading_deg,pose_source,pheromone,left_units,right_units,state,"
    "reason,goal_x_m,goal_y_m,silent_s";
constexpr std::string_view kDepositColumns =
    "time_s,utc,by,link,robot,action,pheromone,x_m,y_m,units,quanta,shape,radius_m";
constexpr std::string_view kEventColumns = "time_s,utc,by,link,robot,event,value,text";

// One of the files.
class Table {
 public:
  Table(const std::filesystem::path& path, std::string_view columns) : file_(path.string()) {
    Write(columns);
  }

  void Row(std::string_view line) {
    Write(line);
    ++rows_;
  }
  FileWriter* file() { return &file_; }
  bool has_failed() const { return !file_.status().ok(); }
  uint64_t rows() const { return rows_; }
  std::string Describe() const { return fmt::format("{}: {} rows", file_.path(), rows_); }

 private:
  void Write(std::string_view line) {
    file_.Write(line);
    file_.Write("\n");
  }

  FileWriter file_;
  uint64_t rows_ = 0;
};

// What a robot was last answered.
struct SensedLast {
  uint8_t type = 0;
  int16_t left = 0;
  int16_t right = 0;
};

using RobotKey = std::pair<engine::LinkIndex, uint8_t>;

std::string NameOfType(const engine::EngineConfig& config, uint8_t type) {
  const field::PheromoneLaw* law = config.field.FindLaw(type);
  return law != nullptr ? CsvCell(law->name) : std::to_string(type);
}

std::string_view NameOf(field::FieldEdit::Action action) {
  switch (action) {
    case field::FieldEdit::Action::kSet:
      return "set";
    case field::FieldEdit::Action::kAdd:
      return "add";
    case field::FieldEdit::Action::kErase:
      break;
  }
  return "erase";
}

std::string_view NameOf(field::FieldEdit::Shape shape) {
  switch (shape) {
    case field::FieldEdit::Shape::kRectangle:
      return "rectangle";
    case field::FieldEdit::Shape::kStroke:
      return "stroke";
    case field::FieldEdit::Shape::kAll:
      break;
  }
  return "all";
}

class CsvTables : public RecordingExport {
 public:
  CsvTables(const std::filesystem::path& folder, double rate_hz)
      : robots_(folder / kCsvTables[0], kRobotColumns),
        deposits_(folder / kCsvTables[1], kDepositColumns),
        events_(folder / kCsvTables[2], kEventColumns),
        step_ns_(static_cast<uint64_t>(1e9 / rate_hz)) {}

  void Begin(const playback::Player* player) override {
    player_ = player;
    next_ns_ = 0;
    sensed_.clear();
    begin_ns_ = begin_ns_.value_or(player->range().begin_ns);
  }

  void Until(uint64_t until_ns) override {
    record_ns_ = until_ns;
    if (next_ns_ == 0 || until_ns > next_ns_ + kLongestGapNs) {
      next_ns_ = until_ns;
    }
    for (; next_ns_ < until_ns; next_ns_ += step_ns_) {
      AddRobots(next_ns_);
    }
  }

  void End(uint64_t end_ns) override { AddRobots(end_ns); }

  void AddRobots(uint64_t time_ns) {
    const engine::EngineConfig& config = player_->engine().config();
    for (const control::ClientView& client : player_->Clients(time_ns)) {
      const auto link =
          std::find_if(config.links.begin(), config.links.end(),
                       [&](const engine::LinkSettings& it) { return it.name == client.link; });
      const auto sensed =
          sensed_.find({static_cast<engine::LinkIndex>(link - config.links.begin()), client.id});
      const std::string pose =
          client.pose_source == control::PoseSource::kNone
              ? ",,,"
              : fmt::format("{},{},{:.2f},{}", Metres(client.pose.position.x),
                            Metres(client.pose.position.y), Degrees(client.pose.heading),
                            web::NameOf(client.pose_source));
      const std::string senses =
          sensed == sensed_.end()
              ? ",,"
              : fmt::format("{},{},{}", NameOfType(config, sensed->second.type),
                            sensed->second.left / kPerUnit, sensed->second.right / kPerUnit);
      const std::optional<engine::Goal>& goal = client.robot.goal;
      robots_.Row(fmt::format(
          "{},{},{},{},{},{},{},{},{},{}", When(time_ns), CsvCell(client.link), client.id, pose,
          senses, control::NameOf(client.condition.state), CsvCell(client.condition.reason),
          goal ? fmt::format("{}", Metres(goal->point().x)) : "",
          goal ? fmt::format("{}", Metres(goal->point().y)) : "",
          client.silent_ms ? fmt::format("{:.3f}", static_cast<double>(*client.silent_ms) / 1e3)
                           : ""));
    }
  }

  void Answer(const capture::Sent& sent) override {
    protocol::SenseAnswer sense;
    protocol::TraceAnswer trace;
    protocol::DepositAnswer deposit;
    if (protocol::Decode(sent.message, &sense)) {
      sensed_[{sent.link, sense.id}] = {sense.type, sense.left, sense.right};
    } else if (protocol::Decode(sent.message, &trace)) {
      sensed_[{sent.link, trace.id}] = {trace.type, trace.left, trace.right};
      accepted_.emplace_back(trace.id, trace.seq);
    } else if (protocol::Decode(sent.message, &deposit)) {
      accepted_.emplace_back(deposit.id, deposit.seq);
    }
  }

  void Note(const capture::Record& record) override {
    if (const auto* batch = std::get_if<capture::Batch>(&record)) {
      for (const capture::Handled& handled : batch->messages) {
        if (handled.sequence != 0) {
          NoteMessage(batch->stamp, batch->link, handled.message);
        }
      }
    } else if (const auto* applied = std::get_if<capture::EventApplied>(&record)) {
      time_ = &applied->stamp;
      std::visit(*this, applied->event);
    } else if (const auto* unlogged = std::get_if<capture::Unlogged>(&record)) {
      AddEvent(record_ns_, "operator", unlogged->sent.link, 0, "command", "",
               "halt, of all; not logged");
    }
    accepted_.clear();
  }

  // The kinds of events that no robot has sent.
  void operator()(const engine::FieldEdited& it) {
    const field::FieldEdit& edit = it.edit;
    const field::PheromoneLaw* law = player_->engine().config().field.FindLaw(edit.type);
    const double quanta = static_cast<double>(edit.level) / field::kLevelsPerQuantum;
    const bool has_level = edit.action != field::FieldEdit::Action::kErase;
    const std::string level =
        has_level && law != nullptr
            ? fmt::format("{},{}", quanta * static_cast<double>(law->quantum_micro) / 1e6, quanta)
            : ",";
    const std::string place =
        edit.points.empty()
            ? ","
            : fmt::format("{},{}", Metres(edit.points.front().x), Metres(edit.points.front().y));
    deposits_.Row(fmt::format(
        "{},operator,,,{},{},{},{},{},{}", When(NsOf(*time_)), NameOf(edit.action),
        NameOfType(player_->engine().config(), edit.type), place, level, NameOf(edit.shape),
        edit.shape == field::FieldEdit::Shape::kStroke ? fmt::format("{}", Metres(edit.radius_um))
                                                       : ""));
  }
  void operator()(const engine::EditReversed& it) {
    AddEvent(NsOf(*time_), "operator", std::nullopt, 0, it.redo ? "redo" : "undo", "", "");
  }
  void operator()(const engine::CommandIssued& it) {
    const std::string name(web::NameOf(it.code));
    AddEvent(NsOf(*time_), "operator", it.link, it.id == protocol::kBroadcastId ? 0 : it.id,
             "command", "", it.id == protocol::kBroadcastId ? name + ", of all" : name);
  }
  void operator()(const engine::GoalSet& it) {
    AddEvent(NsOf(*time_), "operator", it.link, it.id, "goal", "",
             fmt::format("{} {} m", Metres(it.goal.point().x), Metres(it.goal.point().y)));
  }
  void operator()(const engine::GoalEnded& it) {
    AddEvent(NsOf(*time_), it.reached ? "server" : "operator", it.link, it.id,
             it.reached ? "goal reached" : "goal cancelled", "", "");
  }
  void operator()(const engine::ConfigChanged& /*it*/) {
    AddEvent(NsOf(*time_), "server", std::nullopt, 0, "configuration", "", "");
  }
  void operator()(const engine::TagsChanged& it) {
    AddEvent(NsOf(*time_), "operator", std::nullopt, 0, "tags changed", "",
             std::visit([](const auto& change) { return std::string(change.kName); }, it.change));
  }
  void operator()(const engine::NetsChanged& it) {
    AddEvent(NsOf(*time_), "operator", std::nullopt, 0, "net reset", "", it.net);
  }
  void operator()(const engine::KeysRevoked& it) {
    for (const engine::RevokedKey& key : it.keys) {
      AddEvent(NsOf(*time_), "operator", std::nullopt, key.id, "key revoked", "", "");
    }
  }
  void operator()(const engine::PoseObserved& /*it*/) {}  // poses are in robots.csv
  void operator()(const engine::Advance& /*it*/) {}
  void operator()(const engine::RequestReceived& /*it*/) {}  // robots' are in batches

  bool has_failed() const override {
    return robots_.has_failed() || deposits_.has_failed() || events_.has_failed();
  }
  // Replaces no table if one of them cannot be written.
  Status Replace() {
    Table* const tables[] = {&robots_, &deposits_, &events_};
    for (Table* table : tables) {
      PHEROMONE_TRY_STATUS(table->file()->Close());
    }
    for (Table* table : tables) {
      PHEROMONE_TRY_STATUS(table->file()->Commit());
    }
    return Ok();
  }
  uint64_t rows() const { return robots_.rows() + deposits_.rows() + events_.rows(); }
  std::string Describe() const {
    return robots_.Describe() + '\n' + deposits_.Describe() + '\n' + events_.Describe() + '\n';
  }

 private:
  static uint64_t NsOf(const engine::Stamp& stamp) {
    return static_cast<uint64_t>(std::max<int64_t>(stamp.utc_ms, 0)) * kNsPerMilli;
  }

  // "time_s,utc"
  std::string When(uint64_t time_ns) const {
    const double since_s = (static_cast<double>(time_ns) - static_cast<double>(*begin_ns_)) / 1e9;
    return fmt::format("{:.3f},{}", since_s,
                       UtcMsText(static_cast<int64_t>(time_ns / kNsPerMilli)));
  }

  // Of what was not refused.
  bool WasAccepted(uint8_t id, uint8_t seq) const {
    return std::find(accepted_.begin(), accepted_.end(), std::pair(id, seq)) != accepted_.end();
  }

  void NoteMessage(const engine::Stamp& stamp, engine::LinkIndex link,
                   const protocol::Message& message) {
    protocol::DepositRequest deposit;
    protocol::TraceRequest trace;
    protocol::HelloRequest hello;
    protocol::EventReport event;
    protocol::CommandAck ack;
    if (protocol::Decode(message, &deposit)) {
      if (WasAccepted(deposit.id, deposit.seq)) {
        AddDeposit(stamp, link, message.id, "deposit", deposit.type, {deposit.x, deposit.y, 0},
                   deposit.quanta);
      }
    } else if (protocol::Decode(message, &trace)) {
      if (WasAccepted(trace.id, trace.seq)) {
        AddDeposit(stamp, link, message.id, "trace", trace.type, trace.pose, 1);
      }
    } else if (protocol::Decode(message, &hello)) {
      AddEvent(NsOf(stamp), "robot", link, message.id, "hello", std::to_string(hello.nonce), "");
    } else if (protocol::Decode(message, &event)) {
      AddEvent(NsOf(stamp), "robot", link, message.id, std::string(web::NameOf(event.code)),
               std::to_string(event.argument), "");
    } else if (protocol::Decode(message, &ack)) {
      AddEvent(NsOf(stamp), "robot", link, message.id, "command acknowledged",
               std::to_string(ack.result), std::string(web::NameOf(ack.code)));
    }
  }

  void AddDeposit(const engine::Stamp& stamp, engine::LinkIndex link, uint8_t id,
                  std::string_view action, uint8_t type, const protocol::WirePose& reported,
                  int quanta) {
    const engine::Engine& engine = player_->engine();
    const field::PointUm place =
        engine.robots().PoseOf(link, id, reported, stamp.field_time_ms).position;
    const field::PheromoneLaw* law = engine.config().field.FindLaw(type);
    const double unit = law != nullptr ? static_cast<double>(law->quantum_micro) / 1e6 : 0;
    deposits_.Row(fmt::format("{},robot,{},{},{},{},{},{},{},{},,", When(NsOf(stamp)),
                              NameOfLink(link), id, action, NameOfType(engine.config(), type),
                              Metres(place.x), Metres(place.y), quanta * unit, quanta));
  }

  std::string NameOfLink(std::optional<engine::LinkIndex> link) const {
    const auto& links = player_->engine().config().links;
    return link && *link < links.size() ? CsvCell(links[*link].name) : "";
  }

  // `robot` 0: none, or all.
  void AddEvent(uint64_t time_ns, std::string_view by, std::optional<engine::LinkIndex> link,
                uint8_t robot, const std::string& event, const std::string& value,
                const std::string& text) {
    events_.Row(fmt::format("{},{},{},{},{},{},{}", When(time_ns), by, NameOfLink(link),
                            robot == 0 ? "" : std::to_string(robot), CsvCell(event), value,
                            CsvCell(text)));
  }

  Table robots_;
  Table deposits_;
  Table events_;
  const uint64_t step_ns_;
  const playback::Player* player_ = nullptr;
  std::optional<uint64_t> begin_ns_;
  uint64_t next_ns_ = 0;
  uint64_t record_ns_ = 0;               // of the record that is noted
  const engine::Stamp* time_ = nullptr;  // of the event that is visited
  std::map<RobotKey, SensedLast> sensed_;
  std::vector<std::pair<uint8_t, uint8_t>> accepted_;  // IDs and seqs, for the present record
};

}  // namespace

int ExportCsv(const std::vector<std::string>& captures, const CsvOptions& options) {
  std::error_code error;
  std::filesystem::create_directory(options.folder, error);  // else no file can be made
  CsvTables tables(options.folder, options.rate_hz);
  const Status exported = ExportRecordings(captures, &tables);
  if (!exported.ok() && tables.rows() == 0) {
    return Fail(kFailed, exported.error());
  }
  if (const Status written = tables.Replace(); !written.ok()) {
    return Fail(kFailed, written.error());
  }
  if (!exported.ok()) {
    return Fail(kFailed, exported.error() + "\n  the tables in " + options.folder + " end there");
  }
  std::cout << tables.Describe();
  return 0;
}

}  // namespace pheromone::ctl
