#include "server/robots/links/tracker_message.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <span>
#include <system_error>

namespace pheromone::links {
namespace {

constexpr size_t kMaxWords = 7;
constexpr double kMaxM = 1e6;
constexpr double kMaxHeightM = 1e5;
constexpr double kTurnDeg = 360;

// Splits at blanks; words beyond the array are only counted.
size_t Split(std::string_view line, std::array<std::string_view, kMaxWords>* words) {
  constexpr std::string_view kBlanks = " \t";
  size_t count = 0;
  for (size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const size_t end = std::min(line.find_first_of(kBlanks, at), line.size());
    if (count < kMaxWords) {
      (*words)[count] = line.substr(at, end - at);
    }
    ++count;
    at = line.find_first_not_of(kBlanks, end);
  }
  return count;
}

// from_chars also accepts "inf" and "nan": a plain number begins with a digit, a sign or a point.
std::optional<double> PlainNumber(std::string_view word) {
  if (word.find_first_not_of("-.0123456789") != std::string_view::npos) {
    return std::nullopt;
  }
  double value = 0;
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value, std::chars_format::fixed);
  const bool is_number = error == std::errc() && stop == end && std::isfinite(value);
  return is_number ? std::optional(value) : std::nullopt;
}

// Numbers, each within -limit to limit.
std::optional<TrackerFault> Read(std::span<const std::string_view> words,
                                 std::span<const double> limits, std::span<double> values) {
  for (size_t i = 0; i < words.size(); ++i) {
    const std::optional<double> value = PlainNumber(words[i]);
    if (!value) {
      return TrackerFault::kBadNumber;
    }
    if (std::abs(*value) > limits[i]) {
      return TrackerFault::kOutOfRange;
    }
    values[i] = *value;
  }
  return std::nullopt;
}

}  // namespace

std::string_view TextOf(TrackerFault fault) {
  switch (fault) {
    case TrackerFault::kUnknownKind:
      return "unknown message, expected pose or gps";
    case TrackerFault::kWordCount:
      return "wrong number of fields";
    case TrackerFault::kBadId:
      return "invalid robot ID, expected 1 to 254";
    case TrackerFault::kBadNumber:
      return "not a plain decimal number";
    case TrackerFault::kOutOfRange:
      return "number out of range";
    case TrackerFault::kTooManyLines:
      return "too many lines in a datagram";
    case TrackerFault::kUnknownLink:
      return "unknown link";
    case TrackerFault::kNoDatum:
      return "gps, but the map has no datum";
    case TrackerFault::kNoHello:
      return "the robot has not said HELLO";
  }
  return "";
}

std::variant<TrackerLine, TrackerFault> ParseTrackerLine(std::string_view line) {
  std::array<std::string_view, kMaxWords> words;
  const size_t count = Split(line, &words);
  const bool is_gps = words[0] == "gps";
  if (!is_gps && words[0] != "pose") {
    return TrackerFault::kUnknownKind;
  }
  if (count != 6 && !(is_gps && count == 7)) {
    return TrackerFault::kWordCount;
  }
  TrackerLine result;
  result.link = words[1];
  const char* end = words[2].data() + words[2].size();
  const auto [stop, error] = std::from_chars(words[2].data(), end, result.id);
  if (error != std::errc() || stop != end || result.id == 0 || result.id == 255) {
    return TrackerFault::kBadId;
  }
  const std::array<double, 4> limits = is_gps ? std::array{90.0, 180.0, kTurnDeg, kMaxHeightM}
                                              : std::array{kMaxM, kMaxM, kTurnDeg, 0.0};
  std::array<double, 4> value{};
  const auto numbers = std::span(words).subspan(3, count - 3);
  if (const auto fault = Read(numbers, limits, value)) {
    return *fault;
  }
  if (is_gps) {
    result.fix =
        GpsFix{value[0], value[1], value[2], count == 7 ? std::optional(value[3]) : std::nullopt};
  } else {
    result.fix = PoseFix{value[0], value[1], value[2]};
  }
  return result;
}

}  // namespace pheromone::links
