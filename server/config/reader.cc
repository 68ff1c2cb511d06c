#include "server/config/reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "server/base/format.h"
#include "server/core/field/geometry.h"

namespace pheromone::config {
namespace {

constexpr size_t kMaxProblems = 20;

// Levenshtein's distance, one row at a time.
size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

std::string Join(std::span<const std::string_view> words, std::string_view quote) {
  std::string text;
  for (const std::string_view word : words) {
    text.append(text.empty() ? "" : ", ").append(quote).append(word).append(quote);
  }
  return text;
}

}  // namespace

void Problems::Add(Position at, std::string_view key, std::string_view text) {
  problems_.push_back({at, FormatProblem(file_, at, key, text)});
}

std::string Problems::Text() const {
  std::vector<Problem> sorted = problems_;
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Problem& a, const Problem& b) { return a.at < b.at; });
  std::string text;
  for (size_t i = 0; i < std::min(sorted.size(), kMaxProblems); ++i) {
    text += (i == 0 ? "" : "\n") + sorted[i].line;
  }
  if (sorted.size() > kMaxProblems) {
    text += "\n" + file_ + ": and " + std::to_string(sorted.size() - kMaxProblems) + " more";
  }
  return text;
}

void TableReader::AllowOnly(std::span<const std::string_view> known) const {
  const std::span<const std::string_view> words(known.begin(), known.size());
  for (const Value& entry : table_.items) {
    if (std::find(words.begin(), words.end(), entry.key) != words.end()) {
      continue;
    }
    const std::string_view nearest = Nearest(entry.key, words);
    std::string text = "unknown key, expected ";
    if (nearest.empty()) {
      text += "one of " + Join(words, "");
    } else {
      text.append(nearest).append("?");
    }
    problems_->Add(entry.key_at, path_.empty() ? entry.key : KeyOf(entry.key), text);
  }
}

bool TableReader::Without(std::initializer_list<std::string_view> keys, std::string_view choice,
                          std::string_view expected) const {
  bool good = true;
  for (const std::string_view key : keys) {
    if (const Value* entry = Find(key)) {
      std::string text = "not permitted with ";
      text.append(choice).append(", expected ").append(expected);
      problems_->Add(entry->key_at, KeyOf(key), text);
      good = false;
    }
  }
  return good;
}

std::optional<int64_t> TableReader::Scaled(std::string_view key, Scale scale, int64_t least,
                                           int64_t most, std::optional<int64_t> fallback) const {
  if (const Value* value = Find(key)) {
    return ScaledValue(*value, key, scale, least, most);
  }
  if (!fallback) {
    Missing(key,
            "a number from " + FormatScaled(least, scale) + " to " + FormatScaled(most, scale));
  }
  return fallback;
}

std::optional<int64_t> TableReader::ScaledValue(const Value& value, std::string_view key,
                                                Scale scale, int64_t least, int64_t most) const {
  const std::string range = FormatScaled(least, scale) + " to " + FormatScaled(most, scale);
  const bool is_number = value.kind == Value::Kind::kInteger || value.kind == Value::Kind::kFloat;
  if (!is_number || !std::isfinite(value.number)) {
    Expected(key, value, "a number from " + range);
    return std::nullopt;
  }
  const double scaled = value.number * static_cast<double>(scale.factor);
  const double whole = std::round(scaled);
  // A decimal fraction is not exact in binary: allow only for the last bits.
  const double rounding = 1e-6 + 4 * std::numeric_limits<double>::epsilon() * std::abs(scaled);
  if (!std::isfinite(scaled) || scaled < static_cast<double>(least) - rounding ||
      scaled > static_cast<double>(most) + rounding) {
    Expected(key, value, "a number from " + range);
    return std::nullopt;
  }
  if (std::abs(scaled - whole) > rounding) {
    Expected(key, value, "a multiple of " + FormatScaled(1, scale));
    return std::nullopt;
  }
  return std::clamp(static_cast<int64_t>(whole), least, most);
}

std::optional<int64_t> TableReader::Integer(std::string_view key, int64_t least, int64_t most,
                                            std::optional<int64_t> fallback) const {
  const std::string expected =
      "a whole number from " + std::to_string(least) + " to " + std::to_string(most);
  const Value* value = Find(key);
  if (value == nullptr) {
    if (!fallback) {
      Missing(key, expected);
    }
    return fallback;
  }
  if (value->kind != Value::Kind::kInteger || value->integer < least || value->integer > most) {
    Expected(key, *value, expected);
    return std::nullopt;
  }
  return value->integer;
}

