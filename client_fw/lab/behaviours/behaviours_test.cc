#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <utility>

#include "client_fw/lab/behaviours/forage.h"
#include "client_fw/lab/behaviours/kinds.h"
#include "client_fw/lab/behaviours/walkers.h"
#include "client_fw/lab/testing/worlds.h"

namespace pheromone::lab {
namespace {

using testing::Lattice;
using testing::Made;
using testing::SmallWorld;

void StepTimes(World* world, int steps) {
  for (int step = 0; step < steps; ++step) {
    const Status status = world->Step();
    ASSERT_TRUE(status.ok()) << status.error();
  }
}

RobotGroup Ants(int side, std::shared_ptr<Behaviour> behaviour) {
  RobotGroup group = Lattice(side, 0.05);
  group.behaviour = std::move(behaviour);
  return group;
}

// Every behaviour, with its defaults, acts within its bounds in a crowd with walls around it.
TEST(Behaviours, AllOfTheTableActWithinTheirBounds) {
  std::set<std::string_view> names;
  for (const BehaviourKind& kind : BehaviourKinds()) {
    SCOPED_TRACE(kind.name);
    WorldConfig config = SmallWorld();
    config.sites = {{{2, 2, 0.5, 0, 1, 0}, 0}, {{7, 7, 0.5, 50, 1, 1}, 0}};
    config.groups = {Ants(10, kind.make(DefaultsOf(kind), 100))};
    config.groups[0].senses = {1, 2};
    const auto world = Made(std::move(config));
    StepTimes(world.get(), 100);
    EXPECT_TRUE(names.insert(kind.name).second);
  }
}

TEST(Explore, LeavesTheCornerAndTurnsBackAtTheEdge) {
  WorldConfig config = SmallWorld();
  config.groups = {Ants(4, MakeExplore({}))};
  const auto world = Made(std::move(config));
  StepTimes(world.get(), 1500);
  EXPECT_GT(world->coverage().At(1500).covered, 0.9);
  EXPECT_GT(world->tally().moves.wall_contacts, 20u);
  // Nobody is stuck: standing is turning at walls and robots.
  EXPECT_LT(static_cast<double>(world->tally().moves.standing), 0.25 * 16 * 1500);
}

// The same robots with and without their marks.
TEST(Patrol, MarksSpreadTheVisits) {
  double idle[2] = {};
  for (const bool marks : {false, true}) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      WorldConfig config = SmallWorld();
      config.seed = seed;
      config.field.pheromones[0].sigma_um = 1'000'000;
      PatrolSettings settings;
      settings.walk.quanta = marks ? 1 : 0;
      config.groups = {Ants(3, MakePatrol(settings))};
      const auto world = Made(std::move(config));
      StepTimes(world.get(), 2000);
      idle[marks ? 1 : 0] += world->coverage().At(2000).mean_idle_steps;
    }
  }
  EXPECT_LT(idle[1], 0.9 * idle[0]);
}

// Pheromone 2, which does not evaporate, lies in one corner: robots that meet there stay.
TEST(Aggregate, RobotsGatherWhereMoreIsSensed) {
  WorldConfig config = SmallWorld();
  config.groups = {Ants(8, MakeAggregate({.walk = {}, .wait_s = 120, .half = 0.5}))};
  config.groups[0].senses = {2};
  const auto share_in_corner = [](const World& world) {
    int inside = 0;
    for (size_t i = 0; i < world.robots().count; ++i) {
      inside += world.robots().x_m[i] > 6 && world.robots().y_m[i] > 6 ? 1 : 0;
    }
    return inside / 64.0;
  };
  std::vector<field::InitialNode> nodes;
  for (int32_t column = 60; column <= 100; ++column) {
    for (int32_t row = 60; row <= 100; ++row) {
      nodes.push_back({{column, row}, 64});
    }
  }
  config.field.initial_rasters = {{2, field::Shared(std::move(nodes))}};
  const auto world = Made(std::move(config));
  StepTimes(world.get(), 3000);
  // 16 % of the floor.
  EXPECT_GT(share_in_corner(*world), 0.35);
}

uint64_t DeliveredBy(const ForageSettings& settings, uint64_t seed) {
  WorldConfig config = SmallWorld();
  config.seed = seed;
  config.sites = {{{2, 2, 0.5, 0, 1, 0}, 0}, {{8, 8, 0.5, 10'000, 1, 1}, 0}};
  config.groups = {Ants(5, MakeForage(settings))};
  config.groups[0].senses = {1, 2};
  config.field.pheromones[1].tau_ms = 60'000;
  config.field.pheromones[1].sigma_um = 1'000'000;
  config.field.pheromones[1].max_count = 32;
  const auto world = Made(std::move(config));
  StepTimes(world.get(), 3000);
  const Trips& trips = world->sites().trips();
  EXPECT_EQ(trips.lost, 0u);
  EXPECT_EQ(world->sites().all()[0].amount, static_cast<double>(trips.delivered));
  double carried = 0;
  for (const uint8_t load : world->robots().load) {
    carried += load != 0 ? 1 : 0;
  }
  // No load is made or lost on the way.
  EXPECT_EQ(world->sites().all()[1].amount, 10'000 - carried - world->sites().all()[0].amount);
  return trips.delivered;
}

uint64_t DeliveredInAll(const ForageSettings& settings) {
  return DeliveredBy(settings, 1) + DeliveredBy(settings, 2) + DeliveredBy(settings, 3);
}

TEST(Forage, ATrailBringsMoreHome) {
  const uint64_t without = DeliveredInAll({.quanta = 0});
  EXPECT_GT(without, 20u);
  EXPECT_GT(DeliveredInAll({.quanta = 2}), 2 * without);
}

TEST(Forage, HomeIsFoundSoonerAlongItsPheromone) {
  ForageSettings settings{.quanta = 4, .homing = Homing::kPheromone};
  const uint64_t with = DeliveredInAll(settings);
  settings.fade_s = 0.001;  // leaves none
  EXPECT_GT(static_cast<double>(with), 1.3 * static_cast<double>(DeliveredInAll(settings)));
}

}  // namespace
}  // namespace pheromone::lab
