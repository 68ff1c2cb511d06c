#include "server/formats/rdf/lexical.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "server/base/format.h"
#include "server/base/utf8.h"
#include "server/core/tags/symbols.h"

namespace pheromone::tags {
namespace {

constexpr int64_t kSecondsADay = 86'400;

// Removes the digits at the beginning.
std::string_view TakeDigits(std::string_view* text) {
  size_t count = 0;
  while (count < text->size() && IsDigit((*text)[count])) {
    ++count;
  }
  const std::string_view digits = text->substr(0, count);
  text->remove_prefix(count);
  return digits;
}

bool Take(std::string_view* text, char c) {
  if (text->empty() || text->front() != c) {
    return false;
  }
  text->remove_prefix(1);
  return true;
}

// Removes exactly two digits; empty unless their number is at most `most`.
std::optional<int32_t> TakeTwo(std::string_view* text, int32_t most) {
  if (text->size() < 2 || !IsDigit((*text)[0]) || !IsDigit((*text)[1])) {
    return std::nullopt;
  }
  const int32_t number = ((*text)[0] - '0') * 10 + ((*text)[1] - '0');
  text->remove_prefix(2);
  return number <= most ? std::optional(number) : std::nullopt;
}

void AppendPadded(int64_t number, size_t width, std::string* text) {
  const std::string digits = std::to_string(number);
  text->append(width - std::min(width, digits.size()), '0').append(digits);
}

// The calendar repeats every 400 years, of 146097 days; years begin in March, so that the leap day
// is the last.
constexpr int64_t kDaysOfEra = 146'097;
constexpr int64_t kDaysToEpoch = 719'468;  // from 0000-03-01 to 1970-01-01

int64_t DaysOf(int64_t year, int64_t month, int64_t day) {
  year -= month <= 2 ? 1 : 0;
  const int64_t era = (year >= 0 ? year : year - 399) / 400;
  const int64_t year_of_era = year - era * 400;
  const int64_t day_of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
  const int64_t day_of_era = year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
  return era * kDaysOfEra + day_of_era - kDaysToEpoch;
}

bool IsLeapYear(int64_t year) {
  return (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
}

int32_t DaysOfMonth(int64_t year, int32_t month) {
  constexpr std::array<int32_t, 12> kDays = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  return kDays[static_cast<size_t>(month - 1)] + (month == 2 && IsLeapYear(year) ? 1 : 0);
}

// Removes a date; the days may be beyond 32 bits.
std::optional<int64_t> TakeDate(std::string_view* text) {
  const bool is_negative = Take(text, '-');
  const std::string_view digits = TakeDigits(text);
  constexpr size_t kMostDigits = 9;
  if (digits.size() < 4 || digits.size() > kMostDigits ||
      (digits.size() > 4 && digits.front() == '0')) {
    return std::nullopt;
  }
  int64_t year = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), year);
  if (is_negative && year == 0) {
    return std::nullopt;
  }
  year = is_negative ? -year : year;
  if (!Take(text, '-')) {
    return std::nullopt;
  }
  const std::optional<int32_t> month = TakeTwo(text, 12);
  if (!month || *month == 0 || !Take(text, '-')) {
    return std::nullopt;
  }
  const std::optional<int32_t> day = TakeTwo(text, DaysOfMonth(year, *month));
  return day && *day > 0 ? std::optional(DaysOf(year, *month, *day)) : std::nullopt;
}

// Removes hh:mm:ss and a fraction of at most three digits that count.
std::optional<int32_t> TakeTime(std::string_view* text) {
  const std::optional<int32_t> hours = TakeTwo(text, 23);
  if (!hours || !Take(text, ':')) {
    return std::nullopt;
  }
  const std::optional<int32_t> minutes = TakeTwo(text, 59);
  if (!minutes || !Take(text, ':')) {
    return std::nullopt;
  }
  const std::optional<int32_t> seconds = TakeTwo(text, 59);
  if (!seconds) {
    return std::nullopt;
  }
  int32_t fraction_ms = 0;
  if (Take(text, '.')) {
    const std::string_view digits = TakeDigits(text);
    if (digits.empty()) {
      return std::nullopt;
    }
    int32_t unit_ms = 100;
    for (const char digit : digits) {
      if (unit_ms == 0 && digit != '0') {
        return std::nullopt;
      }
      fraction_ms += unit_ms * (digit - '0');
      unit_ms /= 10;
    }
  }
  return ((*hours * 60 + *minutes) * 60 + *seconds) * 1000 + fraction_ms;
}

// Whether it is a number as XML Schema has it, but for INF and NaN.
bool IsDecimalNumber(std::string_view text) {
  if (!Take(&text, '-')) {
    Take(&text, '+');
  }
  const size_t whole = TakeDigits(&text).size();
  const size_t fraction = Take(&text, '.') ? TakeDigits(&text).size() : 0;
  if (whole + fraction == 0) {
    return false;
  }
  if (Take(&text, 'e') || Take(&text, 'E')) {
    if (!Take(&text, '-')) {
      Take(&text, '+');
    }
    return !TakeDigits(&text).empty() && text.empty();
  }
  return text.empty();
}

std::string ToUtf8(uint32_t scalar) {
  const auto tail = [&](unsigned shift) {
    return static_cast<char>(0x80u | ((scalar >> shift) & 0x3Fu));
  };
  if (scalar < 0x80) {
    return {static_cast<char>(scalar)};
  }
  if (scalar < 0x800) {
    return {static_cast<char>(0xC0u | (scalar >> 6)), tail(0)};
  }
  if (scalar < 0x10000) {
    return {static_cast<char>(0xE0u | (scalar >> 12)), tail(6), tail(0)};
  }
  return {static_cast<char>(0xF0u | (scalar >> 18)), tail(12), tail(6), tail(0)};
}

bool NeedsNumber(uint32_t scalar) {
  return scalar < 0x20 || (scalar >= 0x7F && scalar < 0xA0) || scalar == 0xFFFE || scalar == 0xFFFF;
}

}  // namespace

