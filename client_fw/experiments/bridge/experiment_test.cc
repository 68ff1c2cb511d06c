#include "client_fw/experiments/bridge/experiment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "client_fw/experiments/bridge/moments.h"
#include "server/base/testing/count.h"

namespace pheromone::swarm {
namespace {

BridgeExperiment Minutes(int64_t minutes) {
  BridgeExperiment experiment;
  experiment.duration_ms = minutes * 60'000;
  return experiment;
}

// Robots that only sense the initial deposits: the share of the short branch among their choices.
double ShareWithLaid(uint16_t on_short, uint16_t on_long) {
  BridgeExperiment experiment = Minutes(15);
  experiment.lay_trail = false;
  experiment.tau_ms = 0;
  experiment.laid = {on_short, on_long};
  int all = 0;
  int took_short = 0;
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    for (const Choice& choice : RunBridge(experiment, seed).choices) {
      ++all;
      took_short += choice.branch == Branch::kShort ? 1 : 0;
    }
  }
  EXPECT_GT(all, 500);
  return static_cast<double>(took_short) / all;
}

TEST(Bridge, WithoutATrailBothBranchesAreChosenAlikeAndTimeIsSpentByLength) {
  EXPECT_NEAR(ShareWithLaid(0, 0), 0.5, 0.05);
  BridgeExperiment experiment = Minutes(15);
  experiment.lay_trail = false;
  double presence = 0;
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    presence += RunBridge(experiment, seed).presence / 3;
  }
  EXPECT_NEAR(presence, 1.0 / (1 + experiment.shape.ratio), 0.03);
}

TEST(Bridge, EqualTrailsAreChosenAlike) {
  EXPECT_NEAR(ShareWithLaid(32, 32), 0.5, 0.05);
}

TEST(Bridge, AMarkedBranchIsTakenWhicheverItIs) {
  EXPECT_GT(ShareWithLaid(32, 0), 0.9);
  EXPECT_LT(ShareWithLaid(0, 32), 0.1);
}

// Deneubourg's choice function with n = 2 says 4/5 and 1/5.
TEST(Bridge, ATrailOfTwiceTheStrengthIsPreferredAboutFourToOne) {
  EXPECT_NEAR(ShareWithLaid(32, 16), 0.8, 0.08);
  EXPECT_NEAR(ShareWithLaid(16, 32), 0.2, 0.08);
}

