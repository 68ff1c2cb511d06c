#include "server/operators/web/api/tags.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "server/operators/control/json_text.h"
#include "server/operators/control/views.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using engine::TagsChanged;

constexpr int64_t kLeastWord = std::numeric_limits<int32_t>::min();
constexpr int64_t kMostWord = std::numeric_limits<int32_t>::max();
constexpr size_t kStatementWords = 6;

json::array ToJson(const tags::Term& term) {
  return {term.space, term.value};
}

json::value BlocksToJson(const control::TagView& view) {
  json::array blocks;
  const std::vector<tags::Slot>& slots = view.content.tag.slots();
  for (size_t i = 0; i < slots.size(); ++i) {
    const tags::Block& block = slots[i].block;
    if (block.is_empty()) {
      continue;
    }
    const bool is_privileged =
        std::find(view.privileged.begin(), view.privileged.end(), i) != view.privileged.end();
    blocks.push_back(json::object{
        {"slot", i},
        {"generation", slots[i].generation},
        {"lease_s", slots[i].is_leased() ? json::value(view.lease_s[i]) : json::value(nullptr)},
        {"privileged", is_privileged},
        {"author", block.author},
        {"time_s", block.time_s},
        {"subject", ToJson(block.subject)},
        {"predicate", ToJson(block.predicate)},
        {"object", ToJson(block.object)}});
  }
  return blocks;
}

json::object ToJson(const control::TagView& view, bool with_contents) {
  const auto metres = [&](int64_t tags::Place::*um) {
    return view.place ? json::value(Metres((*view.place).*um)) : json::value(nullptr);
  };
  json::object tag{{"name", view.content.name},
                   {"number", view.content.number},
                   {"configured", view.place.has_value()},
                   {"x_m", metres(&tags::Place::x_um)},
                   {"y_m", metres(&tags::Place::y_um)},
                   {"range_m", metres(&tags::Place::range_um)},
                   {"slots", view.content.tag.slots().size()},
                   {"used", view.content.tag.used()},
                   {"generation", view.content.tag.generation()}};
  if (with_contents) {
    tag["blocks"] = BlocksToJson(view);
  }
  return tag;
}

// What is missing or wrong is noted.
uint16_t ReadTag(const control::Control& control, Parameters* fields) {
  const auto name = fields->String("tag");
  const auto number = name ? control.FindTag(*name) : std::nullopt;
  if (name && !number) {
    fields->Expected("tag", "the name of a tag");
  }
  return number.value_or(0);
}

std::optional<uint8_t> ReadSlot(Parameters* fields) {
  const auto slot = fields->Integer("slot", 0, tags::kMaxSlots - 1);
  return slot ? std::optional(static_cast<uint8_t>(*slot)) : std::nullopt;
}

std::optional<uint16_t> ReadExpected(Parameters* fields) {
  return fields->Has("expected") ? std::optional(static_cast<uint16_t>(
                                       fields->Integer("expected", 0, 0xFFFF).value_or(0)))
                                 : std::nullopt;
}

TagsChanged::Write ReadWrite(const control::Control& control, Parameters* fields) {
  TagsChanged::Write write;
  write.tag = ReadTag(control, fields);
  const auto author = fields->Integer("author", 1, kMostWord);
  const auto time_s = fields->Integer("time_s", 0, 0xFFFFFFFF, 0);
  const auto words = fields->Integers("block", kStatementWords);
  const bool is_good = words && words->size() == kStatementWords &&
                       std::all_of(words->begin(), words->end(), [](int64_t word) {
                         return word >= kLeastWord && word <= kMostWord;
                       });
  if (words && !is_good) {
    fields->Expected("block",
                     "six numbers of 32 bits: namespace and number of subject, predicate, object");
  }
  if (is_good) {
    const auto term = [&](size_t at) {
      return tags::Term{static_cast<int32_t>((*words)[at]), static_cast<int32_t>((*words)[at + 1])};
    };
    write.block = {static_cast<int32_t>(author.value_or(0)),
                   static_cast<uint32_t>(time_s.value_or(0)), term(0), term(2), term(4)};
  }
  if (fields->Has("slot")) {
    write.slot = ReadSlot(fields);
  }
  write.expected = ReadExpected(fields);
  write.is_state = fields->Boolean("replace", false).value_or(false);
  write.lease_ms = static_cast<uint32_t>(
      fields->Number("lease_s", 0, tags::kMaxLeaseMs / 1000.0, 0).value_or(0) * 1000);
  fields->AllowOnly(
      {"action", "tag", "author", "time_s", "block", "slot", "expected", "replace", "lease_s"});
  return write;
}

