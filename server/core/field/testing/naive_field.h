// The oracle of the field: a dense array of all nodes, scanned whole for each antenna, with the
// equations of naive_law.h. Every blocked node is tried for every line of sight.
//
//   NaiveField naive(config, blocked);
//   naive.Deposit(type, point, quanta, now_ms);
//   EXPECT_EQ(field.Sense(type, pose, now_ms), naive.Sense(type, pose, now_ms));
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "server/core/field/config.h"
#include "server/core/field/field.h"
#include "server/core/field/testing/naive_law.h"

namespace pheromone::field::testing {

class NaiveField {
 public:
  explicit NaiveField(const FieldConfig& config, std::vector<NodeIndex> blocked = {})
      : config_(config), blocked_(std::move(blocked)) {
    for (const PheromoneLaw& law : config.pheromones) {
      layers_[law.type].resize(static_cast<size_t>(columns() * rows()));
    }
  }

  /// False, changing nothing, where there is an obstacle.
  bool Deposit(uint8_t type, PointUm point, int64_t quanta, uint64_t now_ms) {
    const NodeIndex at{static_cast<int32_t>(Nearest(point.x - config_.map.origin.x, columns())),
                       static_cast<int32_t>(Nearest(point.y - config_.map.origin.y, rows()))};
    for (const NodeIndex blocked : blocked_) {
      if (blocked == at) {
        return false;
      }
    }
    const PheromoneLaw& law = LawOf(type);
    Node& node = At(type, at);
    node.level =
        std::min<int64_t>(64 * int64_t{law.max_count}, LevelOf(type, at, now_ms) + 64 * quanta);
    node.time_ms = std::max(node.time_ms, now_ms);
    return true;
  }

  int64_t LevelOf(uint8_t type, NodeIndex at, uint64_t now_ms) const {
    const Node& node = layers_.at(type)[IndexOf(at)];
    const uint64_t dt_ms = now_ms > node.time_ms ? now_ms - node.time_ms : 0;
    return node.level == 0 ? 0 : NaiveLevel(LawOf(type), node.level, dt_ms);
  }

  Intensities Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms) const {
    const PointUm antennas[2] = {Antenna(pose, 1), Antenna(pose, -1)};
    const std::vector<int64_t> p = SenseAll(type, pose, antennas, now_ms);
    return {p[0], p[1]};
  }

  std::vector<int64_t> SenseAll(uint8_t type, const PoseUm& pose, std::span<const PointUm> antennas,
                                uint64_t now_ms) const {
    const PheromoneLaw& law = LawOf(type);
    std::vector<int64_t> p;
    for (const PointUm antenna : antennas) {
      Wide total = law.blend.empty() ? Part(law, law.weight_milli, pose, antenna, now_ms) : Wide{0};
      for (const BlendPart& part : law.blend) {
        total += Part(LawOf(part.type), part.weight_milli, pose, antenna, now_ms);
      }
      // 4096 / (1000 * 1 000 000 * 64 * 65 536), rounded once, halves away from zero
      const Wide numerator = Wide{2} * 4096 * (total < 0 ? -total : total);
      const Wide denominator = Wide{2} * 1'000'000'000 * 64 * 65536;
      const auto rounded = static_cast<int64_t>((numerator + denominator / 2) / denominator);
      p.push_back(total < 0 ? -rounded : rounded);
    }
    return p;
  }

  /// The left antenna (`side` = 1) or the right one (-1), eq. (5) and its generalisation.
  PointUm Antenna(const PoseUm& pose, int side) const {
    const AntennaGeometry& geometry = config_.antennas;
    const PointUm ahead = NaiveDirection(pose.heading);
    const PointUm aside = NaiveDirection(pose.heading + side * int64_t{geometry.angle});
    const auto place = [&](int64_t forward, int64_t sideways) {
      const auto f = static_cast<long double>(geometry.forward_um * forward) / 16384;
      const auto b = static_cast<long double>(geometry.distance_um * sideways) / 32768;
      return std::llround(f) + std::llround(b);
    };
    return {pose.position.x + place(ahead.x, aside.x), pose.position.y + place(ahead.y, aside.y)};
  }

 private:
  struct Node {
    int64_t level = 0;
    uint64_t time_ms = 0;
  };

  int64_t columns() const { return config_.map.width_um / config_.map.cell_um + 1; }
  int64_t rows() const { return config_.map.height_um / config_.map.cell_um + 1; }
  size_t IndexOf(NodeIndex node) const {
    return static_cast<size_t>(node.row * columns() + node.column);
  }
  Node& At(uint8_t type, NodeIndex node) { return layers_.at(type)[IndexOf(node)]; }
  PointUm PlaceOf(NodeIndex node) const {
    return {config_.map.origin.x + node.column * config_.map.cell_um,
            config_.map.origin.y + node.row * config_.map.cell_um};
  }

  const PheromoneLaw& LawOf(uint8_t type) const {
    for (const PheromoneLaw& law : config_.pheromones) {
      if (law.type == type) {
        return law;
      }
    }
    std::abort();
  }

  // The nearest of `count` nodes by trying them all, a later one winning a tie.
  int64_t Nearest(int64_t offset_um, int64_t count) const {
    int64_t best = 0;
    for (int64_t i = 1; i < count; ++i) {
      if (std::abs(offset_um - i * config_.map.cell_um) <=
          std::abs(offset_um - best * config_.map.cell_um)) {
        best = i;
      }
    }
    return best;
  }

  bool Sees(PointUm antenna, PointUm source) const {
    for (const NodeIndex blocked : blocked_) {
      if (!NaivePasses(antenna, source, PlaceOf(blocked), config_.map.cell_um)) {
        return false;
      }
    }
    return true;
  }

  // w * Q * S of one substance, in 1/(1000 * 1 000 000 * 64 * 65 536) of a pheromone unit.
  Wide Part(const PheromoneLaw& law, int32_t weight_milli, const PoseUm& pose, PointUm antenna,
            uint64_t now_ms) const {
    const PointUm ahead = NaiveDirection(pose.heading);
    Wide sum = 0;
    for (int32_t row = 0; row < rows(); ++row) {
      for (int32_t column = 0; column < columns(); ++column) {
        const int64_t level = LevelOf(law.type, {column, row}, now_ms);
        if (level == 0) {
          continue;
        }
        const PointUm source = PlaceOf({column, row});
        const PointUm robot = pose.position;
        if (law.directional &&
            (source.x - robot.x) * ahead.x + (source.y - robot.y) * ahead.y < 0) {
          continue;
        }
        const int64_t dx = source.x - antenna.x;
        const int64_t dy = source.y - antenna.y;
        const int64_t mu = NaiveSpread(law, dx * dx + dy * dy);
        if (mu != 0 && Sees(antenna, source)) {
          sum += Wide{level} * mu;
        }
      }
    }
    return Wide{weight_milli} * law.quantum_micro * sum;
  }

  FieldConfig config_;
  std::vector<NodeIndex> blocked_;
  std::map<uint8_t, std::vector<Node>> layers_;
};

}  // namespace pheromone::field::testing
