// What a field is made of: the map, the antennas, the pheromones, and what lies on the map before
// any robot moves. All in integers, so that a configuration can be an event of the log.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "server/field/geometry.h"
#include "server/field/law.h"
#include "server/field/obstacles.h"
#include "server/field/path.h"

namespace pheromone::field {

constexpr size_t kTypes = 16;  ///< types are 1-15; entry 0 of tables stays empty

/// Something large that configurations share and never change. Equal when the content is.
template <typename T>
class Shared {
 public:
  Shared() = default;
  explicit Shared(T content) : content_(std::make_shared<const T>(std::move(content))) {}
  explicit operator bool() const { return content_ != nullptr; }
  const T& operator*() const { return *content_; }
  const T* operator->() const { return content_.get(); }
  bool operator==(const Shared& other) const {
    return content_ == other.content_ ||
           (content_ != nullptr && other.content_ != nullptr && *content_ == *other.content_);
  }

 private:
  std::shared_ptr<const T> content_;
};

/// Pheromone that is laid node by node, such as a picture read from a file. The nodes lie on the
/// map, each once.
struct PrintNode {
  NodeIndex node;
  uint32_t level = 0;
  bool operator==(const PrintNode&) const = default;
};
struct Print {
  uint8_t type = 1;
  Shared<std::vector<PrintNode>> nodes;
  bool operator==(const Print&) const = default;
};

/// Where a robot's two antennas sit: at p + forward * h(phi) + (distance / 2) * h(phi +- angle),
/// where h is the unit vector of a heading. The paper's pair, eq. (5), is the default: forward 0
/// and a quarter turn.
struct AntennaGeometry {
  int64_t distance_um = 0;  ///< b
  int64_t forward_um = 0;
  uint16_t angle = 16384;  ///< binary angle
  bool operator==(const AntennaGeometry&) const = default;
};

struct FieldConfig {
  MapGeometry map;
  AntennaGeometry antennas;
  std::vector<PheromoneLaw> pheromones;
  std::vector<Path> paths;         ///< predefined trails
  std::vector<Print> prints;       ///< and pictures
  Shared<ObstacleMask> obstacles;  ///< none: the paper's open plane
  uint64_t memory_bytes = 0;       ///< what the nodes may occupy; beyond it, the map is full
  bool operator==(const FieldConfig&) const = default;

  /// Null if there is no such type.
  const PheromoneLaw* FindLaw(uint8_t type) const;
};

/// The memory that some of the predefined paths and prints (those that `wanted` picks by
/// themselves) take at the least.
uint64_t BytesOfLaid(const FieldConfig& config, const std::function<bool(const Path&)>& wanted,
                     const std::function<bool(const Print&)>& wanted_print);

}  // namespace pheromone::field
