#include "server/store/journal/event_text.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include "protocol/tag_messages.h"
#include "server/core/engine/event_codec.h"

namespace pheromone::journal {
namespace {

struct Value {
  std::string_view name;
  std::string text;
  bool is_word = false;
};
using Values = std::vector<Value>;

template <typename Number>
void Add(std::string_view name, Number number, Values* values) {
  values->push_back({name, std::to_string(number), false});
}

void AddWord(std::string_view name, std::string word, Values* values) {
  values->push_back({name, std::move(word), true});
}

void AddPose(const protocol::WirePose& pose, Values* values) {
  Add("x", pose.x, values);
  Add("y", pose.y, values);
  Add("heading", pose.heading, values);
}

// The value is the tag's number, or the symbol's; the code the slot, or the kind of symbol.
bool AddTagRequest(const protocol::Message& message, Values* values) {
  const auto add = [&](const char* event, uint8_t seq, int32_t value, int code) {
    AddWord("event", event, values);
    Add("seq", seq, values);
    Add("value", value, values);
    Add("code", code, values);
  };
  protocol::TagWriteRequest write;
  protocol::TagEraseRequest erase;
  protocol::SymbolRequest symbol;
  if (protocol::Decode(message, &write)) {
    add("tag_write", write.seq, write.tag, write.slot);
    Add("x", write.x, values);
    Add("y", write.y, values);
  } else if (protocol::Decode(message, &erase)) {
    add("tag_erase", erase.seq, erase.tag, erase.slot);
    Add("x", erase.x, values);
    Add("y", erase.y, values);
  } else if (protocol::Decode(message, &symbol)) {
    add("symbol", symbol.seq, symbol.number, static_cast<int>(symbol.kind));
  } else {
    return false;
  }
  return true;
}

void AddRequest(const protocol::Message& message, Values* values) {
  protocol::HelloRequest hello;
  protocol::DepositRequest deposit;
  protocol::TraceRequest trace;
  protocol::EventReport report;
  protocol::CommandAck ack;
  if (protocol::Decode(message, &hello)) {
    AddWord("event", "hello", values);
    Add("value", hello.nonce, values);
  } else if (protocol::Decode(message, &deposit)) {
    AddWord("event", "deposit", values);
    Add("pheromone", deposit.type, values);
    Add("seq", deposit.seq, values);
    Add("x", deposit.x, values);
    Add("y", deposit.y, values);
    Add("value", deposit.quanta, values);
  } else if (protocol::Decode(message, &trace)) {
    AddWord("event", "trace", values);
    Add("pheromone", trace.type, values);
    Add("seq", trace.seq, values);
    AddPose(trace.pose, values);
  } else if (protocol::Decode(message, &report)) {
    AddWord("event", "report", values);
    Add("seq", report.seq, values);
    Add("value", report.argument, values);
    Add("code", static_cast<int>(report.code), values);
  } else if (protocol::Decode(message, &ack)) {
    AddWord("event", "command_ack", values);
    Add("seq", ack.seq, values);
    Add("value", ack.result, values);
    Add("code", static_cast<int>(ack.code), values);
  } else if (!AddTagRequest(message, values)) {
    AddWord("event", "request", values);
    Add("code", message.opcode, values);
  }
}

struct Describer {
  Values* values;

