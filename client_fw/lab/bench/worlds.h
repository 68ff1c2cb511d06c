// What is measured: robots that follow and lay trails of 0.5 m reach on cells of 0.1 m, as discs of
// 0.1 m that collide, one answer each 0.2 s. All of it follows from the numbers given.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "client_fw/lab/world.h"
#include "server/core/field/bench/baselines.h"

namespace pheromone::lab::bench {

struct Size {
  size_t robots = 1000;
  double square_m_per_robot = 1;
};

std::unique_ptr<World> MakeWorld(const Size& size, int threads);

/// The same at level "firmware": steps of kFirmwareStepMs, eight robots a channel in rounds, 1 % of
/// the frames lost.
constexpr int64_t kFirmwareStepMs = 20;
std::unique_ptr<World> MakeFirmwareWorld(const Size& size, int threads);

/// The same robots, laws, wheels and collisions on a map that is swept in each step: DenseGrid of
/// server/core/field/bench evaporates all cells, robots stamp cones on it and read the cells under
/// their antennas. It answers a poorer question, but that is how such simulators are built.
class DenseWorld {
 public:
  explicit DenseWorld(const Size& size);
  void Step();

 private:
  std::unique_ptr<World> world_;  // whose field stays empty
  field::bench::DenseGrid grid_;
};

}  // namespace pheromone::lab::bench
