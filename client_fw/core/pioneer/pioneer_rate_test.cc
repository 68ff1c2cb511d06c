// At which of the board's bit rates a Pioneer is looked for.
#include <gtest/gtest.h>

#include "client_fw/core/pioneer/pioneer.h"
#include "client_fw/core/testing/pioneer_harness.h"

namespace pheromone {
namespace client {
namespace {

TEST(PioneerRateTest, EachSync0WithoutAnAnswerIsFollowedByCloseAndSync0AtTheNextRate) {
  PioneerHarness harness;
  harness.on = false;
  for (int rate = 0; rate < 600; ++rate) {  // it wraps
    for (const PioneerCommand wanted : {PioneerCommand::kClose, PioneerCommand::kSync0}) {
      if (rate == 0 && wanted == PioneerCommand::kClose) {
        continue;
      }
      ASSERT_TRUE(harness.RunUntilHeard());
      EXPECT_EQ(static_cast<uint8_t>(wanted), harness.heard.back().command);
      EXPECT_EQ(rate % 256, harness.pioneer.rate());
    }
  }
}

TEST(PioneerRateTest, TheRateRemainsInASessionAndAtFirstAfterIt) {
  PioneerHarness harness;
  harness.on = false;
  harness.Run(2300);
  harness.on = true;
  harness.Connect();
  EXPECT_EQ(2, harness.pioneer.rate());
  harness.open = false;  // and no SIPs
  ASSERT_TRUE(harness.RunUntilHeard(10'000));
  for (uint32_t ms = 0; ms < kPioneerSilenceMs + kAfterCloseMs && !harness.pioneer.known(); ++ms) {
    harness.Step();
    EXPECT_EQ(2, harness.pioneer.rate());
  }
}

TEST(PioneerRateTest, ASessionOfAnotherProgramIsClosedAtItsRate) {
  PioneerHarness harness;
  harness.on = false;
  harness.Run(1300);
  ASSERT_EQ(1, harness.pioneer.rate());
  harness.on = true;
  harness.synced = 3;
  harness.open = true;
  harness.Connect();
  EXPECT_EQ(1, harness.closed);
  EXPECT_EQ(1, harness.pioneer.rate());
}

}  // namespace
}  // namespace client
}  // namespace pheromone