TagsChanged::Erase ReadErase(const control::Control& control, Parameters* fields) {
  TagsChanged::Erase erase;
  erase.tag = ReadTag(control, fields);
  erase.slot = ReadSlot(fields).value_or(0);
  erase.expected = ReadExpected(fields);
  fields->AllowOnly({"action", "tag", "slot", "expected"});
  return erase;
}

void ReadRow(Parameters* fields, tags::Row* row) {
  const auto kind = fields->String("kind");
  const auto named = tags::RowKindNamed(kind.value_or(""));
  if (kind && !named) {
    fields->Expected("kind", "one of robot, string, mapping");
  }
  row->kind = named.value_or(tags::RowKind::kRobot);
  row->robot = static_cast<int32_t>(fields->Integer("robot", 1, kMostWord).value_or(1));
  row->number = static_cast<int32_t>(fields->Integer("number", 1, kMostWord).value_or(1));
  row->text = fields->String("text", "").value_or("");
  fields->AllowOnly({"action", "kind", "robot", "number", "text"});
}

}  // namespace

json::value TagsToJson(const std::vector<control::TagView>& tags) {
  json::array all;
  for (const control::TagView& view : tags) {
    all.push_back(ToJson(view, true));
  }
  return json::object{{"tags", std::move(all)}};
}

Response ReadTags(const control::Control& control, Parameters* fields) {
  const auto first = fields->Integer("first", 1, 0xFFFF, 1);
  const auto with_contents = fields->Integer("contents", 0, 1, 0);
  fields->AllowOnly({"first", "contents"});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  const control::TagPage page = control.GetTags(static_cast<uint16_t>(*first));
  json::array all;
  for (const control::TagView& tag : page.tags) {
    all.push_back(ToJson(tag, *with_contents != 0));
  }
  return {.body = ToText(
              json::object{{"tags", std::move(all)},
                           {"next", page.next ? json::value(*page.next) : json::value(nullptr)}})};
}

// Of a robot; without one, of operators and nets.
TagsChanged::Forget ReadForget(Parameters* fields) {
  tags::Maker maker;
  maker.link = fields->String("link", "").value_or("");
  const auto id = fields->Integer("id", 0, protocol::kBroadcastId - 1, 0);
  fields->AllowOnly({"action", "link", "id"});
  if (id && maker.link.empty() != (*id == 0)) {
    fields->Expected("link", "a link and the ID of a robot, or neither");
  }
  maker.id = static_cast<uint8_t>(id.value_or(0));
  return {maker};
}

Response ReadSymbols(const control::Control& control, Parameters* fields) {
  const auto first = fields->Integer("first", 0, kMostWord, 0);
  fields->AllowOnly({"first"});
  if (fields->problem()) {
    return Refuse(400, *fields->problem());
  }
  const control::SymbolPage page = control.GetSymbols(static_cast<size_t>(*first));
  json::array rows;
  for (size_t i = 0; i < page.rows.size(); ++i) {
    const tags::Row& row = page.rows[i];
    const tags::Maker& maker = page.makers[i];
    rows.push_back(
        json::object{{"kind", tags::NameOf(row.kind)},
                     {"robot", row.robot},
                     {"number", row.number},
                     {"text", row.text},
                     {"link", maker.is_robot() ? json::value(maker.link) : json::value(nullptr)},
                     {"id", maker.is_robot() ? json::value(maker.id) : json::value(nullptr)}});
  }
  const size_t end = static_cast<size_t>(*first) + page.rows.size();
  return {.body = ToText(
              json::object{{"rows", std::move(rows)},
                           {"total", page.total},
                           {"next", end < page.total ? json::value(end) : json::value(nullptr)}})};
}

void ChangeTags(control::Control* control, Parameters* fields, Respond respond) {
  TagsChanged change;
  const auto action = fields->String("action");
  if (action == "define") {
    ReadRow(fields, &change.change.emplace<TagsChanged::Define>().row);
  } else if (action == "erase") {
    change.change = ReadErase(*control, fields);
  } else if (action == "write") {
    change.change = ReadWrite(*control, fields);
  } else if (action == "forget") {
    change.change = ReadForget(fields);
  } else if (action) {
    fields->Expected("action", "one of write, erase, define, forget");
  }
  if (Refused(*fields, respond)) {
    return;
  }
  control->ChangeTags(change, Report(std::move(respond)));
}

}  // namespace pheromone::web
