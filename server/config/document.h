// A TOML file as a tree of plain values, each with its place in the file. What the TOML library
// throws ends here; the rest of this folder does not know it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/result.h"

namespace pheromone::config {

/// Line and column, counted from 1.
struct Position {
  uint32_t line = 1;
  uint32_t column = 1;
  auto operator<=>(const Position&) const = default;
};

struct Value {
  enum class Kind { kBoolean, kInteger, kFloat, kString, kTime, kArray, kTable };

  Kind kind = Kind::kTable;
  Position at;
  bool boolean = false;
  int64_t integer = 0;
  double number = 0;  ///< of kInteger too
  std::string text;
  std::vector<Value> items;  ///< of an array; of a table, its entries

  std::string key;  ///< of a table's entry
  Position key_at;

  /// A table's entry, or null.
  const Value* Find(std::string_view name) const;

  /// In words, for messages: `the string "trail"`, `0.5`, `a table`.
  std::string Describe() const;
};

constexpr size_t kMaxText = size_t{1} << 20;

/// Parses a TOML document. Errors: `NAME:LINE:COL: syntax: what was expected`, also for a text of
/// more than kMaxText bytes, a line of more than 16 KiB or a nesting that no configuration needs.
Result<Value> ParseDocument(std::string_view text, std::string_view name);

/// `NAME:LINE:COL: KEY: TEXT`
std::string FormatProblem(std::string_view name, Position at, std::string_view key,
                          std::string_view text);

}  // namespace pheromone::config
