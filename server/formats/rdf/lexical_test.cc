#include "server/formats/rdf/lexical.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <string>

#include "server/formats/rdf/iri.h"

namespace pheromone::tags {
namespace {

int32_t BitsOf(float number) {
  return std::bit_cast<int32_t>(number);
}

TEST(LexicalTest, IntsHave32Bits) {
  EXPECT_EQ(ParseInt("-2147483648"), std::numeric_limits<int32_t>::min());
  EXPECT_EQ(ParseInt("+007"), 7);
  for (const char* const wrong : {"", "+", "-", "+-1", "2147483648", "244.5", " 1", "1 ", "0x1"}) {
    EXPECT_EQ(ParseInt(wrong), std::nullopt) << wrong;
  }
}

TEST(LexicalTest, FloatsReadBackBitForBit) {
  EXPECT_EQ(FloatText(BitsOf(0.1F)), "0.1");
  EXPECT_EQ(FloatText(BitsOf(-0.0F)), "-0");
  EXPECT_EQ(FloatText(BitsOf(std::numeric_limits<float>::infinity())), "INF");
  EXPECT_EQ(FloatText(BitsOf(-std::numeric_limits<float>::infinity())), "-INF");
  EXPECT_EQ(FloatText(BitsOf(std::nanf("7"))), "NaN");
  std::mt19937 random(1);
  for (int i = 0; i < 100'000; ++i) {
    const auto bits = static_cast<int32_t>(random());
    const std::string text = FloatText(bits);
    if (text == "NaN") {
      continue;
    }
    ASSERT_EQ(ParseFloat(text), bits) << text;
    if (text.find("INF") == std::string::npos) {
      ASSERT_EQ(BitsOf(std::strtof(text.c_str(), nullptr)), bits) << text;
    }
  }
}

TEST(LexicalTest, FloatsAreAsXmlSchemaHasThem) {
  EXPECT_EQ(ParseFloat("+1.E+2"), BitsOf(100));
  EXPECT_EQ(ParseFloat(".5"), BitsOf(0.5));
  for (const char* const wrong :
       {"", ".", "e5", "1e", "inf", "nan", "-NaN", "0x1p3", "1e99", "1e-99", "1,5", "+-1", "1 "}) {
    EXPECT_EQ(ParseFloat(wrong), std::nullopt) << wrong;
  }
}

TEST(LexicalTest, TimesAreThoseOfTheSystemsCalendar) {
  EXPECT_EQ(DateTimeText(1'138'458'000), "2006-01-28T14:20:00Z");  // date -u -d @1138458000
  EXPECT_EQ(DateTimeText(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(DateTimeText(0xFFFFFFFFu), "2106-02-07T06:28:15Z");
  EXPECT_EQ(ParseDateTime("2006-01-28T14:20:00Z"), 1'138'458'000u);
  EXPECT_EQ(ParseDateTime("2006-01-28T16:20:00.000+02:00"), 1'138'458'000u);
  EXPECT_EQ(ParseDateTime("2006-01-28T08:50:00-05:30"), 1'138'458'000u);
  for (const char* const wrong :
       {"2006-01-28T14:20", "2006-01-28T14:20:00", "2006-01-28", "2006-01-28T24:00:00Z",
        "2006-01-28T14:60:00Z", "2006-01-28T14:20:60Z", "2006-01-28T14:20:00.5Z",
        "1969-12-31T23:59:59Z", "2106-02-07T06:28:16Z", "2006-01-28 14:20:00Z",
        "2006-01-28T14:20:00+15:00", "2006-01-28T14:20:00Zx", "\n2006-01-28T14:20:00Z"}) {
    EXPECT_EQ(ParseDateTime(wrong), std::nullopt) << wrong;
  }
}

// The days of one month after the other, from 1970 on, counted one by one.
TEST(LexicalTest, EachDayOfAThousandYearsIsCounted) {
  int32_t days = 0;
  for (int year = 1970; year < 2970; ++year) {
    const bool is_leap = year % 400 == 0 || (year % 4 == 0 && year % 100 != 0);
    const int months[] = {31, is_leap ? 29 : 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    for (int month = 1; month <= 12; ++month) {
      for (int day = 1; day <= months[month - 1]; ++day, ++days) {
        const std::string text = std::to_string(year) + (month < 10 ? "-0" : "-") +
                                 std::to_string(month) + (day < 10 ? "-0" : "-") +
                                 std::to_string(day);
        ASSERT_EQ(DateText(days), text);
        ASSERT_EQ(ParseDate(text), days);
      }
    }
  }
}

TEST(LexicalTest, DatesReachAsFarAs32BitsOfDays) {
  // Of 400 years with 146097 days each; GNU date agrees on those that it can show.
  EXPECT_EQ(DateText(-719'528), "0000-01-01");
  EXPECT_EQ(DateText(-719'529), "-0001-12-31");
  EXPECT_EQ(DateText(2'932'897), "10000-01-01");
  EXPECT_EQ(DateText(std::numeric_limits<int32_t>::max()), "5881580-07-11");
  EXPECT_EQ(DateText(std::numeric_limits<int32_t>::min()), "-5877641-06-23");
  EXPECT_EQ(ParseDate("5881580-07-11"), std::numeric_limits<int32_t>::max());
  EXPECT_EQ(ParseDate("-5877641-06-23"), std::numeric_limits<int32_t>::min());
  for (const char* const wrong :
       {"5881580-07-12", "-5877641-06-22", "2007-02-29", "1900-02-29", "2006-13-01", "2006-00-01",
        "2006-04-31", "2006-01-00", "06-01-28", "02006-01-28", "-0000-01-01", "2006-1-28",
        "2006-01-28Z", "99999999999-01-01", "2006-01"}) {
    EXPECT_EQ(ParseDate(wrong), std::nullopt) << wrong;
  }
  EXPECT_NE(ParseDate("2000-02-29"), std::nullopt);
}

TEST(LexicalTest, TimesOfDayHaveMilliseconds) {
  EXPECT_EQ(TimeText(51'600'000), "14:20:00");
  EXPECT_EQ(TimeText(86'399'007), "23:59:59.007");
  EXPECT_EQ(ParseTime("14:20:00.5"), 51'600'500);
  EXPECT_EQ(ParseTime("23:59:59.0070"), 86'399'007);
  for (const char* const wrong : {"24:00:00", "14:20", "14:20:00.", "14:20:00.0001", "14:20:00Z"}) {
    EXPECT_EQ(ParseTime(wrong), std::nullopt) << wrong;
  }
}

TEST(LexicalTest, CharactersAreThemselvesOrTheirNumber) {
  EXPECT_EQ(CharText('a'), "a");
  EXPECT_EQ(CharText(0x20AC), "\xE2\x82\xAC");
  EXPECT_EQ(CharText(0), "U+0000");
  EXPECT_EQ(CharText(0xFFFE), "U+FFFE");
  for (int32_t scalar = 0; scalar <= 0x10FFFF; ++scalar) {
    if (scalar < 0xD800 || scalar > 0xDFFF) {
      ASSERT_EQ(ParseChar(CharText(scalar)), scalar);
    }
  }
  for (const char* const wrong : {"", "ab", "\n", "\x80", "U+D800", "U+110000", "U+12", "U+-123"}) {
    EXPECT_EQ(ParseChar(wrong), std::nullopt) << wrong;
  }
}

TEST(IriTest, AnIriIsAbsoluteAndNeedsNoEscapes) {
  for (const char* const good : {"http://example.org/ns#cleaning", "urn:mac:00-11",
                                 "http://e.org/\xC3\xA4", "http://e.org/a%20b?c"}) {
    EXPECT_TRUE(IsIri(good)) << good;
  }
  for (const char* const wrong :
       {"", "cleaning", "http:", ":x", "1a:b", "http://e.org/a b", "http://e.org/<",
        "http://e.org/%2", "http://e.org/#a#b", "http://e.org/../a", "http://e.org/.",
        "urn:\xEF\xBF\xBE", "urn:\xFF", "ur n:a"}) {
    EXPECT_FALSE(IsIri(wrong)) << wrong;
  }
}

TEST(IriTest, ItIsSplitAfterTheLastSeparator) {
  EXPECT_EQ(SplitOf("http://example.org/ns#book", 255), 22u);
  EXPECT_EQ(SplitOf("http://example.org/book", 255), 19u);
  EXPECT_EQ(SplitOf("urn:book", 255), 0u);
  EXPECT_EQ(SplitOf("http://example.org/", 255), 0u);
  EXPECT_EQ(SplitOf("http://a/" + std::string(300, 'x'), 255), 255u);
  EXPECT_EQ(SplitOf("http://a/" + std::string(502, 'x'), 255), std::nullopt);
}

}  // namespace
}  // namespace pheromone::tags
