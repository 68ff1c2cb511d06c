#include "client_fw/lab/scenario/tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <optional>

#include "server/base/format.h"

namespace pheromone::lab {
namespace {

using config::Value;
using Kind = config::Value::Kind;

bool IsArrayOfTables(const Value& value) {
  return value.kind == Kind::kArray && !value.items.empty() &&
         value.items.front().kind == Kind::kTable;
}

// A table [[name]], which has no defaults.
bool IsOneOfMany(std::string_view name) {
  constexpr std::string_view kNames[] = {"event",  "path", "pheromone", "print",
                                         "robots", "site", "wall"};
  return std::find(std::begin(kNames), std::end(kNames), name) != std::end(kNames);
}

Value* Entry(std::string_view name, Value* table) {
  for (Value& item : table->items) {
    if (item.key == name) {
      return &item;
    }
  }
  return nullptr;
}

// "robots[2]": the name, and 2.
struct Segment {
  std::string_view name;
  std::optional<size_t> number;
};

std::optional<Segment> SegmentOf(std::string_view text) {
  const size_t bracket = text.find('[');
  if (bracket == std::string_view::npos) {
    return text.empty() ? std::nullopt : std::optional(Segment{text, {}});
  }
  size_t number = 0;
  const char* const end = text.data() + text.size() - 1;
  const auto [read, error] = std::from_chars(text.data() + bracket + 1, end, number);
  if (text.back() != ']' || read != end || error != std::errc() || number == 0 || bracket == 0) {
    return std::nullopt;
  }
  return Segment{text.substr(0, bracket), number};
}

// The table that a segment of a key leads to: one that is not there has all defaults.
Result<Value*> Descend(std::string_view key, const Segment& segment, Value* table) {
  Value* entry = Entry(segment.name, table);
  if (entry != nullptr && IsArrayOfTables(*entry)) {
    const size_t count = entry->items.size();
    if (!segment.number && count != 1) {
      return Error{
          fmt::format("--set {}: found {} tables [[{}]], expected {}[N], with N from 1 to "
                      "{}",
                      key, count, segment.name, segment.name, count)};
    }
    const size_t number = segment.number.value_or(1);
    if (number > count) {
      return Error{fmt::format("--set {}: found {} tables [[{}]], expected a number from 1 to {}",
                               key, count, segment.name, count)};
    }
    return &entry->items[number - 1];
  }
  if (entry == nullptr && !segment.number && !IsOneOfMany(segment.name)) {
    Value made;
    made.kind = Kind::kTable;
    made.key = segment.name;
    made.at = made.key_at = table->at;
    table->items.push_back(std::move(made));
    return &table->items.back();
  }
  if (entry == nullptr || entry->kind != Kind::kTable || segment.number) {
    return Error{fmt::format("--set {}: the scenario has no table {}", key,
                             segment.number ? fmt::format("{}[{}]", segment.name, *segment.number)
                                            : std::string(segment.name))};
  }
  return entry;
}

// All that is set is at the place that it replaces.
void Place(config::Position at, Value* value) {
  value->at = value->key_at = at;
  for (Value& item : value->items) {
    Place(at, &item);
  }
}

Value ValueOf(std::string_view text) {
  Result<Value> parsed = config::ParseDocument("value = " + std::string(text), "--set");
  if (parsed.ok() && parsed.value().items.size() == 1) {
    return std::move(parsed.value().items.front());
  }
  Value value;
  value.kind = Kind::kString;
  value.text = text;
  return value;
}

void FlattenInto(const Value& value, const std::string& key, KeyValues* to) {
  if (value.kind == Kind::kTable) {
    for (const Value& item : value.items) {
      FlattenInto(item, key.empty() ? item.key : key + '.' + item.key, to);
    }
  } else if (IsArrayOfTables(value)) {
    for (size_t i = 0; i < value.items.size(); ++i) {
      FlattenInto(value.items[i], fmt::format("{}[{}]", key, i + 1), to);
    }
  } else {
    to->emplace_back(key, value.kind == Kind::kString ? value.text : TomlOf(value));
  }
}

}  // namespace

Status SetValue(std::string_view key, std::string_view text, Value* tree) {
  std::string_view rest = key;
  Value* table = tree;
  while (true) {
    const size_t dot = rest.find('.');
    const std::optional<Segment> segment = SegmentOf(rest.substr(0, dot));
    if (!segment || (dot == std::string_view::npos && segment->number)) {
      return Error{fmt::format("--set {}: expected KEY=VALUE, such as robots[1].count=20", key)};
    }
    if (dot == std::string_view::npos) {
      Value value = ValueOf(text);
      Value* entry = Entry(segment->name, table);
      const config::Position at = entry != nullptr ? entry->at : table->at;
      Place(at, &value);
      value.key = segment->name;
      if (entry == nullptr) {
        entry = &table->items.emplace_back();
      }
      *entry = std::move(value);
      return Ok();
    }
    PHEROMONE_TRY(table, Descend(key, *segment, table));
    rest.remove_prefix(dot + 1);
  }
}

KeyValues Flatten(const Value& tree) {
  KeyValues flat;
  FlattenInto(tree, "", &flat);
  return flat;
}

std::string TomlOf(const Value& value) {
  const auto list = [&](auto&& each) {
    std::string text;
    for (const Value& item : value.items) {
      text += (text.empty() ? "" : ", ") + each(item);
    }
    return text;
  };
  switch (value.kind) {
    case Kind::kBoolean:
      return value.boolean ? "true" : "false";
    case Kind::kInteger:
      return std::to_string(value.integer);
    case Kind::kFloat:
      return ShortestText(value.number);
    case Kind::kArray:
      return '[' + list([](const Value& item) { return TomlOf(item); }) + ']';
    case Kind::kTable:
      return '{' + list([](const Value& item) { return item.key + " = " + TomlOf(item); }) + '}';
    case Kind::kString:
    case Kind::kTime:
      break;
  }
  std::string quoted = "\"";
  for (const char c : value.text) {
    quoted += (c == '"' || c == '\\' ? "\\" : "") + std::string(1, c);
  }
  return quoted + '"';
}

std::string TomlOfTables(const Value& tree, std::span<const std::string_view> names) {
  std::string text;
  const auto add = [&](const std::string& head, const Value& table) {
    text += (text.empty() ? "" : "\n") + head + '\n';
    for (const Value& item : table.items) {
      text += item.key + " = " + TomlOf(item) + '\n';
    }
  };
  for (const std::string_view name : names) {
    const Value* value = tree.Find(name);
    if (value == nullptr) {
      continue;
    }
    if (IsArrayOfTables(*value)) {
      for (const Value& table : value->items) {
        add(fmt::format("[[{}]]", name), table);
      }
    } else if (value->kind == Kind::kTable) {
      add(fmt::format("[{}]", name), *value);
    }
  }
  return text;
}

}  // namespace pheromone::lab
