#include "server/config/document.h"

#include <toml++/toml.h>

#include <algorithm>

#include "server/base/format.h"
#include "server/base/message.h"

namespace pheromone::config {
namespace {

// The library takes a tree apart recursively; a line of this length cannot exhaust the stack.
constexpr size_t kMaxLine = size_t{16} << 10;
constexpr int kMaxDepth = 8;

Position ToPosition(const toml::source_region& source) {
  return {source.begin.line, source.begin.column};
}

// False if the tree is deeper than any configuration, `at` then saying where.
bool Convert(const toml::node& from, int depth, Value* to, Position* at) {
  to->at = ToPosition(from.source());
  if (depth > kMaxDepth) {
    *at = to->at;
    return false;
  }
  if (const auto* table = from.as_table()) {
    to->kind = Value::Kind::kTable;
    for (const auto& [key, node] : *table) {
      Value& entry = to->items.emplace_back();
      entry.key = key.str();
      entry.key_at = ToPosition(key.source());
      if (!Convert(node, depth + 1, &entry, at)) {
        return false;
      }
    }
  } else if (const auto* array = from.as_array()) {
    to->kind = Value::Kind::kArray;
    for (const toml::node& node : *array) {
      if (!Convert(node, depth + 1, &to->items.emplace_back(), at)) {
        return false;
      }
    }
  } else if (const auto* text = from.as_string()) {
    to->kind = Value::Kind::kString;
    to->text = text->get();
  } else if (const auto* integer = from.as_integer()) {
    to->kind = Value::Kind::kInteger;
    to->integer = integer->get();
    to->number = static_cast<double>(to->integer);
  } else if (const auto* number = from.as_floating_point()) {
    to->kind = Value::Kind::kFloat;
    to->number = number->get();
  } else if (const auto* boolean = from.as_boolean()) {
    to->kind = Value::Kind::kBoolean;
    to->boolean = boolean->get();
  } else {
    to->kind = Value::Kind::kTime;
  }
  return true;
}

// The line that is too long, counted from 1, or 0.
uint32_t LongLine(std::string_view text) {
  uint32_t line = 1;
  size_t begin = 0;
  while (begin < text.size()) {
    const size_t end = std::min(text.find('\n', begin), text.size());
    if (end - begin > kMaxLine) {
      return line;
    }
    begin = end + 1;
    ++line;
  }
  return 0;
}

// Text quoted from the file is shortened and made printable, so that a message is one short line.
std::string Printable(std::string_view text, size_t most) {
  std::string printable;
  for (const char c : text.substr(0, most)) {
    const bool control = static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
    printable += control ? ' ' : c;
  }
  return text.size() > most ? printable + "..." : printable;
}

// Such as a point: shown as it is.
bool IsShortRow(const std::vector<Value>& items) {
  constexpr size_t kMaxInRow = 4;
  return !items.empty() && items.size() <= kMaxInRow &&
         std::all_of(items.begin(), items.end(), [](const Value& item) {
           return item.kind == Value::Kind::kInteger || item.kind == Value::Kind::kFloat;
         });
}

std::string RowOf(const std::vector<Value>& items) {
  std::string row;
  for (const Value& item : items) {
    row += (row.empty() ? "[" : ", ") + item.Describe();
  }
  return row + ']';
}

}  // namespace

const Value* Value::Find(std::string_view name) const {
  for (const Value& item : items) {
    if (kind == Kind::kTable && item.key == name) {
      return &item;
    }
  }
  return nullptr;
}

std::string Value::Describe() const {
  switch (kind) {
    case Kind::kBoolean:
      return boolean ? "true" : "false";
    case Kind::kInteger:
      return std::to_string(integer);
    case Kind::kFloat:
      return FormatNumber(number);
    case Kind::kString:
      return "the string \"" + Printable(text, 60) + '"';
    case Kind::kTime:
      return "a date or time";
    case Kind::kArray:
      return IsShortRow(items) ? RowOf(items) : "an array of " + std::to_string(items.size());
    case Kind::kTable:
      break;
  }
  return "a table";
}

Result<Value> ParseDocument(std::string_view text, std::string_view name) {
  const auto fail = [name](Position at, std::string_view what) {
    return Error{FormatProblem(name, at, "syntax", what)};
  };
  if (text.size() > kMaxText) {
    return fail({1, 1}, "the file is larger than 1 MiB");
  }
  if (const Status utf8 = SkipByteOrderMark(&text); !utf8.ok()) {
    return fail({1, 1}, utf8.error());
  }
  if (const uint32_t line = LongLine(text); line != 0) {
    return fail({line, 1}, "the line is longer than 16384 bytes");
  }
  try {
    const toml::table table = toml::parse(text);
    Value root;
    if (Position deep; !Convert(table, 0, &root, &deep)) {
      return fail(deep, "tables and arrays are nested too deeply");
    }
    return root;
  } catch (const toml::parse_error& error) {
    return fail(ToPosition(error.source()), error.description());
  } catch (const std::exception& error) {
    return fail({1, 1}, error.what());
  }
}

std::string FormatProblem(std::string_view name, Position at, std::string_view key,
                          std::string_view text) {
  std::string line(name);
  line += ':' + std::to_string(at.line) + ':' + std::to_string(at.column) + ": ";
  return line + Printable(key, 80) + ": " + Printable(text, 400);
}

}  // namespace pheromone::config