std::optional<double> TableReader::Number(std::string_view key, double least, double most,
                                          std::optional<double> fallback) const {
  const std::string expected = "a number from " + FormatNumber(least) + " to " + FormatNumber(most);
  const Value* value = Find(key);
  if (value == nullptr) {
    if (!fallback) {
      Missing(key, expected);
    }
    return fallback;
  }
  const bool is_number = value->kind == Value::Kind::kInteger || value->kind == Value::Kind::kFloat;
  if (!is_number || !(value->number >= least && value->number <= most)) {
    Expected(key, *value, expected);
    return std::nullopt;
  }
  return value->number;
}

std::optional<TableReader> TableReader::Table(std::string_view key,
                                              std::string_view expected) const {
  const Value* value = Find(key);
  if (value == nullptr) {
    Missing(key, expected);
    return std::nullopt;
  }
  if (value->kind != Value::Kind::kTable) {
    Expected(key, *value, expected);
    return std::nullopt;
  }
  return Inside(*value, key);
}

std::optional<bool> TableReader::Boolean(std::string_view key, bool fallback) const {
  const Value* value = Find(key);
  if (value != nullptr && value->kind != Value::Kind::kBoolean) {
    Expected(key, *value, "true or false");
    return std::nullopt;
  }
  return value != nullptr ? value->boolean : fallback;
}

std::optional<std::string> TableReader::String(std::string_view key,
                                               std::optional<std::string> fallback) const {
  const Value* value = Find(key);
  if (value == nullptr) {
    if (!fallback) {
      Missing(key, "a string");
    }
    return fallback;
  }
  if (value->kind != Value::Kind::kString || value->text.empty()) {
    Expected(key, *value, "a string that is not empty");
    return std::nullopt;
  }
  return value->text;
}

std::optional<size_t> TableReader::OneOf(std::string_view key,
                                         std::span<const std::string_view> words,
                                         std::optional<size_t> fallback) const {
  const std::string expected = "one of " + Join(words, "\"");
  const Value* value = Find(key);
  if (value == nullptr) {
    if (!fallback) {
      Missing(key, expected);
    }
    return fallback;
  }
  const auto found = std::find(words.begin(), words.end(), value->text);
  if (value->kind != Value::Kind::kString || found == words.end()) {
    Expected(key, *value, expected);
    return std::nullopt;
  }
  return static_cast<size_t>(found - words.begin());
}

void TableReader::Report(std::string_view key, std::string_view text) const {
  const Value* value = Find(key);
  problems_->Add(value != nullptr ? value->at : table_.at, KeyOf(key), text);
}

void TableReader::Expected(std::string_view key, const Value& found,
                           std::string_view expected) const {
  problems_->Add(found.at, KeyOf(key),
                 "found " + found.Describe() + ", expected " + std::string(expected));
}

void TableReader::Missing(std::string_view key, std::string_view expected) const {
  problems_->Add(table_.at, KeyOf(key), "missing, expected " + std::string(expected));
}

uint16_t ToBinaryAngle(int64_t microdegrees) {
  // 65 536 / 360 000 000 in lowest terms.
  return static_cast<uint16_t>(field::RoundDiv(microdegrees * 256, 1'406'250));
}

std::string_view Nearest(std::string_view word, std::span<const std::string_view> known) {
  std::string_view best;
  // Of three letters, one may be wrong: "map" is no better for "tag" than a list is.
  size_t best_distance = std::max<size_t>(word.size() <= 3 ? 1 : 2, word.size() / 3) + 1;
  for (const std::string_view candidate : known) {
    // So is a part of a key, "width" for "width_m", or one that goes on: "baudrate" for "baud".
    const size_t both = std::min(word.size(), candidate.size());
    const bool begins = both >= 3 && candidate.substr(0, both) == word.substr(0, both);
    const size_t distance = begins ? 1 : EditDistance(word, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string FormatScaled(int64_t number, Scale scale) {
  return FormatNumber(static_cast<double>(number) / static_cast<double>(scale.factor));
}

}  // namespace pheromone::config