std::optional<int32_t> ParseInt(std::string_view text) {
  if (Take(&text, '+') && !text.empty() && text.front() == '-') {
    return std::nullopt;
  }
  int32_t number = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && rest == end ? std::optional(number) : std::nullopt;
}

std::string FloatText(int32_t bits) {
  const auto number = std::bit_cast<float>(bits);
  if (std::isnan(number)) {
    return "NaN";
  }
  if (std::isinf(number)) {
    return number < 0 ? "-INF" : "INF";
  }
  return ShortestText(number);
}

std::optional<int32_t> ParseFloat(std::string_view text) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  if (text == "NaN") {
    return std::bit_cast<int32_t>(std::numeric_limits<float>::quiet_NaN());
  }
  if (text == "INF" || text == "+INF" || text == "-INF") {
    return std::bit_cast<int32_t>(text.front() == '-' ? -kInfinity : kInfinity);
  }
  if (!IsDecimalNumber(text)) {
    return std::nullopt;
  }
  Take(&text, '+');
  float number = 0;
  const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
  return result.ec == std::errc() ? std::optional(std::bit_cast<int32_t>(number)) : std::nullopt;
}

std::optional<int32_t> ParseDoubleAsFloat(std::string_view text) {
  const std::optional<int32_t> bits = ParseFloat(text);
  if (!bits || !std::isfinite(std::bit_cast<float>(*bits))) {
    return bits;
  }
  const auto number = [](std::string_view digits) {
    Take(&digits, '+');
    double value = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return value;
  };
  return number(text) == number(FloatText(*bits)) ? bits : std::nullopt;
}

std::optional<int32_t> ParseWholeDecimal(std::string_view text) {
  const size_t point = std::min(text.find('.'), text.size());
  const std::string_view fraction = text.substr(std::min(point + 1, text.size()));
  return fraction.find_first_not_of('0') == std::string_view::npos ? ParseInt(text.substr(0, point))
                                                                   : std::nullopt;
}

std::optional<int32_t> ParseBoolean(std::string_view text) {
  return text == "true" || text == "1"    ? std::optional(1)
         : text == "false" || text == "0" ? std::optional(0)
                                          : std::nullopt;
}

std::string DateTimeText(uint32_t utc_s) {
  return DateText(static_cast<int32_t>(utc_s / kSecondsADay)) + "T" +
         TimeText(static_cast<int32_t>(utc_s % kSecondsADay * 1000)) + "Z";
}

