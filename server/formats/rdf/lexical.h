// The values in blocks as text, in the lexical forms of XML Schema datatypes (W3C XML Schema
// Definition Language 1.1 Part 2, section 3.3).
//
//   FloatText(value);                       // "0.1", "1e+10", "-0", "INF", "NaN"
//   ParseDate("2008-02-29");                // days since 1970-01-01; empty: not a date
//
// Values are those of the fields of a Term (block.h). Reading is strict: no white space, no value
// outside of its type's range, no date that the calendar does not have.
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace pheromone::tags {

constexpr bool IsDigit(char c) {
  return c >= '0' && c <= '9';
}
/// Of ASCII.
constexpr bool IsLetter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

/// Decimal digits with an optional sign, of 32 bits.
std::optional<int32_t> ParseInt(std::string_view text);

/// The shortest text that reads back as the same number. RDF has one NaN: its payload is lost.
std::string FloatText(int32_t bits);
/// Rounds to the nearest binary32; empty if that overflows or underflows.
std::optional<int32_t> ParseFloat(std::string_view text);

/// Of an xsd:double: only if the shortest text of the binary32 is the same double again, such as
/// "0.1", but not "3.141592653589793".
std::optional<int32_t> ParseDoubleAsFloat(std::string_view text);
/// Of an xsd:decimal without a fraction, such as "244" or "244.0", of 32 bits.
std::optional<int32_t> ParseWholeDecimal(std::string_view text);
/// "true" and "1" are 1, "false" and "0" are 0.
std::optional<int32_t> ParseBoolean(std::string_view text);

/// "2006-01-28T14:20:00Z".
std::string DateTimeText(uint32_t utc_s);
/// Whole seconds with a time zone, Z or +hh:mm, from 1970 to 2106.
std::optional<uint32_t> ParseDateTime(std::string_view text);

/// "2006-01-28": proleptic Gregorian calendar, in which the year 0000 precedes 0001; beyond 9999
/// with more digits.
std::string DateText(int32_t days);
std::optional<int32_t> ParseDate(std::string_view text);

/// "14:20:00", or "14:20:00.250".
std::string TimeText(int32_t time_ms);
std::optional<int32_t> ParseTime(std::string_view text);

/// The character itself in UTF-8, or "U+000A" for those that XML does not have and for control
/// characters.
std::string CharText(int32_t scalar);
std::optional<int32_t> ParseChar(std::string_view text);

/// Whether XML 1.0 can represent a text that IsPlainUtf8 accepts: neither U+FFFE nor U+FFFF.
bool IsXmlText(std::string_view text);

}  // namespace pheromone::tags
