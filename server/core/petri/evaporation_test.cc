#include "server/core/petri/evaporation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

namespace pheromone::petri {
namespace {

constexpr EvaporationLaw kLaws[] = {EvaporationLaw::kE1,          EvaporationLaw::kE2,
                                    EvaporationLaw::kE3,          EvaporationLaw::kE4,
                                    EvaporationLaw::kExponential, EvaporationLaw::kCounter};

// The equations of the header as they stand there.
double Naive(EvaporationLaw law, double c0, double k, double t) {
  switch (law) {
    case EvaporationLaw::kE1:
      return std::sqrt(std::max(0.0, c0 * c0 - 2 * k * t));
    case EvaporationLaw::kE2:
      return c0 > 0 ? c0 * std::exp(-k * t / c0) : 0;
    case EvaporationLaw::kE3:
      return std::max(0.0, c0 - k * t);
    case EvaporationLaw::kE4:
      return c0 > 0 ? std::max(0.0, c0 - k * t / c0) : 0;
    case EvaporationLaw::kExponential:
      return c0 * std::exp(-k * t);
    case EvaporationLaw::kCounter:
      break;
  }
  return c0;
}

class Evaporations : public ::testing::TestWithParam<EvaporationLaw> {};

TEST_P(Evaporations, ItIsItsEquationRoundedDown) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20'000; ++i) {
    const auto below = [&](uint64_t limit) { return random() % limit; };
    const Evaporation evaporation{GetParam(), static_cast<uint32_t>(below(1u << below(30)))};
    const Trail trail{static_cast<int64_t>(below(uint64_t{1} << below(30))), below(1'000'000)};
    const uint64_t now_ms = trail.since_ms + below(uint64_t{1} << below(34));
    const double exact = 1e3 * Naive(GetParam(), static_cast<double>(trail.stored_milli) / 1e3,
                                     evaporation.rate_milli / 1e3,
                                     static_cast<double>(now_ms - trail.since_ms) / 1e3);
    const auto found = static_cast<double>(ConcentrationAt(evaporation, trail, now_ms));
    // What is lost before a root is taken may be a lot after it: there, compare squares.
    const double error = 1e-6 + exact * 1e-8;
    if (GetParam() == EvaporationLaw::kE1) {
      const double c0 = static_cast<double>(trail.stored_milli);
      EXPECT_LE(found * found, exact * exact + 1 + c0 * c0 * 1e-12);
      EXPECT_GE((found + 1) * (found + 1), exact * exact - 1 - c0 * c0 * 1e-12);
    } else {
      EXPECT_LE(found, exact + error);
      EXPECT_GE(found, exact - 1 - error);
    }
  }
}

TEST_P(Evaporations, ItNeverRisesAndIsGoneInTheEnd) {
  const Evaporation evaporation{GetParam(), 700};
  const Trail trail{98'765, 1'000};
  int64_t before = trail.stored_milli;
  for (uint64_t now_ms = 0; now_ms < 20'000'000; now_ms += 1 + now_ms / 97) {
    const int64_t now = ConcentrationAt(evaporation, trail, now_ms);
    ASSERT_LE(now, before);
    before = now;
  }
  EXPECT_EQ(before, GetParam() == EvaporationLaw::kCounter ? trail.stored_milli : 0);
  EXPECT_GE(ConcentrationAt({GetParam(), kMaxRateMilli}, {kMaxConcentrationMilli, 0}, kLastFieldMs),
            0)
      << "the largest numbers";
}

// Instant by instant.
std::optional<uint64_t> NaiveChange(const Evaporation& evaporation, const Trails& trails,
                                    int64_t dead_band, Advice present, uint64_t after_ms,
                                    uint32_t period_ms, uint64_t until_ms) {
  for (uint64_t at = period_ms / 2; at < until_ms; at += period_ms) {
    if (at > after_ms && AdviceAt(evaporation, trails, dead_band, at) != present) {
      return at;
    }
  }
  return std::nullopt;
}

