#include "server/core/field/law.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "server/core/field/field.h"
#include "server/core/field/kernel_table.h"
#include "server/core/field/testing/naive_law.h"
#include "server/core/field/testing/random_field.h"

namespace pheromone::field {
namespace {

using testing::Between;
using testing::NaiveLevel;
using testing::NaiveSpread;
using testing::OneIn;
using testing::Random;

constexpr uint32_t kQuantum = kLevelsPerQuantum;
constexpr uint32_t kMaxLevel = (1u << 22) - 1;

PheromoneLaw Evaporating(Evaporation evaporation = Evaporation::kCounter) {
  PheromoneLaw law;
  law.evaporation = evaporation;
  law.tau_ms = 1000;
  law.max_count = 100;
  return law;
}

TEST(LevelAt, OfACounterFallsByAQuantumEachTau) {
  const PheromoneLaw law = Evaporating();
  const NodeState node{5 * kQuantum, 10'000};
  EXPECT_EQ(LevelAt(law, node, 10'000), 5 * kQuantum);
  EXPECT_EQ(LevelAt(law, node, 10'999), 5 * kQuantum);
  EXPECT_EQ(LevelAt(law, node, 11'000), 4 * kQuantum);
  EXPECT_EQ(LevelAt(law, node, 14'999), 1 * kQuantum);
  EXPECT_EQ(LevelAt(law, node, 15'000), 0u);
}

TEST(LevelAt, OfALinearLawFallsBySixtyFourthsOfAQuantum) {
  const PheromoneLaw law = Evaporating(Evaporation::kLinear);
  const NodeState node{5 * kQuantum, 10'000};
  EXPECT_EQ(LevelAt(law, node, 10'015), 5 * kQuantum);  // 1000 / 64 = 15.625
  EXPECT_EQ(LevelAt(law, node, 10'016), 5 * kQuantum - 1);
  EXPECT_EQ(LevelAt(law, node, 10'031), 5 * kQuantum - 1);
  EXPECT_EQ(LevelAt(law, node, 10'032), 5 * kQuantum - 2);
  EXPECT_EQ(LevelAt(law, node, 11'000), 4 * kQuantum);
  EXPECT_EQ(LevelAt(law, node, 14'999), 1u);
  EXPECT_EQ(LevelAt(law, node, 15'000), 0u);
}

TEST(LevelAt, OfAnExponentialLawIsHalvedEachTau) {
  const PheromoneLaw law = Evaporating(Evaporation::kExponential);
  const NodeState node{64 * kQuantum, 10'000};
  for (uint64_t halvings = 0; halvings <= 12; ++halvings) {
    EXPECT_EQ(LevelAt(law, node, 10'000 + 1000 * halvings), 64 * kQuantum >> halvings);
  }
  EXPECT_EQ(LevelAt(law, node, 10'500), 2896u);  // 4096 / sqrt(2) = 2896.3
  EXPECT_EQ(LevelAt(law, node, 24'000), 0u);
}

TEST(LevelAt, NeverTurnsNegativeHoweverLongItTakes) {
  for (const auto evaporation :
       {Evaporation::kCounter, Evaporation::kLinear, Evaporation::kExponential}) {
    EXPECT_EQ(LevelAt(Evaporating(evaporation), {kMaxLevel, 0}, kTimeMask), 0u);
  }
}

TEST(LevelAt, ATimeBeforeTheDepositChangesNothing) {
  for (const auto evaporation :
       {Evaporation::kCounter, Evaporation::kLinear, Evaporation::kExponential}) {
    EXPECT_EQ(LevelAt(Evaporating(evaporation), {321, 10'000}, 0), 321u);
  }
}

TEST(LevelAt, WithoutTauNothingEvaporates) {
  for (const auto evaporation :
       {Evaporation::kCounter, Evaporation::kLinear, Evaporation::kExponential}) {
    PheromoneLaw law = Evaporating(evaporation);
    law.tau_ms = 0;
    EXPECT_EQ(LevelAt(law, {321, 0}, kTimeMask), 321u);
  }
}

TEST(LevelAt, EqualsTheCountDownStepByStep) {
  Random random(2);
  int telling = 0;
  constexpr int kCases = 20'000;
  for (int i = 0; i < kCases; ++i) {
    PheromoneLaw law = Evaporating(static_cast<Evaporation>(random() % 3));
    law.tau_ms = Between(random, 1, OneIn(random, 2) ? 100 : 100'000'000);
    const auto level = static_cast<uint32_t>(Between(random, 1, OneIn(random, 10) ? 40'000 : 640));
    const NodeState node{level, static_cast<uint64_t>(Between(random, 0, 1'000'000))};
    const auto life_ms = static_cast<int64_t>(LivesUntil(law, node) - node.time_ms);
    const auto dt = static_cast<uint64_t>(Between(random, 0, life_ms + law.tau_ms));
    const int64_t expected = NaiveLevel(law, level, dt);
    const int64_t seen = LevelAt(law, node, node.time_ms + dt);
    const int64_t tolerance = law.evaporation == Evaporation::kExponential ? 1 : 0;
    ASSERT_LE(std::abs(seen - expected), tolerance) << "tau " << law.tau_ms << " dt " << dt;
    telling += expected != 0 && expected != level ? 1 : 0;
  }
  EXPECT_GE(telling, kCases * 60 / 100);
}

// The sweep relies on the first half: what it has put off is not dead. The second keeps it from
// looking again and again at what lives on.
TEST(LivesUntil, IsTheDeathOrLessThanATenthOfAHalfLifeBefore) {
  Random random(3);
  for (int i = 0; i < 20'000; ++i) {
    PheromoneLaw law = Evaporating(static_cast<Evaporation>(random() % 3));
    law.tau_ms = Between(random, 1, OneIn(random, 2) ? 100 : 10'000'000);
    const auto level = static_cast<uint32_t>(Between(random, 1, OneIn(random, 3) ? 40'000 : 300));
    const NodeState node{level, static_cast<uint64_t>(Between(random, 0, 1'000'000))};
    const uint64_t until_ms = LivesUntil(law, node);
    ASSERT_GT(until_ms, node.time_ms);
    ASSERT_GT(NaiveLevel(law, level, until_ms - 1 - node.time_ms), 0)
        << "level " << level << " tau " << law.tau_ms;
    const bool by_steps = law.evaporation != Evaporation::kExponential;
    const uint64_t dead_ms = until_ms + (by_steps ? 0 : static_cast<uint64_t>(law.tau_ms) / 10 + 2);
    ASSERT_EQ(NaiveLevel(law, level, dead_ms - node.time_ms), 0)
        << "level " << level << " tau " << law.tau_ms;
  }
}

TEST(LivesUntil, IsForGoodWhereNothingEvaporates) {
  PheromoneLaw law = Evaporating();
  law.tau_ms = 0;
  EXPECT_EQ(LivesUntil(law, {1, 0}), UINT64_MAX);
}

TEST(AfterDeposit, AddsToWhatIsLeftAndRestartsTheClock) {
  const NodeState next = AfterDeposit(Evaporating(), {5 * kQuantum, 0}, 2, 3'500);
  EXPECT_EQ(next.level, 4 * kQuantum);
  EXPECT_EQ(next.time_ms, 3'500u);
}

TEST(AfterDeposit, OnALongDeadTrailCountsInFull) {
  EXPECT_EQ(AfterDeposit(Evaporating(), {5 * kQuantum, 0}, 2, 1'000'000).level, 2 * kQuantum);
}

TEST(AfterDeposit, StopsAtTheMaximum) {
  EXPECT_EQ(AfterDeposit(Evaporating(), {99 * kQuantum, 0}, 255, 0).level, 100 * kQuantum);
  PheromoneLaw strongest = Evaporating();
  strongest.max_count = 65535;
  EXPECT_EQ(AfterDeposit(strongest, {kMaxLevel, 0}, 65535, 0).level, 65535 * kQuantum);
}

TEST(AfterDeposit, ATrailRenewedFasterThanTauNeverFades) {
  NodeState node{3 * kQuantum, 0};
  for (uint64_t now = 999; now < 1'000'000; now += 999) {
    node = AfterDeposit(Evaporating(), node, 0, now);
  }
  EXPECT_EQ(node.level, 3 * kQuantum);
}

TEST(Exp2Minus, IsWithinOneInABillionOfTwoToTheMinusX) {
  Random random(5);
  const auto error = [](double x) {
    const long double exact = std::exp2(-static_cast<long double>(x));
    return std::fabs(static_cast<double>((Exp2Minus(x) - exact) / exact));
  };
  double worst = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    worst = std::max(worst, error(static_cast<double>(random()) * 0x1p-64 * 60));
  }
  for (int n = 0; n <= 60; ++n) {
    for (const double x : {std::nextafter(n, 0), n * 1.0, std::nextafter(n, 60)}) {
      worst = std::max(worst, error(x));
    }
  }
  EXPECT_LE(worst, 1e-9);
  RecordProperty("worst_relative_error_1e_12", static_cast<int>(worst * 1e12));
}

// An error that changes by less than this from place to place cannot make a trail that evaporates
// grow by a level.
TEST(Exp2Minus, FallsAllTheWay) {
  double before = Exp2Minus(0);
  for (int i = 1; i <= 6'000'000; ++i) {
    const double next = Exp2Minus(i * 1e-5);
    ASSERT_LT(next, before) << i;
    before = next;
  }
}

TEST(Exp2Minus, BeyondSixtyIsAsAtSixty) {
  EXPECT_EQ(Exp2Minus(60.5), Exp2Minus(60));
  EXPECT_EQ(Exp2Minus(4e12), Exp2Minus(60));
}

TEST(SpreadQ16, IsTheZShapeOfEquationOne) {
  PheromoneLaw law;
  law.core_um = 100'000;
  law.sigma_um = 400'000;
  const auto spread = [&](int64_t d) { return SpreadQ16(law, d * d); };
  EXPECT_EQ(spread(0), 65536u);
  EXPECT_EQ(spread(100'000), 65536u);
  EXPECT_EQ(spread(200'000), 65536u * 3 / 4);
  EXPECT_EQ(spread(300'000), 65536u / 2);
  EXPECT_EQ(spread(500'000), 0u);
  EXPECT_EQ(spread(500'001), 0u);
}

TEST(SpreadQ16, EqualsTheExactlyRoundedZShape) {
  Random random(13);
  for (int i = 0; i < 200'000; ++i) {
    PheromoneLaw law;
    law.core_um = OneIn(random, 4) ? 0 : Between(random, 0, 1'000'000);
    law.sigma_um = Between(random, 1, 2'000'000);
    const int64_t reach = law.reach_um() + 2;
    const int64_t d = Between(random, 0, reach);
    const int64_t d2 = d * d + Between(random, -1, 1) * (d > 0 ? Between(random, 0, d) : 0);
    ASSERT_EQ(SpreadQ16(law, d2), NaiveSpread(law, d2))
        << "c " << law.core_um << " sigma " << law.sigma_um << " d2 " << d2;
  }
}

TEST(SpreadQ16, OfAGaussianEndsAtItsCutoff) {
  PheromoneLaw law;
  law.profile = Profile::kGaussian;
  law.sigma_um = 100'000;
  law.cutoff_um = 150'000;
  EXPECT_EQ(SpreadQ16(law, 0), 65536u);
  EXPECT_EQ(SpreadQ16(law, int64_t{100'000} * 100'000), 39750u);  // 65 536 exp(-1/2) = 39 749.6
  EXPECT_EQ(SpreadQ16(law, int64_t{150'000} * 150'000), 21276u);  // 65 536 exp(-9/8) = 21 276.4
  EXPECT_EQ(SpreadQ16(law, int64_t{150'000} * 150'000 + 1), 0u);
}

TEST(SpreadQ16, OfAGaussianEqualsTheExactOneButForTies) {
  Random random(1777);
  int different = 0;
  for (int i = 0; i < 200'000; ++i) {
    PheromoneLaw law;
    law.profile = Profile::kGaussian;
    law.sigma_um = Between(random, 1, 2'000'000);
    law.cutoff_um = Between(random, law.sigma_um, 6 * law.sigma_um);
    const int64_t d = Between(random, 0, law.cutoff_um + 1);
    const int64_t d2 = d * d + Between(random, 0, 2 * d);
    const int64_t off = std::abs(int64_t{SpreadQ16(law, d2)} - NaiveSpread(law, d2));
    ASSERT_LE(off, 1) << "sigma " << law.sigma_um << " d2 " << d2;
    different += static_cast<int>(off);
  }
  EXPECT_LE(different, 20);  // 65 536 * 3e-10 of a unit wide: one tie in 25 000
}

}  // namespace
}  // namespace pheromone::field
