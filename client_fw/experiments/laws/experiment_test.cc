#include "client_fw/experiments/laws/experiment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace pheromone::swarm {
namespace {

constexpr int kSeeds = 4;

FollowSummary On(Curve curve, const Steering& steering) {
  return Compare({"", steering}, curve, kSeeds).summary;
}

// The paper's claim, on curves and seeds that neither was tuned on.
TEST(Laws, DifferentialAndFuzzyAreComparableOnUnseenCurves) {
  double differential_mm = 0;
  double fuzzy_mm = 0;
  for (const Curve curve : UnseenCurves()) {
    const FollowSummary differential = On(curve, TunedDifferential());
    const FollowSummary fuzzy = On(curve, TunedFuzzy());
    differential_mm += differential.error_mm.mean;
    fuzzy_mm += fuzzy.error_mm.mean;
    EXPECT_NEAR(differential.progress_mm_s.mean, fuzzy.progress_mm_s.mean,
                0.1 * fuzzy.progress_mm_s.mean)
        << NameOf(curve);
    EXPECT_LE(differential.error_mm.most, 60) << NameOf(curve);
  }
  EXPECT_LE(differential_mm, 1.1 * fuzzy_mm);
}

TEST(Laws, TuningHelpsBothOnTheCurvesItSaw) {
  for (const Steering& tuned : {TunedDifferential(), TunedFuzzy()}) {
    const Steering start = SteeringOf(tuned.law, TunableOf(tuned.law).start);
    EXPECT_LT(MeritOf(tuned).cost(), MeritOf(start).cost());
  }
}

// In fuzzy rules: u = e / 2, which is the differential law. The two differ by rounding, and by the
// 1/128 that s lacks of 1.
TEST(Laws, TheSearchesBeginWithTheSameController) {
  const Steering differential =
      SteeringOf(client::Law::kDifferential, TunableOf(client::Law::kDifferential).start);
  const Steering fuzzy = SteeringOf(client::Law::kFuzzy, TunableOf(client::Law::kFuzzy).start);
  for (int left = 0; left <= 8192; left += 64) {
    const auto right = static_cast<int16_t>(8192 - left);
    client::FuzzyState state = {client::kNoError};
    const client::WheelSpeeds a =
        client::Steer(client::Law::kDifferential, static_cast<int16_t>(left), right,
                      differential.speed_mm_s, differential.gain_8);
    const client::WheelSpeeds b = client::SteerFuzzy(static_cast<int16_t>(left), right,
                                                     fuzzy.speed_mm_s, fuzzy.fuzzy, &state);
    EXPECT_NEAR(a.left_mm_s, b.left_mm_s, 5) << left;
    EXPECT_NEAR(a.right_mm_s, b.right_mm_s, 5) << left;
  }
}

TEST(Laws, AWheelNeverTurnsFasterThanTheOthers) {
  for (const client::Law law : {client::Law::kDifferential, client::Law::kFuzzy}) {
    EXPECT_EQ(TunableOf(law).ranges.front().most, 300);
    EXPECT_EQ(TunableOf(law).ranges.size(), TunableOf(law).names.size());
    EXPECT_EQ(TunableOf(law).ranges.size(), TunableOf(law).start.size());
  }
  EXPECT_LE(TunedDifferential().speed_mm_s, 300);
  EXPECT_LE(TunedFuzzy().speed_mm_s, 300);
}

TEST(Laws, ATuningKeepsItsBestAndCountsItsEvaluations) {
  std::vector<int> shown;
  const Tuning tuning =
      Tune(client::Law::kDifferential, 4, 1, [&](int number) { shown.push_back(number); });
  EXPECT_EQ(shown, (std::vector<int>{0, 1, 2, 3}));
  ASSERT_EQ(tuning.merits.size(), 4u);
  for (const Merit& merit : tuning.merits) {
    EXPECT_GE(merit.cost(), MeritOf(tuning.steering()).cost());
  }
  const std::string csv = ToCsv(std::vector<Tuning>{tuning});
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5);
}

TEST(Laws, AMillimetreOfErrorCostsAPerCentOfProgress) {
  const Merit merit = {20, 270};
  EXPECT_DOUBLE_EQ(merit.cost(), 20 + 10);
}

}  // namespace
}  // namespace pheromone::swarm
