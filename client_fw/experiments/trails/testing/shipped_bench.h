// The bench that is shipped, deploy/examples/bench.toml.
#pragma once

#include <gtest/gtest.h>

#include "client_fw/experiments/trails/bench.h"

namespace pheromone::swarm {

inline const TrailsBench& ShippedBench() {
  static const TrailsBench& bench = *[] {
    Result<TrailsBench> loaded = LoadBench(PHEROMONE_SOURCE_DIR "/deploy/examples/bench.toml");
    EXPECT_TRUE(loaded.ok()) << loaded.error();
    return new TrailsBench(std::move(loaded).value());
  }();
  return bench;
}

}  // namespace pheromone::swarm