TEST(Bridge, EachAnsweredTraceLeavesOneQuantum) {
  BridgeExperiment experiment;
  experiment.robots = 3;
  experiment.tau_ms = 0;
  experiment.max_count = 10'000;
  BridgeSimulation simulation(experiment, 5);
  simulation.RunTo(90'000);
  uint64_t answers = 0;
  for (const BridgeRobot& robot : simulation.robots()) {
    answers += robot.conversation().counters().answers;
  }
  uint64_t levels = 0;
  simulation.service().Inspect([&](const engine::Engine& engine) {
    engine.field().VisitLevels(BridgeExperiment::kTrail, 90'000,
                               [&](field::NodeIndex, uint32_t level) { levels += level; });
  });
  EXPECT_GT(answers, 1000u);
  EXPECT_GE(levels / field::kLevelsPerQuantum, answers);  // of the last, the answer may be on its
  EXPECT_LE(levels / field::kLevelsPerQuantum, answers + 3);  // way
}

TEST(Bridge, ASwarmThatLaysATrailDecidesWhereOneWithoutDoesNot) {
  const BridgeSummary with = Summarise(RunBridges(Minutes(20), 4));
  BridgeExperiment experiment = Minutes(20);
  experiment.lay_trail = false;
  const BridgeSummary without = Summarise(RunBridges(experiment, 4));
  EXPECT_GE(with.ended_short + with.ended_long, 3);
  EXPECT_EQ(without.ended_short + without.ended_long, 0);
}

TEST(Bridge, NobodyTakesTheShortBranchBeforeItOpens) {
  BridgeExperiment experiment = Minutes(4);
  experiment.lay_trail = false;
  experiment.short_opens_ms = 120'000;
  const BridgeRun run = RunBridge(experiment, 1);
  EXPECT_EQ(ShortShare(run.choices, 0, 120'000), 0.0);
  EXPECT_GT(ShortShare(run.choices, 120'000, 240'000).value_or(0), 0.2);
}

TEST(Bridge, OverTheRadioRobotsGoToAndFroToo) {
  BridgeExperiment experiment = Minutes(2);
  experiment.robots = 4;
  experiment.radio = true;
  const BridgeRun run = RunBridge(experiment, 1);
  EXPECT_GE(run.choices.size(), 8u);
}

TEST(Bridge, TheSameSeedsGiveTheSameBytesHoweverManyThreadsRun) {
  const BridgeExperiment experiment = Minutes(3);
  BridgeSeries one_by_one{experiment, {}};
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    one_by_one.runs.push_back(RunBridge(experiment, seed));
  }
  int told = 0;
  const BridgeSeries series = RunBridges(experiment, 5, [&] { ++told; });
  EXPECT_EQ(told, 5);
  EXPECT_EQ(RunsToCsv({series}), RunsToCsv({one_by_one}));
  EXPECT_EQ(SharesToCsv({series}), SharesToCsv({one_by_one}));
  EXPECT_NE(series.runs[0].state_hash, series.runs[1].state_hash);
}

TEST(BridgeTables, TheShareIsThatOfTheChoicesInTheTime) {
  const std::vector<Choice> choices = {{1000, true, Branch::kShort, 0.5},
                                       {1999, false, Branch::kLong, 0.5},
                                       {2000, true, Branch::kShort, 0.5},
                                       {2500, true, Branch::kShort, 0.5}};
  EXPECT_EQ(ShortShare(choices, 0, 1000), std::nullopt);
  EXPECT_EQ(ShortShare(choices, 1000, 2000), 0.5);
  EXPECT_EQ(ShortShare(choices, 0, 3000), 0.75);
}

TEST(BridgeTables, EightyPercentOfTheLastChoicesDecide) {
  EXPECT_EQ(OutcomeOf(0.8), Outcome::kShort);
  EXPECT_EQ(OutcomeOf(0.79), Outcome::kUndecided);
  EXPECT_EQ(OutcomeOf(0.21), Outcome::kUndecided);
  EXPECT_EQ(OutcomeOf(0.2), Outcome::kLong);
}

TEST(BridgeTables, TheSummaryCountsSpreadsAndBoundsTheProbability) {
  BridgeSeries series;
  for (int i = 0; i < 30; ++i) {
    BridgeRun run;
    run.final_share = i < 18 ? 1 : 0;
    run.outcome = OutcomeOf(run.final_share);
    series.runs.push_back(run);
  }
  const BridgeSummary summary = Summarise(series);
  EXPECT_EQ(summary.ended_short, 18);
  EXPECT_EQ(summary.ended_long, 12);
  EXPECT_NEAR(summary.final_share.mean, 0.6, 1e-12);
  EXPECT_NEAR(summary.final_share.deviation, 0.4983, 1e-4);  // sqrt(30 * 0.24 / 29)
  EXPECT_NEAR(summary.least_probability, 0.4232, 1e-4);      // Wilson's interval of 18 in 30
  EXPECT_NEAR(summary.most_probability, 0.7541, 1e-4);
}

TEST(BridgeTables, TablesHaveALineForEachSeriesRunAndMinute) {
  std::vector<BridgeSeries> all;
  for (const char* name : {"first", "second"}) {
    BridgeExperiment experiment = Minutes(2);
    experiment.name = name;
    all.push_back(RunBridges(experiment, 2));
  }
  EXPECT_EQ(CountOf(BridgeTableHead(), "\n"), 1u);
  EXPECT_EQ(CountOf(BridgeTableRow(all[0]), "\n"), 1u);
  EXPECT_EQ(CountOf(ToCsv(all), "\n"), 3u);
  EXPECT_EQ(CountOf(RunsToCsv(all), "\n"), 5u);
  EXPECT_EQ(CountOf(SharesToCsv(all), "\n"), 5u);
  EXPECT_EQ(CountOf(ChoicesToCsv(all[0]), "\n"), 21u);
  const std::vector<BridgeMoment> moments = {{all[0].experiment, 1, 60'000, Outcome::kShort},
                                             {all[0].experiment, 2, 60'000, Outcome::kLong}};
  const std::string csv = MomentsToCsv(moments);
  EXPECT_EQ(CountOf(csv, ",robot,"), 2u * 8);
  EXPECT_EQ(CountOf(csv, ",food,"), 2u);
  EXPECT_EQ(csv, MomentsToCsv(moments));
}

TEST(BridgeTables, EachExperimentHasANameOfItsOwn) {
  std::vector<std::string> names;
  for (const BridgeExperiment& experiment : BridgeExperiments({})) {
    names.push_back(experiment.name);
  }
  std::sort(names.begin(), names.end());
  EXPECT_EQ(std::adjacent_find(names.begin(), names.end()), names.end());
  EXPECT_GE(names.size(), 20u);
}

}  // namespace
}  // namespace pheromone::swarm