TEST_P(Evaporations, TheNextChangeOfTheAdviceIsFoundWithoutTryingEachInstant) {
  std::mt19937_64 random(2);
  constexpr uint64_t kUntilMs = 400'000;
  for (int i = 0; i < 2'000; ++i) {
    const auto below = [&](uint64_t limit) { return random() % limit; };
    const Evaporation evaporation{GetParam(), static_cast<uint32_t>(1 + below(5'000))};
    Trails trails{{static_cast<int64_t>(below(60'000)), below(30'000)},
                  {static_cast<int64_t>(below(60'000)), below(30'000)}};
    trails.b = below(8) == 0 ? trails.a : trails.b;
    const auto dead_band = static_cast<int64_t>(below(3) == 0 ? 0 : below(10'000));
    uint64_t after_ms = 30'000 + below(5'000);
    const Advice present = AdviceAt(evaporation, trails, dead_band, after_ms);
    const std::optional<uint64_t> expected =
        NaiveChange(evaporation, trails, dead_band, present, after_ms, 200, kUntilMs);
    for (int asked = 0;; ++asked) {
      ASSERT_LT(asked, 20);
      const std::optional<uint64_t> found =
          NextChange(evaporation, trails, dead_band, present, after_ms, 200);
      ASSERT_EQ(found.value_or(kUntilMs) < kUntilMs,
                expected.has_value() || found.value_or(kUntilMs) < kUntilMs);
      if (!found || *found >= kUntilMs ||
          AdviceAt(evaporation, trails, dead_band, *found) != present) {
        ASSERT_EQ(found && *found < kUntilMs ? found : std::nullopt, expected);
        break;
      }
      ASSERT_TRUE(!expected || *found < *expected) << "an earlier instant, to ask again";
      after_ms = *found;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, Evaporations, ::testing::ValuesIn(kLaws),
                         [](const auto& law) { return std::string(NameOf(law.param)); });

TEST(Evaporation, E2AndE4DependOnWhenAConcentrationIsStoredAgain) {
  for (const EvaporationLaw law : kLaws) {
    const Evaporation evaporation{law, law == EvaporationLaw::kExponential ? 100u : 2'000u};
    const Trail trail{10'000, 0};
    const Trail again{ConcentrationAt(evaporation, trail, 2'000), 2'000};
    const int64_t difference = std::abs(ConcentrationAt(evaporation, trail, 4'000) -
                                        ConcentrationAt(evaporation, again, 4'000));
    const bool depends = law == EvaporationLaw::kE2 || law == EvaporationLaw::kE4;
    EXPECT_EQ(difference > 2, depends) << NameOf(law);
  }
}

TEST(Evaporation, ALowConcentrationIsGoneEarlier) {
  for (const EvaporationLaw law :
       {EvaporationLaw::kE1, EvaporationLaw::kE2, EvaporationLaw::kE3, EvaporationLaw::kE4}) {
    const Evaporation evaporation{law, 1'000};
    const auto lifetime_ms = [&](int64_t stored) {
      uint64_t ms = 0;
      while (ConcentrationAt(evaporation, {stored, 0}, ms) > 0) {
        ms += 10;
      }
      return ms;
    };
    EXPECT_LT(lifetime_ms(5'000), lifetime_ms(10'000)) << NameOf(law);
  }
  // c0^2 / 2k = 12.5 s and c0 / k = 5 s.
  EXPECT_GT(ConcentrationAt({EvaporationLaw::kE1, 1'000}, {5'000, 0}, 12'499), 0);
  EXPECT_EQ(ConcentrationAt({EvaporationLaw::kE1, 1'000}, {5'000, 0}, 12'500), 0);
  EXPECT_GT(ConcentrationAt({EvaporationLaw::kE3, 1'000}, {5'000, 0}, 4'999), 0);
  EXPECT_EQ(ConcentrationAt({EvaporationLaw::kE3, 1'000}, {5'000, 0}, 5'000), 0);
}

TEST(Evaporation, ADepositAddsToWhatIsLeftAndStartsTheTimeAnew) {
  Trail trail;
  const Evaporation e3{EvaporationLaw::kE3, 1'000};
  Deposit(e3, 10, 1'000, &trail);
  EXPECT_EQ(trail, (Trail{10'000, 1'000}));
  Deposit(e3, 5, 5'000, &trail);
  EXPECT_EQ(trail, (Trail{11'000, 5'000}));
  Deposit({EvaporationLaw::kCounter, 0}, 500, 9'000, &trail);
  EXPECT_EQ(trail, (Trail{12'000, 9'000})) << "it counts deposits";
  trail.stored_milli = kMaxConcentrationMilli - 1;
  Deposit(e3, 65'535, 9'000, &trail);
  EXPECT_EQ(trail.stored_milli, kMaxConcentrationMilli);
}

TEST(Evaporation, EqualTrailsAndThoseWithinTheDeadBandAdviseNothing) {
  EXPECT_EQ(Compare(5, 5, 0), Advice::kAny);
  EXPECT_EQ(Compare(6, 5, 0), Advice::kA);
  EXPECT_EQ(Compare(5, 6, 0), Advice::kB);
  EXPECT_EQ(Compare(7, 5, 2), Advice::kAny);
  EXPECT_EQ(Compare(8, 5, 2), Advice::kA);
  EXPECT_EQ(Compare(5, 8, 2), Advice::kB);
}

TEST(Evaporation, InstantsAreHalfAPeriodAfterItsMultiples) {
  EXPECT_EQ(NextInstant(0, 200), 100u);
  EXPECT_EQ(NextInstant(99, 200), 100u);
  EXPECT_EQ(NextInstant(100, 200), 300u);
  EXPECT_EQ(NextInstant(299, 200), 300u);
  EXPECT_EQ(NextInstant(300, 200), 500u);
  EXPECT_EQ(NextInstant(0, 7), 3u);
  EXPECT_EQ(NextInstant(3, 7), 10u);
}

TEST(Evaporation, LawsAreKnownByName) {
  for (const EvaporationLaw law : kLaws) {
    EXPECT_EQ(LawNamed(NameOf(law)), law);
  }
  EXPECT_EQ(LawNamed("E1"), std::nullopt);
}

}  // namespace
}  // namespace pheromone::petri
