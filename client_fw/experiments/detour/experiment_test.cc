#include "client_fw/experiments/detour/experiment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/core/field/field.h"

namespace pheromone::swarm {
namespace {

constexpr int kSeeds = 20;

DetourExperiment Experiment(double offset_m, bool with_repellent) {
  DetourExperiment experiment;
  experiment.patch_offset_m = offset_m;
  experiment.sensed_type =
      with_repellent ? DetourExperiment::kWayType : DetourExperiment::kPathType;
  return experiment;
}

double DistanceM(const Sample& sample, field::PointUm point) {
  return std::hypot(sample.pose.x_m - static_cast<double>(point.x) / 1e6,
                    sample.pose.y_m - static_cast<double>(point.y) / 1e6);
}

// How far to the left of the path, from the cross product with its direction.
double LeftOfPathM(const Sample& sample) {
  const field::Path path = PathOfDetour();
  const field::PointUm a = path.points.front();
  const field::PointUm b = path.points.back();
  const double dx = static_cast<double>(b.x - a.x);
  const double dy = static_cast<double>(b.y - a.y);
  return (dx * (sample.pose.y_m - static_cast<double>(a.y) / 1e6) -
          dy * (sample.pose.x_m - static_cast<double>(a.x) / 1e6)) /
         std::hypot(dx, dy);
}

TEST(Detour, GoesRoundTheCoreAndComesBackToThePath) {
  const DetourExperiment experiment = Experiment(0.2, true);
  const field::PointUm centre = PatchCentre(experiment);
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const DetourRun run = MakeDetour(experiment, static_cast<uint64_t>(seed));
    for (const Sample& sample : run.track) {
      ASSERT_GT(DistanceM(sample, centre), experiment.patch_radius_m);
    }
    EXPECT_EQ(run.inside_ms, 0);
    EXPECT_GT(run.least_distance_m, 0.1);
    EXPECT_LT(run.largest_detour_m, 0.5);
    ASSERT_TRUE(run.rejoined_m.has_value());
    EXPECT_LT(*run.rejoined_m, 2);
    EXPECT_GT(run.progress, 0.8);
    EXPECT_GT(run.track.back().along_m, 8.5);  // of 9 m
    for (size_t i = run.track.size() - 10; i < run.track.size(); ++i) {
      EXPECT_LT(std::abs(LeftOfPathM(run.track[i])), DetourRun::kOnPathM);
    }
  }
}

TEST(Detour, WithoutTheRepellentTheSameRunsDriveThrough) {
  const DetourExperiment experiment = Experiment(0.2, false);
  for (int seed = 1; seed <= kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const DetourRun run = MakeDetour(experiment, static_cast<uint64_t>(seed));
    EXPECT_GT(run.inside_ms, 1000);
    EXPECT_LT(run.least_distance_m, -0.05);
    EXPECT_LT(run.largest_detour_m, 0.1);
  }
}

TEST(Detour, PassesOnTheSideWhereThereIsLessOfThePatch) {
  for (const double offset_m : {-0.2, 0.2}) {
    const DetourExperiment experiment = Experiment(offset_m, true);
    const field::PointUm centre = PatchCentre(experiment);
    for (uint64_t seed = 1; seed <= 4; ++seed) {  // each side, each turn of the start
      SCOPED_TRACE(seed);
      const DetourRun run = MakeDetour(experiment, seed);
      const Sample nearest = *std::min_element(run.track.begin(), run.track.end(),
                                               [&](const Sample& a, const Sample& b) {
                                                 return DistanceM(a, centre) < DistanceM(b, centre);
                                               });
      EXPECT_EQ(run.inside_ms, 0);
      EXPECT_LT(LeftOfPathM(nearest) * offset_m, 0);
    }
  }
}

// A law that compares left with right does not see what is the same on both sides.
TEST(Detour, HeadOnTheRepellentIsDrivenThrough) {
  const DetourSummary summary = Summarise(MakeDetours(Experiment(0, true), kSeeds));
  EXPECT_EQ(summary.entered, kSeeds);
  EXPECT_EQ(summary.rejoined, kSeeds);
}

// The default law turns aside where both antennas sense more repellent than attraction, which with
// this weight is at the edge of the patch: it touches the patch, but does not drive through.
TEST(Detour, HeadOnTheDefaultLawTurnsAsideAndComesBack) {
  for (const double offset_m : {0.0, 0.05}) {
    DetourExperiment experiment = Experiment(offset_m, true);
    experiment.duration_ms = 80'000;
    EXPECT_LT(Summarise(MakeDetours(experiment, kSeeds)).least_distance_m, -0.2) << offset_m;
    experiment.law = client::Settings().law;
    const DetourSummary summary = Summarise(MakeDetours(experiment, kSeeds));
    EXPECT_GT(summary.least_distance_m, -0.1) << offset_m;
    EXPECT_GE(summary.rejoined, kSeeds - 1) << offset_m;
  }
}

// Robots that find no way back to the path stand, out of its reach.
TEST(Detour, ARepellentThatPrevailsEarlierIsNotEntered) {
  for (const double offset_m : {-0.1, -0.05, 0.0, 0.05, 0.1}) {
    DetourExperiment experiment = Experiment(offset_m, true);
    experiment.weight = 0.35;
    experiment.law = client::Settings().law;
    experiment.duration_ms = 80'000;
    EXPECT_EQ(Summarise(MakeDetours(experiment, kSeeds)).entered, 0) << offset_m;
  }
}

TEST(Detour, TheMeasuresAreThoseOfTheTrack) {
  const DetourExperiment experiment = Experiment(0.05, true);  // near enough to be driven into
  const field::PointUm centre = PatchCentre(experiment);
  const DetourRun run = MakeDetour(experiment, 3);
  double least_m = 1e9;
  int64_t inside_ms = 0;
  for (const Sample& sample : run.track) {
    least_m = std::min(least_m, DistanceM(sample, centre) - experiment.patch_radius_m);
    inside_ms += DistanceM(sample, centre) < experiment.patch_radius_m ? experiment.sample_ms : 0;
  }
  EXPECT_NEAR(run.least_distance_m, least_m, 1e-12);
  EXPECT_EQ(run.inside_ms, inside_ms);
  EXPECT_GT(inside_ms, 0);
  ASSERT_TRUE(run.rejoined_m.has_value());
  for (const Sample& sample : run.track) {
    if (sample.along_m > experiment.patch_along_m + *run.rejoined_m) {
      EXPECT_LE(std::abs(LeftOfPathM(sample)), DetourRun::kOnPathM);
    }
  }
  const double time_s = static_cast<double>(run.track.back().time_ms) / 1000;
  EXPECT_NEAR(run.progress, (run.track.back().along_m - run.track.front().along_m) / 0.3 / time_s,
              1e-9);
}

TEST(Detour, TheWayIsThePathLessTheWeighedRepellent) {
  const DetourExperiment experiment;
  const field::Field field(EngineConfigOf(experiment).field);
  const field::PointUm centre = PatchCentre(experiment);
  for (int64_t dx = -1'000'000; dx <= 1'000'000; dx += 210'000) {
    const field::PoseUm pose{{centre.x + dx, centre.y - 170'000}, 3641};
    const auto path = field.Sense(DetourExperiment::kPathType, pose, 0);
    const auto repellent = field.Sense(DetourExperiment::kRepellentType, pose, 0);
    const auto way = field.Sense(DetourExperiment::kWayType, pose, 0);
    ASSERT_TRUE(path && repellent && way);
    EXPECT_NEAR(static_cast<double>(way->left),
                static_cast<double>(path->left) - 0.3 * static_cast<double>(repellent->left), 1);
    EXPECT_NEAR(static_cast<double>(way->right),
                static_cast<double>(path->right) - 0.3 * static_cast<double>(repellent->right), 1);
  }
}

TEST(Detour, ARepeatedSeriesIsTheSameToTheByte) {
  const std::vector<DetourSeries> first = {MakeDetours(Experiment(0.2, true), 3)};
  const std::vector<DetourSeries> second = {MakeDetours(Experiment(0.2, true), 3)};
  EXPECT_EQ(ToCsv(first), ToCsv(second));
  EXPECT_EQ(ToTable(first), ToTable(second));
  EXPECT_EQ(TracksToCsv(first), TracksToCsv(second));
  EXPECT_NE(ToCsv(first[0].runs[0].track), ToCsv(first[0].runs[1].track));
}

TEST(Detour, TheMapHasThePathAndTheCore) {
  const std::string csv = MapToCsv(Experiment(0.2, true));
  EXPECT_EQ(csv.find("what,x_m,y_m,radius_m\npath,1.000,2.000,\npath,"), 0u);
  EXPECT_NE(csv.find("\nrepellent,5.160,3.727,0.3\n"), std::string::npos);
}

TEST(Detour, TheTablesHaveALineForEachSeriesAndEachRun) {
  const std::vector<DetourSeries> all = {MakeDetours(Experiment(0.2, false), 2),
                                         MakeDetours(Experiment(0.2, true), 3)};
  const auto lines = [](const std::string& text) {
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines(ToTable(all)), 1 + 2);
  EXPECT_EQ(lines(ToCsv(all)), 1 + 2 + 3);
  // A run that is over before the patch comes has not come back, and has no place where it did.
  DetourExperiment experiment = Experiment(0.2, true);
  experiment.duration_ms = 2000;
  const DetourSeries cut_short = MakeDetours(experiment, 1);
  EXPECT_FALSE(cut_short.runs[0].rejoined_m.has_value());
  EXPECT_NE(ToCsv({cut_short}).find(",0.0,0.0,,"), std::string::npos);  // inside, detour, rejoined
}

}  // namespace
}  // namespace pheromone::swarm
