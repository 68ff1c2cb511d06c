// The configuration of a field: the map, the antennas, the pheromones, and the initial contents of
// the map. All in integers, so that a configuration can be an event of the log.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "server/core/field/geometry.h"
#include "server/core/field/law.h"
#include "server/core/field/obstacles.h"
#include "server/core/field/path.h"

namespace pheromone::field {

constexpr size_t kTypes = kMaxType + 1;  ///< entry 0 of tables stays empty

/// A large immutable value that configurations share. Equal if the contents are equal.
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

/// Pheromone that is deposited node by node, such as an image read from a file. The nodes are on
/// the map, each once.
struct InitialNode {
  NodeIndex node;
  uint32_t level = 0;
  bool operator==(const InitialNode&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("node", it.node);
    visit("level", it.level);
  }
};
struct InitialRaster {
  uint8_t type = 1;
  Shared<std::vector<InitialNode>> nodes;
  bool operator==(const InitialRaster&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("type", it.type, Within(1, kMaxType));
    visit("nodes", it.nodes);
  }
};

/// The positions of a robot's two antennas: p + forward * h(phi) + (distance / 2) * h(phi +-
/// angle), where h is the unit vector of a heading. The paper's pair, eq. (5), is the default:
/// forward 0 and a quarter turn.
struct AntennaGeometry {
  static constexpr int64_t kMaxDistanceUm = 65'000'000;
  static constexpr int64_t kMaxForwardUm = 32'000'000;

  int64_t distance_um = 0;  ///< b
  int64_t forward_um = 0;
  uint16_t angle = 16384;  ///< binary angle
  bool operator==(const AntennaGeometry&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("distance_um", it.distance_um, Within(0, kMaxDistanceUm));
    visit("forward_um", it.forward_um, Within(-kMaxForwardUm, kMaxForwardUm));
    visit("angle", it.angle);
  }
};

struct FieldConfig {
  MapGeometry map;
  AntennaGeometry antennas;
  std::vector<PheromoneLaw> pheromones;
  std::vector<Path> paths;                     ///< predefined trails
  std::vector<InitialRaster> initial_rasters;  ///< and pictures
  Shared<ObstacleMask> obstacles;              ///< none: the paper's open plane
  uint64_t memory_bytes = 0;                   ///< limit for the nodes; beyond it, the map is full
  bool operator==(const FieldConfig&) const = default;

  /// Null if there is no such type.
  const PheromoneLaw* FindLaw(uint8_t type) const;

  static constexpr bool kHashedAlone = true;
  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("map", it.map);
    visit("antennas", it.antennas);
    visit("pheromones", it.pheromones);
    visit("paths", it.paths);
    visit("initial_rasters", it.initial_rasters);
    visit("obstacles", it.obstacles);
    visit("memory_bytes", it.memory_bytes);
  }
};

/// A lower bound of the memory that some of the predefined paths and initial rasters (those
/// selected by the predicates) need.
uint64_t BytesOfLaid(const FieldConfig& config, const std::function<bool(const Path&)>& wanted,
                     const std::function<bool(const InitialRaster&)>& wanted_print);

}  // namespace pheromone::field

/// A flag; if it is 1, the list.
template <typename T>
struct pheromone::FieldCodec<pheromone::field::Shared<std::vector<T>>> {
  using List = field::Shared<std::vector<T>>;

  static void Encode(const List& list, ByteWriter* writer) {
    writer->Flag(static_cast<bool>(list));
    if (list) {
      EncodeFields(*list, writer);
    }
  }
  static void Decode(ByteReader* reader, List* list) {
    *list = {};
    if (reader->Flag()) {
      std::vector<T> items;
      DecodeFields(reader, &items);
      *list = List(std::move(items));
    }
  }
  static uint64_t Hash(const List& list) { return list ? fields::HashList(*list) : 0; }
  static Status Check(const List& list, const std::string& name) {
    return list ? CheckFields(*list, name) : Ok();
  }
  static size_t BytesAtMost(const List& list) {
    return 1 + (list ? pheromone::BytesAtMost(*list) : 0);
  }
  static std::string Describe(std::string_view name, const std::string& indent) {
    return indent + "flag " + std::string(name) + "; if it is 1:\n" +
           fields::Describe<std::vector<T>>(name, indent + "  ", {});
  }
};

/// A flag; if it is 1, the size in nodes and the blocks in which something is blocked, by row and
/// column, each as its 64 words. Each mask has exactly one encoding.
template <>
struct pheromone::FieldCodec<pheromone::field::Shared<pheromone::field::ObstacleMask>> {
  using Mask = field::Shared<field::ObstacleMask>;

  static void Encode(const Mask& mask, ByteWriter* writer);
  static void Decode(ByteReader* reader, Mask* to);
  static uint64_t Hash(const Mask& mask);
  static Status Check(const Mask& mask, const std::string& name);
  static size_t BytesAtMost(const Mask& mask);
  static std::string Describe(std::string_view name, const std::string& indent);
};
