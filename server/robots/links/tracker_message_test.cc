#include "server/robots/links/tracker_message.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace pheromone::links {
namespace {

// The fault of a line, or -1.
int FaultOf(std::string_view line) {
  const auto parsed = ParseTrackerLine(line);
  const auto* fault = std::get_if<TrackerFault>(&parsed);
  return fault != nullptr ? static_cast<int>(*fault) : -1;
}

int Is(TrackerFault fault) {
  return static_cast<int>(fault);
}

TrackerLine Good(std::string_view line) {
  const auto parsed = ParseTrackerLine(line);
  EXPECT_TRUE(std::holds_alternative<TrackerLine>(parsed)) << line;
  return std::get<TrackerLine>(parsed);
}

std::vector<std::string> LinesOf(std::string_view datagram) {
  std::vector<std::string> lines;
  ForEachTrackerLine(datagram, [&](std::string_view line) { lines.emplace_back(line); });
  return lines;
}

TEST(TrackerMessage, ReadsAPose) {
  const TrackerLine line = Good("pose radio-a 7 2.35 0.9 -90");
  EXPECT_EQ(line.link, "radio-a");
  EXPECT_EQ(line.id, 7);
  EXPECT_EQ(std::get<PoseFix>(line.fix), (PoseFix{2.35, 0.9, -90}));
}

TEST(TrackerMessage, ReadsAPlaceOnTheEarthWithAndWithoutHeight) {
  const TrackerLine low = Good("gps b 254 47.37690 8.54170 181.5");
  EXPECT_EQ(std::get<GpsFix>(low.fix), (GpsFix{47.3769, 8.5417, 181.5, std::nullopt}));
  const TrackerLine high = Good("gps b 1 -90 -180 360 408.25");
  EXPECT_EQ(std::get<GpsFix>(high.fix), (GpsFix{-90, -180, 360, 408.25}));
}

TEST(TrackerMessage, BlanksAndTabsSeparateHoweverMany) {
  EXPECT_EQ(std::get<PoseFix>(Good(" \tpose\tr  7\t\t1 .5 -.25  ").fix), (PoseFix{1, 0.5, -0.25}));
}

TEST(TrackerMessage, SaysWhatIsWrongWithALine) {
  EXPECT_EQ(FaultOf("POSE r 7 1 2 3"), Is(TrackerFault::kUnknownKind));
  EXPECT_EQ(FaultOf("poses r 7 1 2 3"), Is(TrackerFault::kUnknownKind));
  EXPECT_EQ(FaultOf(""), Is(TrackerFault::kUnknownKind));
  EXPECT_EQ(FaultOf("pose r 7 1 2"), Is(TrackerFault::kWordCount));
  EXPECT_EQ(FaultOf("pose r 7 1 2 3 4"), Is(TrackerFault::kWordCount));
  EXPECT_EQ(FaultOf("gps r 7 1 2"), Is(TrackerFault::kWordCount));
  EXPECT_EQ(FaultOf("gps r 7 1 2 3 4 5"), Is(TrackerFault::kWordCount));
  EXPECT_EQ(FaultOf("gps r 7 1 2 3 4 5 6 7 8 9"), Is(TrackerFault::kWordCount));
  for (const char* id : {"0", "255", "256", "-1", "+1", "7a", "0x7", "1.0", "99999999999"}) {
    EXPECT_EQ(FaultOf("pose r " + std::string(id) + " 1 2 3"), Is(TrackerFault::kBadId)) << id;
  }
}

TEST(TrackerMessage, TakesPlainDecimalsOnly) {
  for (const char* number : {"nan", "inf", "-inf", "infinity", "NaN(1)", "1e3", "1E3", "0x1p3",
                             "+1", "1,5", "1.2.3", "--1", "-", ".", "1-", "1m", "1_000", "\xFF"}) {
    for (const std::string& line :
         {"pose r 7 " + std::string(number) + " 2 3", "pose r 7 1 " + std::string(number) + " 3",
          "pose r 7 1 2 " + std::string(number), "gps r 7 1 2 3 " + std::string(number)}) {
      EXPECT_EQ(FaultOf(line), Is(TrackerFault::kBadNumber)) << line;
    }
  }
}

TEST(TrackerMessage, RangesIncludeTheirEnds) {
  EXPECT_EQ(FaultOf("pose r 7 1000000 -1000000 360"), -1);
  EXPECT_EQ(FaultOf("pose r 7 1000000.001 0 0"), Is(TrackerFault::kOutOfRange));
  EXPECT_EQ(FaultOf("pose r 7 0 -1000000.001 0"), Is(TrackerFault::kOutOfRange));
  EXPECT_EQ(FaultOf("pose r 7 0 0 -360.001"), Is(TrackerFault::kOutOfRange));
  EXPECT_EQ(FaultOf("gps r 7 90 180 -360 -100000"), -1);
  EXPECT_EQ(FaultOf("gps r 7 90.001 0 0"), Is(TrackerFault::kOutOfRange));
  EXPECT_EQ(FaultOf("gps r 7 0 180.001 0"), Is(TrackerFault::kOutOfRange));
  EXPECT_EQ(FaultOf("gps r 7 0 0 361"), Is(TrackerFault::kOutOfRange));
  EXPECT_EQ(FaultOf("gps r 7 0 0 0 100001"), Is(TrackerFault::kOutOfRange));
}

TEST(TrackerMessage, NumbersOfAnyLengthAreReadOrRefused) {
  const std::string digits(5'000, '9');
  const auto fault = FaultOf("pose r 7 " + digits + " 0 0");
  EXPECT_TRUE(fault == Is(TrackerFault::kBadNumber) || fault == Is(TrackerFault::kOutOfRange));
  EXPECT_EQ(std::get<PoseFix>(Good("pose r 7 0." + digits + " 0 0").fix).x_m, 1.0);
}

TEST(TrackerMessage, ADatagramIsItsLines) {
  EXPECT_EQ(LinesOf("a\nb\r\n\n \t\r\n  c"), (std::vector<std::string>{"a", "b", "  c"}));
  EXPECT_EQ(LinesOf("a\n"), (std::vector<std::string>{"a"}));
  EXPECT_TRUE(LinesOf("").empty());
  EXPECT_TRUE(LinesOf("\n\n\r\n").empty());
}

}  // namespace
}  // namespace pheromone::links
