#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <utility>
#include <vector>

#include "client_fw/lab/firmware/firmware_swarm.h"
#include "client_fw/lab/testing/worlds.h"
#include "client_fw/lab/worker_pool.h"

namespace pheromone::lab {
namespace {

using testing::Lattice;
using testing::Made;
using testing::SmallWorld;

// 625 robots in three slices, crowded, with errors of odometry and fixes.
WorldConfig Crowd(int threads) {
  WorldConfig config = SmallWorld();
  config.field.map.width_um = config.field.map.height_um = 13'000'000;
  config.threads = threads;
  config.seed = 5;
  RobotGroup group = Lattice(25, 0.2);
  group.odometry = {.bias = 0.01, .noise = 0.05, .slip = 0.1};
  group.fixes = {.period_ms = 1000, .sigma_m = 0.02};
  config.groups = {group};
  return config;
}

TEST(Threads, AnyNumberOfThemGivesTheSameWorld) {
  std::vector<uint64_t> hashes;
  for (int threads = 1; threads <= 3; ++threads) {
    const auto world = Made(Crowd(threads));
    for (int step = 0; step < 30; ++step) {
      ASSERT_TRUE(world->Step().ok());
    }
    hashes.push_back(world->Hash());
    // What was to be told apart happened.
    EXPECT_GT(world->tally().moves.robot_contacts, 50u);
    EXPECT_GT(world->tally().deposited_quanta, 10'000u);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Threads, APhaseAfterTheOtherGivesTheSameWorld) {
  const auto steps = Made(Crowd(2));
  const auto phases = Made(Crowd(1));
  for (int step = 0; step < 10; ++step) {
    ASSERT_TRUE(steps->Step().ok());
    for (const World::Phase phase : World::kPhases) {
      ASSERT_TRUE(phases->Run(phase).ok());
    }
    ASSERT_EQ(steps->Hash(), phases->Hash()) << step;
  }
}

// 600 robots in three slices, on channels that lose frames; the engine is one thread's.
TEST(Threads, FirmwareDoesTheSameWithAnyNumberOfThem) {
  std::vector<uint64_t> hashes;
  for (int threads = 1; threads <= 3; ++threads) {
    WorldConfig config = SmallWorld();
    config.step_ms = 20;
    config.threads = threads;
    FirmwareConfig firmware;
    config.field.map.width_um = config.field.map.height_um = 13'000'000;
    firmware.engine.field = config.field;
    client::Parameters robot;
    robot.lay_trail = true;
    firmware.robots.assign(600, robot);
    firmware.radio = {.robots_per_channel = 16, .lost_percent = 1};
    RobotGroup group = Lattice(25, 0);
    group.starts.resize(600);
    group.senses.clear();
    group.behaviour = FirmwareSwarm::Create(std::move(firmware)).value();
    config.groups = {group};
    const auto world = Made(std::move(config));
    for (int step = 0; step < 100; ++step) {
      ASSERT_TRUE(world->Step().ok());
    }
    hashes.push_back(world->Hash());
    EXPECT_GT(world->tally().deposited_quanta, 1000u);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Threads, EachPortionIsDoneOnceAndSeenByAllAfterwards) {
  WorkerPool pool(3);
  for (int round = 0; round < 200; ++round) {
    std::vector<int> done(97);
    std::atomic<int> wrong{0};
    Portions portions(done.size());
    pool.Run([&](int /*worker*/) {
      portions.Work([&](size_t i) { ++done[i]; });
      portions.Await();
      for (const int times : done) {
        wrong += times == 1 ? 0 : 1;
      }
    });
    ASSERT_EQ(wrong, 0);
  }
}

}  // namespace
}  // namespace pheromone::lab
