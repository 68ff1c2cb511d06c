// The shipped bench: where its lines and tags are is what keeps robots apart that the nets let
// drive at the same time.
#include "client_fw/experiments/trails/bench.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "client_fw/experiments/trails/testing/shipped_bench.h"

namespace pheromone::swarm {
namespace {

constexpr double kStepM = 0.02;

const std::map<std::string, std::set<int>>& LinesOfTags() {
  static const auto& lines = *new std::map<std::string, std::set<int>>{{"N1", {1}},
                                                                       {"N2", {3}},
                                                                       {"N3", {5}},
                                                                       {"N4", {1, 6}},
                                                                       {"N5", {2}},
                                                                       {"N6", {4}},
                                                                       {"S1", {2}},
                                                                       {"S2", {4}},
                                                                       {"S3", {3}},
                                                                       {"S4", {5}},
                                                                       {"P", {1, 2, 3, 4, 5, 6}},
                                                                       {"Src", {2, 3, 4, 5}}};
  return lines;
}

TEST(TrailsBenchTest, ATagIsReadFromItsOwnLinesOnly) {
  const TrailsBench& bench = ShippedBench();
  for (const BenchTag& tag : bench.tags) {
    for (const auto& [line, its] : bench.lines) {
      if (LinesOfTags().at(tag.name).contains(line)) {
        EXPECT_LT(bench.DistanceFrom(line, tag), 0.02) << tag.name << " and line " << line;
      } else {  // robots are up to 0.1 m off their line
        EXPECT_GT(bench.DistanceFrom(line, tag), tag.range_m + 0.15)
            << tag.name << " and line " << line;
      }
    }
  }
}

// The ways through the areas, from entrance to exit.
struct Way {
  int line;
  const char* from;
  const char* to;
};
constexpr Way kOfP[] = {{1, "N1", "P"}, {2, "P", "N5"}, {4, "P", "N6"},
                        {3, "N2", "P"}, {5, "N3", "P"}, {6, "P", "N4"}};
constexpr Way kOfSource[] = {
    {2, "S1", "Src"}, {4, "S2", "Src"}, {3, "Src", "S3"}, {5, "Src", "S4"}};

TEST(TrailsBenchTest, WhoWaitsAtAnEntranceIsOutOfTheWayOfThoseInTheArea) {
  const TrailsBench& bench = ShippedBench();
  struct Stop {
    int line;
    const char* tag;
  };
  const auto check = [&](const auto& stops, const auto& ways) {
    for (const Stop& stop : stops) {
      const double at_m = bench.AlongOf(stop.line, *bench.FindTag(stop.tag));
      for (const Way& way : ways) {
        if (std::string_view(way.from) == stop.tag) {
          continue;  // its own
        }
        double least_m = 1e9;
        // It stands where the tag is in range: up to 0.3 m before it, or a little behind.
        for (const sim::PlanePose& stands :
             bench.PlacesOn(stop.line, at_m - 0.3, at_m + 0.1, kStepM)) {
          for (const sim::PlanePose& drives :
               bench.PlacesOn(way.line, bench.AlongOf(way.line, *bench.FindTag(way.from)),
                              bench.AlongOf(way.line, *bench.FindTag(way.to)), kStepM)) {
            least_m =
                std::min(least_m, std::hypot(stands.x_m - drives.x_m, stands.y_m - drives.y_m));
          }
        }
        EXPECT_GT(least_m, 2 * kBenchRobotRadiusM + 0.2)
            << stop.tag << " and the way from " << way.from << " to " << way.to;
      }
    }
  };
  const Stop at_p[] = {{1, "N1"}, {3, "N2"}, {5, "N3"}};
  const Stop at_source[] = {{2, "S1"}, {4, "S2"}};
  check(at_p, kOfP);
  check(at_source, kOfSource);
}

TEST(TrailsBenchTest, TrailBIsTwiceAsLong) {
  const TrailsBench& bench = ShippedBench();
  const double a_m =
      bench.LengthBetween(kTrailAOut, "P", "Src") + bench.LengthBetween(kTrailABack, "Src", "P");
  const double b_m =
      bench.LengthBetween(kTrailBOut, "P", "Src") + bench.LengthBetween(kTrailBBack, "Src", "P");
  EXPECT_NEAR(b_m / a_m, 2, 0.1);
}

TEST(TrailsBenchTest, SevenRobotsFindAPlaceInTheNest) {
  const TrailsBench& bench = ShippedBench();
  ASSERT_GE(bench.QueuePlaces(), 7);
  const BenchTag& n1 = *bench.FindTag("N1");
  for (int i = 0; i < 7; ++i) {
    const sim::PlanePose place = bench.QueuePlace(i);
    EXPECT_GT(std::hypot(place.x_m - n1.x_m, place.y_m - n1.y_m), n1.range_m);
    for (int j = 0; j < i; ++j) {
      const sim::PlanePose other = bench.QueuePlace(j);
      EXPECT_GT(std::hypot(place.x_m - other.x_m, place.y_m - other.y_m), 0.7);
    }
  }
}

TEST(TrailsBenchTest, WhatIsMissingIsNamed) {
  const auto error = [](std::string_view text) {
    const Result<TrailsBench> bench = ParseBench(text, "x.toml", std::nullopt);
    return bench.ErrorOr("ok");
  };
  const std::string map =
      "[map]\nwidth_m = 5\nheight_m = 5\ncell_m = 0.1\n[antennas]\nbias_m = 0.3\n"
      "[[link]]\nname = \"a\"\nkind = \"pty\"\npath = \"a.pty\"\n";
  std::string lines;
  for (int type = 1; type <= 6; ++type) {
    lines += "[[pheromone]]\ntype = " + std::to_string(type) +
             "\ncore_m = 0.1\nsigma_m = 0.4\ntau_s = 0\nquantum = 0.5\nmaximum = 0.5\n";
  }
  EXPECT_NE(error(map + lines).find("no [[path]] of pheromone 1"), std::string::npos);
  for (int type = 1; type <= 6; ++type) {
    lines += "[[path]]\npheromone = " + std::to_string(type) + "\npoints_m = [[1, 1], [2, 2]]\n";
  }
  EXPECT_NE(error(map + lines).find("no [[tag]] N1"), std::string::npos);
}

}  // namespace
}  // namespace pheromone::swarm
