// Reading a table key by key. What is wrong is noted, in words that say where, what was found and
// what was expected, and reading goes on: one run finds all mistakes of a file.
//
//   TableReader map(*table, "map", &problems);
//   map.AllowOnly({"width_m", "height_m"});
//   const std::optional<int64_t> width_um = map.Scaled("width_m", kMetresToUm, 1, 1'000'000'000);
//   if (width_um) ...
//
// Every getter returns nothing when it has noted a problem. Quantities become whole numbers of a
// small unit here; a value that is none, such as half a micrometre, is a problem.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/config/document.h"

namespace pheromone::config {

/// The mistakes found in one file.
class Problems {
 public:
  explicit Problems(std::string_view file) : file_(file) {}

  void Add(Position at, std::string_view key, std::string_view text);
  bool empty() const { return problems_.empty(); }

  /// One line each, in the order of the file; the first twenty.
  std::string Text() const;

 private:
  struct Problem {
    Position at;
    std::string line;
  };
  std::string file_;
  std::vector<Problem> problems_;
};

/// How many of the small unit make one of the file's.
struct Scale {
  int64_t factor = 1;
};
constexpr Scale kMetresToUm{1'000'000};
constexpr Scale kMetresToMm{1'000};
constexpr Scale kSecondsToMs{1'000};
constexpr Scale kMillimetresTo10Um{100};
constexpr Scale kToMicro{1'000'000};
constexpr Scale kToMilli{1'000};
constexpr Scale kDegrees{1'000'000};  ///< in millionths of a degree

class TableReader {
 public:
  /// `table` and `problems` outlive the reader. `path` is the key of the table itself, such as
  /// `pheromone[2]`.
  TableReader(const Value& table, std::string path, Problems* problems)
      : table_(table), path_(std::move(path)), problems_(problems) {}

  /// Notes each key that is not among `known`, with the nearest one that is.
  void AllowOnly(std::span<const std::string_view> known) const;
  void AllowOnly(std::initializer_list<std::string_view> known) const {
    AllowOnly(std::span(known.begin(), known.size()));
  }

  /// Notes each of `keys` that is there: it means something, but not beside `choice`, such as
  /// `profile = "cone"`. False if there is one.
  bool Without(std::initializer_list<std::string_view> keys, std::string_view choice,
               std::string_view expected) const;

  /// The whole number of small units, between `least` and `most` (in small units).
  std::optional<int64_t> Scaled(std::string_view key, Scale scale, int64_t least, int64_t most,
                                std::optional<int64_t> fallback = std::nullopt) const;

  std::optional<int64_t> Integer(std::string_view key, int64_t least, int64_t most,
                                 std::optional<int64_t> fallback = std::nullopt) const;
  /// Any number, where no small unit is natural, such as degrees on the Earth.
  std::optional<double> Number(std::string_view key, double least, double most,
                               std::optional<double> fallback = std::nullopt) const;
  std::optional<bool> Boolean(std::string_view key, bool fallback) const;
  std::optional<std::string> String(std::string_view key,
                                    std::optional<std::string> fallback = std::nullopt) const;

  /// The place of a string among `words`.
  std::optional<size_t> OneOf(std::string_view key, std::span<const std::string_view> words,
                              std::optional<size_t> fallback = std::nullopt) const;

  /// The same conversion for a value that is no entry of its own, such as a coordinate.
  std::optional<int64_t> ScaledValue(const Value& value, std::string_view key, Scale scale,
                                     int64_t least, int64_t most) const;

  /// The table that a key holds; `expected` says what belongs there.
  std::optional<TableReader> Table(std::string_view key, std::string_view expected) const;

  /// A reader for a table within this one, such as an item of an array.
  TableReader Inside(const Value& table, std::string_view key) const {
    return {table, KeyOf(key), problems_};
  }

  const Value* Find(std::string_view key) const { return table_.Find(key); }
  Position at() const { return table_.at; }
  const std::string& path() const { return path_; }
  std::string KeyOf(std::string_view key) const { return path_ + '.' + std::string(key); }

  /// Notes a problem with a key, at its value if it has one.
  void Report(std::string_view key, std::string_view text) const;
  void Expected(std::string_view key, const Value& found, std::string_view expected) const;
  void Missing(std::string_view key, std::string_view expected) const;

 private:
  const Value& table_;
  std::string path_;
  Problems* problems_;
};

/// Millionths of a degree as a binary angle, 65 536 a turn; any number of turns.
uint16_t ToBinaryAngle(int64_t microdegrees);

/// The one of `known` that is most like `word`, or empty if none is.
std::string_view Nearest(std::string_view word, std::span<const std::string_view> known);

/// `number` small units in the file's unit.
std::string FormatScaled(int64_t number, Scale scale);

}  // namespace pheromone::config
