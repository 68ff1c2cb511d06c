// Numbers and times as text: the same everywhere.
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <string>

namespace pheromone {

/// The shortest text that reads back as the same number; of small and large ones with an exponent.
template <typename Number>
std::string ShortestText(Number number) {
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr};
}

/// The same for people: without an exponent, unless it is very small or very large.
inline std::string FormatNumber(double number) {
  const double size = std::abs(number);
  if (size != 0 && !(size >= 1e-12 && size < 1e15)) {
    return ShortestText(number);
  }
  std::array<char, 64> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number,
                                       std::chars_format::fixed)
                             .ptr};
}

/// 16 hex digits.
inline std::string HexText(uint64_t number) {
  std::string text(16, '0');
  for (size_t i = text.size(); number != 0; number >>= 4) {
    text[--i] = "0123456789abcdef"[number & 0xF];
  }
  return text;
}

/// "2026-11-22T11:00:00Z", or as strftime's `format` has it.
inline std::string UtcText(int64_t utc_s, const char* format = "%Y-%m-%dT%H:%M:%SZ") {
  const auto seconds = static_cast<std::time_t>(utc_s);
  std::tm parts{};
  std::array<char, 40> text{};
  return gmtime_r(&seconds, &parts) != nullptr &&
                 std::strftime(text.data(), text.size(), format, &parts) != 0
             ? text.data()
             : "an unknown time";
}

/// "2026-11-22T11:00:00.005Z", from milliseconds since 1970, not negative.
inline std::string UtcMsText(int64_t utc_ms) {
  return UtcText(utc_ms / 1000, "%Y-%m-%dT%H:%M:%S.") +
         std::to_string(1000 + utc_ms % 1000).substr(1) + 'Z';
}

}  // namespace pheromone