  void operator()(const engine::RequestReceived& it) const {
    AddRequest(it.message, values);
    Add("link", it.link, values);
    Add("robot", it.message.id, values);
  }
  void operator()(const engine::Advance& /*it*/) const { AddWord("event", "advance", values); }
  void operator()(const engine::ConfigChanged& it) const {
    AddWord("event", "configuration", values);
    Add("value", it.new_epoch, values);
  }
  void operator()(const engine::CommandIssued& it) const {
    AddWord("event", "command", values);
    Add("link", it.link, values);
    Add("robot", it.id, values);
    Add("code", static_cast<int>(it.code), values);
  }
  void operator()(const engine::FieldEdited& it) const {
    constexpr std::string_view kActions[] = {"edit_set", "edit_add", "edit_erase"};
    AddWord("event", std::string(kActions[static_cast<size_t>(it.edit.action)]), values);
    Add("pheromone", it.edit.type, values);
    if (!it.edit.points.empty()) {
      Add("x_um", it.edit.points.front().x, values);
      Add("y_um", it.edit.points.front().y, values);
    }
    Add("value", it.edit.level, values);
    Add("code", static_cast<int>(it.edit.shape), values);
  }
  void operator()(const engine::TagsChanged& it) const {
    AddWord("event", "tags_changed", values);
    Add("code", it.change.index(), values);
  }
  void operator()(const engine::EditReversed& it) const {
    AddWord("event", it.redo ? "redo" : "undo", values);
  }
  void operator()(const engine::NetsChanged& /*it*/) const {
    AddWord("event", "nets_changed", values);
  }
  void operator()(const engine::KeysRevoked& it) const {
    AddWord("event", "keys_revoked", values);
    Add("robot", it.keys.empty() ? 0 : it.keys.front().id, values);
    Add("value", it.keys.size(), values);
  }
  void operator()(const engine::PoseObserved& it) const {
    AddWord("event", "observed", values);
    Add("link", it.link, values);
    Add("robot", it.id, values);
    Add("heading", it.pose.heading, values);
    Add("x_um", it.pose.position.x, values);
    Add("y_um", it.pose.position.y, values);
    Add("value", it.valid_ms, values);
  }
  void operator()(const engine::GoalSet& it) const {
    AddWord("event", "goal", values);
    Add("link", it.link, values);
    Add("robot", it.id, values);
    Add("x_um", it.goal.point().x, values);
    Add("y_um", it.goal.point().y, values);
    Add("value", it.goal.tolerance_um, values);
  }
  void operator()(const engine::GoalEnded& it) const {
    AddWord("event", it.reached ? "goal_reached" : "goal_cancelled", values);
    Add("link", it.link, values);
    Add("robot", it.id, values);
    if (it.reached) {
      Add("x_um", it.position.x, values);
      Add("y_um", it.position.y, values);
    }
  }
};

Values ValuesOf(const Record& record) {
  Values values;
  Add("sequence", record.sequence, &values);
  Add("field_time_ms", record.stamp.field_time_ms, &values);
  Add("utc_ms", record.stamp.utc_ms, &values);
  ByteReader reader(record.event);
  const engine::Event event = engine::DecodeEvent(&reader);
  if (reader.ok()) {
    std::visit(Describer{&values}, event);
  } else {
    AddWord("event", "unknown", &values);
  }
  return values;
}

}  // namespace

std::string InCsv(const Record& record) {
  const Values values = ValuesOf(record);
  std::string line;
  std::string_view rest = kCsvHeader;
  while (!rest.empty()) {
    const std::string_view column = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), column.size() + 1));
    const auto found = std::find_if(values.begin(), values.end(),
                                    [column](const Value& it) { return it.name == column; });
    line += (found != values.end() ? found->text : "") + (rest.empty() ? "" : ",");
  }
  return line;
}

std::string InJson(const Record& record) {
  std::string line;
  for (const Value& value : ValuesOf(record)) {
    const std::string quote = value.is_word ? "\"" : "";  // words need no escaping
    line.append(line.empty() ? "{\"" : ",\"").append(value.name);
    line.append("\":").append(quote).append(value.text).append(quote);
  }
  return line + "}";
}

std::string InWords(const Record& record) {
  std::string event;
  std::string rest;
  for (const Value& value : ValuesOf(record)) {
    if (value.name == "event") {
      event = value.text;
    } else {
      rest.append(" ").append(value.name) += "=" + value.text;
    }
  }
  return event + rest;
}

}  // namespace pheromone::journal
