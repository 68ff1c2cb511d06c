// Small worlds for tests.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <utility>

#include "client_fw/lab/behaviours/follow.h"
#include "client_fw/lab/world.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::lab::testing {

/// 10 m x 10 m, pheromone 1 evaporates (tau = 20 s), 2 does not; without groups.
inline WorldConfig SmallWorld() {
  WorldConfig config;
  config.field = engine::testing::SmallConfig().field;
  config.field.pheromones = {engine::testing::Law(1, 20'000), engine::testing::Law(2, 0)};
  config.field.memory_bytes = 64 << 20;
  return config;
}

/// `side` x `side` robots on a lattice, 0.5 m apart, that follow and lay pheromone 1.
inline RobotGroup Lattice(int side, double radius_m = 0.1) {
  RobotGroup group;
  group.name = "lattice";
  group.radius_m = radius_m;
  group.senses = {1};
  group.deposits = 1;
  for (int i = 0; i < side * side; ++i) {
    group.starts.push_back({0.3 + 0.5 * (i % side), 0.3 + 0.5 * (i / side), 2.4 * i});
  }
  client::Settings settings;
  settings.lost_trail = client::LostTrail::kStraight;
  group.behaviour = MakeFollow(settings, 1, group.starts.size());
  return group;
}

/// One robot without a behaviour.
inline RobotGroup Alone(const sim::PlanePose& start) {
  RobotGroup group;
  group.name = "alone";
  group.starts = {start};
  group.senses = {1};
  return group;
}

inline std::unique_ptr<World> Made(WorldConfig config) {
  Result<std::unique_ptr<World>> world = World::Create(std::move(config));
  EXPECT_TRUE(world.ok()) << world.ErrorOr("");
  return world.ok() ? std::move(world).value() : nullptr;
}

}  // namespace pheromone::lab::testing
