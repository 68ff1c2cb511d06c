#include "server/robots/radio/air_quality.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <vector>

namespace pheromone::radio {
namespace {

// The probability that a robot does not receive a ROUND of a form.
using Loss = std::function<double(size_t robot, RoundForm form)>;

class Swarm {
 public:
  explicit Swarm(size_t robots) : receptions_(robots) {}

  /// Returns how many of the rounds were coded.
  int Run(int rounds, const Loss& loss) {
    int coded = 0;
    for (int i = 0; i < rounds; ++i) {
      const RoundForm before = air_.form();
      const RoundForm form = air_.Choose([this](const auto& use) {
        for (const Reception& reception : receptions_) {
          use(reception);
        }
      });
      changes += air_.form() != before ? 1 : 0;
      coded += form == RoundForm::kCoded ? 1 : 0;
      for (size_t robot = 0; robot < receptions_.size(); ++robot) {
        const double lost = loss(robot, form);
        air_.Count(form, std::uniform_real_distribution<>()(random_) >= lost, &receptions_[robot]);
      }
    }
    return coded;
  }

  int changes = 0;

 private:
  AirQuality air_;
  std::vector<Reception> receptions_;
  std::mt19937_64 random_{7};
};

Loss Same(double plain, double coded) {
  return [=](size_t, RoundForm form) { return form == RoundForm::kPlain ? plain : coded; };
}

TEST(AirQualityTest, InGoodAirNothingIsCodedNotEvenForATrial) {
  EXPECT_EQ(Swarm(8).Run(5000, Same(0, 0)), 0);
}

// Coding costs an eighth, and an answer takes two ROUNDs.
TEST(AirQualityTest, CodesWhereThatIsWorthMoreThanItCosts) {
  for (const size_t robots : {2u, 8u, 40u}) {
    Swarm bad(robots);
    bad.Run(300, Same(0.2, 0.01));
    EXPECT_GT(bad.Run(1000, Same(0.2, 0.01)), 950) << robots;
    Swarm good(robots);
    good.Run(300, Same(0.02, 0));
    EXPECT_LT(good.Run(1000, Same(0.02, 0)), 250) << robots;
  }
}

TEST(AirQualityTest, FindsVeryBadAirWithinAFewRounds) {
  EXPECT_GT(Swarm(8).Run(40, Same(0.9, 0.1)), 30);
}

// The mean of what it was given, with three more that it has received.
TEST(AirQualityTest, ARobotIsKnownAfterAFewTurns) {
  AirQuality air;
  Reception robot;
  for (int turns = 1; turns <= 20; ++turns) {
    air.Count(RoundForm::kPlain, turns % 4 == 0, &robot);
    const int unused = turns - turns / 4;
    EXPECT_NEAR(robot.LostOf(RoundForm::kPlain), unused / (turns + 3.0), 1e-9) << turns;
  }
  EXPECT_EQ(robot.LostOf(RoundForm::kCoded), 0);
}

TEST(AirQualityTest, ANewcomerInBadAirIsHeededSoon) {
  const Loss one = [](size_t robot, RoundForm form) {
    return robot == 0 && form == RoundForm::kPlain ? 1.0 : 0.0;
  };
  EXPECT_GT(Swarm(8).Run(20, one), 12);
}

TEST(AirQualityTest, ReturnsWhenTheAirIsGoodAgain) {
  Swarm swarm(8);
  swarm.Run(500, Same(0.8, 0.05));
  swarm.Run(1500, Same(0, 0));
  EXPECT_EQ(swarm.Run(1000, Same(0, 0)), 0);
}

TEST(AirQualityTest, DoesNotOscillate) {
  for (const double lost : {0.05, 0.1, 0.3, 0.6}) {
    Swarm swarm(8);
    swarm.Run(5000, Same(lost, lost));  // coding does not help: whole ROUNDs are lost
    EXPECT_LE(swarm.changes, 60) << lost;
    EXPECT_LT(swarm.Run(5000, Same(lost, lost)), 1000) << lost;
  }
}

TEST(AirQualityTest, WhileCodedTriesPlainOnesNowAndThen) {
  Swarm swarm(8);
  swarm.Run(500, Same(0.5, 0.02));
  EXPECT_NEAR(swarm.Run(6400, Same(0.5, 0.02)), 6304, 2);  // each 64 to 67 rounds
}

// Of robots that share the rounds in two, three or four groups, all are tried.
TEST(AirQualityTest, TriesEachGroupOfRobots) {
  for (const size_t groups : {2u, 3u, 4u}) {
    AirQuality air;
    std::vector<Reception> receptions(groups);
    std::vector<int> tried(groups);
    for (size_t round = 0; round < 3000; ++round) {
      const RoundForm form = air.Choose([&](const auto& use) {
        for (const Reception& reception : receptions) {
          use(reception);
        }
      });
      const size_t group = round % groups;
      tried[group] += form != air.form() ? 1 : 0;
      air.Count(form, form == RoundForm::kCoded, &receptions[group]);
    }
    EXPECT_EQ(air.form(), RoundForm::kCoded);
    for (const int trials : tried) {
      EXPECT_GE(trials, 5) << groups;
    }
  }
}

// The product over all counts: for eight robots the cost is smaller than what one gains, for a
// hundred it is not.
TEST(AirQualityTest, OneRobotInBadAirCountsButNotMoreThanAllOthers) {
  const Loss one = [](size_t robot, RoundForm form) {
    return robot == 0 && form == RoundForm::kPlain ? 0.95 : 0.0;
  };
  Swarm eight(8);
  eight.Run(500, one);
  EXPECT_GT(eight.Run(1000, one), 950);
  Swarm hundred(100);
  hundred.Run(500, one);
  EXPECT_LT(hundred.Run(1000, one), 50);
}

TEST(AirQualityTest, TriesNothingByRoundsThatMustArrive) {
  AirQuality air;
  Reception robot;
  const auto choose = [&](bool may_try) {
    const auto all = [&robot](const auto& use) { use(robot); };
    const RoundForm form = air.Choose(all, may_try);
    air.Count(form, form == RoundForm::kCoded, &robot);
    return form;
  };
  for (int round = 0; round < 500; ++round) {
    choose(true);
  }
  for (int round = 0; round < 500; ++round) {
    ASSERT_EQ(choose(false), RoundForm::kCoded);
  }
  int tried = 0;
  for (int round = 0; round < 500; ++round) {
    tried += choose(true) == RoundForm::kPlain ? 1 : 0;
  }
  EXPECT_GT(tried, 0);
}

}  // namespace
}  // namespace pheromone::radio
