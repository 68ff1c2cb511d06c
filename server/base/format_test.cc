#include "server/base/format.h"

#include <gtest/gtest.h>

#include <limits>

namespace pheromone {
namespace {

TEST(Format, NumbersAreShortAndReadBackTheSame) {
  EXPECT_EQ(ShortestText(0.1), "0.1");
  EXPECT_EQ(ShortestText(1e300), "1e+300");
  EXPECT_EQ(ShortestText(std::numeric_limits<uint64_t>::max()), "18446744073709551615");
}

TEST(Format, PeopleReadNoExponentUnlessTheNumberIsExtreme) {
  EXPECT_EQ(FormatNumber(0), "0");
  EXPECT_EQ(FormatNumber(1e6), "1000000");
  EXPECT_EQ(FormatNumber(-1e-7), "-0.0000001");
  EXPECT_EQ(FormatNumber(5e-13), "5e-13");
  EXPECT_EQ(FormatNumber(1e15), "1e+15");
  EXPECT_EQ(FormatNumber(std::numeric_limits<double>::infinity()), "inf");
}

TEST(Format, HexHasSixteenDigits) {
  EXPECT_EQ(HexText(0), "0000000000000000");
  EXPECT_EQ(HexText(0xFEDCBA9876543210), "fedcba9876543210");
}

TEST(Format, TimesAreOfTheProlepticCalendar) {
  EXPECT_EQ(UtcText(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(UtcText(951'782'399), "2000-02-28T23:59:59Z");
  EXPECT_EQ(UtcText(951'782'400, "%Y%m%dT%H%M%SZ"), "20000229T000000Z");
  EXPECT_EQ(UtcMsText(0), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(UtcMsText(951'782'399'007), "2000-02-28T23:59:59.007Z");
  EXPECT_EQ(UtcMsText(951'782'399'999), "2000-02-28T23:59:59.999Z");
  EXPECT_EQ(UtcText(std::numeric_limits<int64_t>::max()), "an unknown time");
}

}  // namespace
}  // namespace pheromone
