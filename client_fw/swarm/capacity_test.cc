// Against what was measured (client_fw/experiments/channel/README.md): at 9600 baud with a
// turnaround of 2 ms, each robot asking every 200 ms.

#include "client_fw/swarm/capacity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pheromone::swarm {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ChannelLoad Measured(LinkKind access, int robots) {
  const engine::LinkSettings link = ChannelTiming().Link("measured");
  return {.robots = robots,
          .access = access,
          .window_ms = link.response_window_ms,
          .slot_ms = link.slot_ms};
}

TEST(CapacityTest, IsAboutWhatWasMeasured) {
  const auto answers_per_s = [](LinkKind access, int robots) {
    return robots * 1000.0 / static_cast<double>(LeastPeriodMs(Measured(access, robots)));
  };
  EXPECT_NEAR(answers_per_s(LinkKind::kMediumAccess, 8), 38.7, 2);
  EXPECT_NEAR(answers_per_s(LinkKind::kMediumAccess, 16), 38.6, 2);
  EXPECT_NEAR(answers_per_s(LinkKind::kBuffered, 8), 24.5, 2);
  EXPECT_NEAR(answers_per_s(LinkKind::kBuffered, 16), 23.3, 2);
}

TEST(CapacityTest, TellsWhoNeverStoppedFromWhoDid) {
  const struct {
    LinkKind access;
    int robots;
    bool fits;
  } measured[] = {{LinkKind::kBuffered, 4, true},
                  {LinkKind::kBuffered, 16, false},
                  {LinkKind::kMediumAccess, 8, true},
                  {LinkKind::kMediumAccess, 16, true},
                  {LinkKind::kMediumAccess, 20, false}};
  for (const auto& it : measured) {
    EXPECT_EQ(WhyItDoesNotFit(Measured(it.access, it.robots)).empty(), it.fits) << it.robots;
  }
  // "At 700 ms, 20 robots never stop."
  ChannelLoad patient = Measured(LinkKind::kMediumAccess, 20);
  patient.fail_safe_ms = 700;
  EXPECT_EQ(WhyItDoesNotFit(patient), "");
}

TEST(CapacityTest, SignaturesTakeTime) {
  // 19 bytes and 16, each 10 bits at 9600 baud, and two turnarounds; 1.2 times as many.
  ChannelLoad load = Measured(LinkKind::kMediumAccess, 16);
  load.is_signed = true;
  EXPECT_NEAR(static_cast<double>(LeastPeriodMs(load)), 16 * (35 * 10 / 9.6 + 2 * 2) / 1.2, 1);
  EXPECT_FALSE(Fits(load));  // 16 with keys had 15 times as many stops as without
  load.fail_safe_ms = 700;
  EXPECT_TRUE(Fits(load));
  load = Measured(LinkKind::kMediumAccess, 13);  // each stopped every two seconds with keys
  EXPECT_TRUE(Fits(load));
  load.is_signed = true;
  EXPECT_FALSE(Fits(load));
  load.robots = 12;
  EXPECT_TRUE(Fits(load));
}

TEST(CapacityTest, ALinkWithoutMediumAccessHoldsThree) {
  // Each takes 28 ms for 26 bytes, the window of 100 ms, and two slots of 1 ms: 130 ms.
  EXPECT_EQ(LeastPeriodMs({.robots = 12}), 12 * 130 - 2);
  EXPECT_TRUE(Fits({.robots = 3}));
  EXPECT_FALSE(Fits({.robots = 4}));
}

TEST(CapacityTest, SaysWhatHelps) {
  const std::string twelve = WhyItDoesNotFit({.robots = 12});
  EXPECT_THAT(twelve,
              HasSubstr("12 robots on a channel of 9600 baud with a response window of 100 ms are "
                        "answered every 1.56 s each, by contention, but they stop if they are not "
                        "answered for 0.48 s (fail-safe)"));
  EXPECT_THAT(twelve, HasSubstr("medium_access = true in the server's [[link]]"));
  EXPECT_THAT(twelve, HasSubstr("4 such links (3 robots fit on one)"));
  EXPECT_THAT(twelve, HasSubstr("or a period of 1.60 s with a fail-safe of 3.20 s."));
  const std::string forty = WhyItDoesNotFit({.robots = 40, .access = LinkKind::kMediumAccess});
  EXPECT_THAT(forty, HasSubstr("in rounds"));
  EXPECT_THAT(forty, Not(HasSubstr("medium_access")));
  EXPECT_THAT(forty, HasSubstr("What helps: 3 such links (16 robots fit on one); or a period of "));
  // A robot's longest period is 15 s: 200 need 200 * 130 ms.
  EXPECT_THAT(WhyItDoesNotFit({.robots = 200}), Not(HasSubstr("a period of")));
  // What it says helps.
  EXPECT_TRUE(Fits({.robots = 12, .access = LinkKind::kMediumAccess}));
  EXPECT_TRUE(Fits({.robots = 12, .period_ms = 1600, .fail_safe_ms = 3200}));
  EXPECT_TRUE(Fits({.robots = 16, .access = LinkKind::kMediumAccess}));
}

}  // namespace
}  // namespace pheromone::swarm
