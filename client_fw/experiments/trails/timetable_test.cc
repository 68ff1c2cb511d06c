#include "client_fw/experiments/trails/timetable.h"

#include <gtest/gtest.h>

#include "client_fw/experiments/trails/report.h"
#include "client_fw/experiments/trails/story.h"
#include "client_fw/experiments/trails/testing/shipped_bench.h"

namespace pheromone::swarm {
namespace {

TrailsRun RunOf(const Timetable& timetable, uint64_t seed = 1) {
  Result<TrailsRun> run = RunTimetable(ShippedBench(), timetable, seed);
  EXPECT_TRUE(run.ok()) << run.error();
  return std::move(run).value();
}

Timetable For(int robots, int64_t seconds) {
  Timetable timetable;
  timetable.rules.robots = robots;
  timetable.duration_ms = 1000 * seconds;
  return timetable;
}

TEST(TrailsTimetableTest, TheSameSeedIsTheSameRun) {
  const Timetable timetable = For(4, 600);
  EXPECT_EQ(RunOf(timetable, 3).state_hash, RunOf(timetable, 3).state_hash);
  EXPECT_NE(RunOf(timetable, 3).state_hash, RunOf(timetable, 4).state_hash);
}

TEST(TrailsTimetableTest, NothingIsLostOrRefused) {
  for (const int robots : {1, 2, 4, 7}) {
    const TrailsRun run = RunOf(For(robots, 1800));
    EXPECT_TRUE(IsSound(run)) << ToTable(run);
    EXPECT_EQ(run.own_deposited, run.server.deposited);
    EXPECT_GT(run.ledger.trips(), 10u) << robots;
  }
}

// 10 s in the nest, six lanes of 3 s in the area of P and the source, and its trail twice; to that
// come the eleven tags, with some tenths of a second each.
TEST(TrailsTimetableTest, ARobotAloneTakesTheTimeOfItsWay) {
  Timetable timetable = For(1, 7200);
  timetable.spread = 0;
  const TrailsRun run = RunOf(timetable);
  const auto& deposits = run.ledger.deposits();
  ASSERT_GT(deposits.size(), 10u);
  for (size_t i = 1; i < deposits.size(); ++i) {
    const double way_s = 10 + 6 * 3 + (deposits[i].trail == BenchTrail::kA ? 2 * 20 : 2 * 40);
    const double took_s =
        static_cast<double>(deposits[i].stored_ms - deposits[i - 1].stored_ms) / 1000;
    EXPECT_GT(took_s, way_s);
    EXPECT_LT(took_s, way_s + 11 * 1.5);
  }
}

TEST(TrailsTimetableTest, AStoppedRobotStopsAQueueButNotAParkingPlace) {
  Timetable timetable = For(4, 7200);
  timetable.stop = {0, 1'800'000};
  const TrailsRun queue = RunOf(timetable);
  timetable.parking = true;
  const TrailsRun parking = RunOf(timetable);
  EXPECT_TRUE(IsSound(queue) && IsSound(parking));
  EXPECT_LT(queue.ledger.deposits().back().stored_ms, 2'100'000);
  EXPECT_GT(parking.ledger.deposits().back().stored_ms, 7'000'000);
}

TEST(TrailsTimetableTest, FromASourceThatIsEmptyNothingIsTaken) {
  Timetable timetable = For(3, 7200);
  timetable.robot.capacity = 40;
  timetable.rules.law = petri::EvaporationLaw::kE3;
  timetable.rules.rate_milli = 1000;
  timetable.rules.has_source = true;
  timetable.rules.source = 1030;
  timetable.sample_ms = 1000;
  const TrailsRun run = RunOf(timetable);
  EXPECT_TRUE(IsSound(run)) << ToTable(run);
  EXPECT_EQ(run.ledger.taken(), 1030u);
  EXPECT_EQ(run.server.taken, 1030u);
  EXPECT_EQ(run.ledger.deposited(), 1030u);  // the last ones are of nothing
  EXPECT_EQ(run.samples.back().source_left, 0u);
  EXPECT_EQ(run.samples.back().concentration_milli[0], 0);
  EXPECT_EQ(run.samples.back().concentration_milli[1], 0);
  EXPECT_EQ(run.samples.back().advice, petri::Advice::kAny);
}

// With all advice for one trail, a robot that never explores takes no other.
TEST(TrailsTimetableTest, OnlyRobotsThatExploreLeaveTheAdvisedTrail) {
  Timetable timetable = For(4, 7200);
  timetable.rules.law = petri::EvaporationLaw::kCounter;
  const TrailsRun strict = RunOf(timetable);
  timetable.robot.explore_percent = 20;
  timetable.rules.exploring = true;
  const TrailsRun exploring = RunOf(timetable);
  EXPECT_TRUE(IsSound(strict) && IsSound(exploring));
  const auto lesser = [](const TrailsRun& run) {
    const TrailsSummary summary = Summarise(run);
    return static_cast<double>(std::min(summary.choices[0], summary.choices[1])) /
           static_cast<double>(summary.choices[0] + summary.choices[1]);
  };
  EXPECT_LT(lesser(strict), 0.05);
  EXPECT_GT(lesser(exploring), 0.05);  // every second explorer takes the advised one
}

TEST(TrailsTimetableTest, ExploringInANetThatDoesNotPermitItIsRefused) {
  Timetable timetable = For(4, 3600);
  timetable.robot.explore_percent = 50;
  const TrailsRun run = RunOf(timetable);
  EXPECT_GT(run.ledger.refusals(), 0u);
  EXPECT_FALSE(IsSound(run));
}

TEST(TrailsStoryTest, TheAdviceChangesAsThePaperTells) {
  const Result<TrailsStory> story = TellStory(ShippedBench());
  ASSERT_TRUE(story.ok()) << story.error();
  std::string advice;
  for (const TrailsSample& sample : story.value().samples) {
    const char now = static_cast<char>('0' + static_cast<int>(sample.advice));
    if (advice.empty() || advice.back() != now) {
      advice += now;
    }
  }
  EXPECT_EQ(advice, "01210");  // any until T1, A, B from T2, A from T3, any from T4
  std::string told;
  for (const StoryMark& mark : story.value().marks) {
    told += mark.label + "; ";
  }
  EXPECT_EQ(told,
            "robot 5 reads 00, takes A; robot 1 stores A; T1; robot 6 reads 01, takes A; "
            "robot 2 stores B; robot 3 stores B; T2; robot 7 reads 10, takes B; robot 4 stores A; "
            "T3; T4; ");
}

}  // namespace
}  // namespace pheromone::swarm