std::optional<uint32_t> ParseDateTime(std::string_view text) {
  const std::optional<int64_t> days = TakeDate(&text);
  if (!days || !Take(&text, 'T')) {
    return std::nullopt;
  }
  const std::optional<int32_t> time_ms = TakeTime(&text);
  if (!time_ms || *time_ms % 1000 != 0) {
    return std::nullopt;
  }
  int64_t utc_s = *days * kSecondsADay + *time_ms / 1000;
  if (!Take(&text, 'Z')) {
    const bool is_west = Take(&text, '-');
    if (!is_west && !Take(&text, '+')) {
      return std::nullopt;
    }
    const std::optional<int32_t> hours = TakeTwo(&text, 14);
    if (!hours || !Take(&text, ':')) {
      return std::nullopt;
    }
    const std::optional<int32_t> minutes = TakeTwo(&text, *hours == 14 ? 0 : 59);
    if (!minutes) {
      return std::nullopt;
    }
    const int64_t offset_s = (int64_t{*hours} * 60 + *minutes) * 60;
    utc_s += is_west ? offset_s : -offset_s;
  }
  const bool fits = utc_s >= 0 && utc_s <= int64_t{0xFFFFFFFF};
  return text.empty() && fits ? std::optional(static_cast<uint32_t>(utc_s)) : std::nullopt;
}

std::string DateText(int32_t days) {
  const int64_t shifted = days + kDaysToEpoch;
  const int64_t era = (shifted >= 0 ? shifted : shifted - (kDaysOfEra - 1)) / kDaysOfEra;
  const int64_t day_of_era = shifted - era * kDaysOfEra;
  const int64_t year_of_era =
      (day_of_era - day_of_era / 1460 + day_of_era / 36'524 - day_of_era / 146'096) / 365;
  const int64_t day_of_year =
      day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
  const int64_t march_month = (5 * day_of_year + 2) / 153;
  const int64_t day = day_of_year - (153 * march_month + 2) / 5 + 1;
  const int64_t month = march_month < 10 ? march_month + 3 : march_month - 9;
  const int64_t year = year_of_era + era * 400 + (month <= 2 ? 1 : 0);
  std::string text = year < 0 ? "-" : "";
  AppendPadded(year < 0 ? -year : year, 4, &text);
  text += '-';
  AppendPadded(month, 2, &text);
  text += '-';
  AppendPadded(day, 2, &text);
  return text;
}

std::optional<int32_t> ParseDate(std::string_view text) {
  const std::optional<int64_t> days = TakeDate(&text);
  using Limits = std::numeric_limits<int32_t>;
  const bool fits = days && *days >= Limits::min() && *days <= Limits::max();
  return fits && text.empty() ? std::optional(static_cast<int32_t>(*days)) : std::nullopt;
}

std::string TimeText(int32_t time_ms) {
  std::string text;
  AppendPadded(time_ms / 3'600'000, 2, &text);
  text += ':';
  AppendPadded(time_ms / 60'000 % 60, 2, &text);
  text += ':';
  AppendPadded(time_ms / 1000 % 60, 2, &text);
  if (time_ms % 1000 != 0) {
    text += '.';
    AppendPadded(time_ms % 1000, 3, &text);
  }
  return text;
}

std::optional<int32_t> ParseTime(std::string_view text) {
  const std::optional<int32_t> time_ms = TakeTime(&text);
  return text.empty() ? time_ms : std::nullopt;
}

std::string CharText(int32_t scalar) {
  const auto code = static_cast<uint32_t>(scalar);
  if (!NeedsNumber(code)) {
    return ToUtf8(code);
  }
  constexpr char kDigits[] = "0123456789ABCDEF";
  return {'U',
          '+',
          kDigits[code >> 12],
          kDigits[(code >> 8) & 15],
          kDigits[(code >> 4) & 15],
          kDigits[code & 15]};
}

std::optional<int32_t> ParseChar(std::string_view text) {
  if (text.size() >= 6 && text.size() <= 8 && text.substr(0, 2) == "U+") {
    uint32_t code = 0;
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data() + 2, end, code, 16);
    const bool is_scalar = code <= 0x10FFFF && (code < 0xD800 || code > 0xDFFF);
    return error == std::errc() && rest == end && is_scalar
               ? std::optional(static_cast<int32_t>(code))
               : std::nullopt;
  }
  if (text.empty() || text.size() > 4 || !IsPlainUtf8(text)) {
    return std::nullopt;
  }
  const Utf8Character it = FirstCharacter(text);
  return it.bytes == text.size() ? std::optional(static_cast<int32_t>(it.code_point))
                                 : std::nullopt;
}

bool IsXmlText(std::string_view text) {
  return text.find("\xEF\xBF\xBE") == std::string_view::npos &&
         text.find("\xEF\xBF\xBF") == std::string_view::npos;
}

}  // namespace pheromone::tags
