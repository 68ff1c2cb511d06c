// The LED, by the table of its header.
#include "client_fw/core/status_led.h"

#include <gtest/gtest.h>

#include <vector>

namespace pheromone {
namespace client {
namespace {

TEST(LedCodeTest, TheMostUrgentReasonIsShown) {
  EXPECT_EQ(0, LedCode(0, 0, true));
  EXPECT_EQ(1, LedCode(kHalted, 0, true));
  EXPECT_EQ(2, LedCode(kHalted | kPoseLost, kBumperAlarm, false));
  EXPECT_EQ(3, LedCode(kHalted | kFailSafe, 0, true));
  EXPECT_EQ(3, LedCode(kNoAnswerYet, 0, true));
  EXPECT_EQ(4, LedCode(kNoAnswerYet | kTypeMissing, 0, true));
  EXPECT_EQ(4, LedCode(kWrongVersion, 0, true));
  EXPECT_EQ(5, LedCode(kHalted | kPoseLost, kStopButtonAlarm, true));
  EXPECT_EQ(6, LedCode(kHalted | kPoseLost | kNoAnswerYet, 0, true));
  EXPECT_EQ(7, LedCode(kOffTheMap, 0, true));
  EXPECT_EQ(7, LedCode(kTrailLost | kHalted, 0, true));
}

// Durations of light and darkness over `ms`, beginning with the first light.
std::vector<int> Pattern(uint8_t code, uint16_t start_ms, int ms) {
  StatusLed led;
  std::vector<int> durations;
  bool before = false;
  for (int i = 0; i < ms; ++i) {
    led.Step(code, static_cast<uint16_t>(start_ms + i));
    if (led.on() != before) {
      before = led.on();
      durations.push_back(0);
    }
    if (!durations.empty()) {
      ++durations.back();
    }
  }
  return durations;
}

TEST(StatusLedTest, FlashesAsOftenAsTheCodeSaysAndPausesAlsoWhenTheClockWraps) {
  for (uint8_t code = 1; code <= 7; ++code) {
    for (const uint16_t start_ms : {uint16_t{0}, uint16_t{64000}}) {
      const std::vector<int> durations = Pattern(code, start_ms, 12000);
      ASSERT_GE(durations.size(), 2u * code + 1);
      for (int i = 1; i <= 2 * code; ++i) {  // the first may be cut
        EXPECT_EQ(i == 2 * code - 1 ? 256 + 1024 : 256, durations[static_cast<size_t>(i)])
            << int{code} << ' ' << i;
      }
    }
  }
}

TEST(StatusLedTest, IsSteadyWithoutAReason) {
  const std::vector<int> durations = Pattern(0, 0, 5000);
  EXPECT_EQ(1u, durations.size());
}

}  // namespace
}  // namespace client
}  // namespace pheromone
