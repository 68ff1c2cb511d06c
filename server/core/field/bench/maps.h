// Maps and poses for the cases, each kept until another one of its kind is asked for: filling a map
// of 4000 x 4000 nodes takes longer than measuring it.
//
// Not thread-safe.
#pragma once

#include <memory>
#include <vector>

#include "server/core/field/bench/baselines.h"
#include "server/core/field/bench/workload.h"
#include "server/core/field/field.h"
#include "server/core/field/kernel.h"

namespace pheromone::field::bench {

/// The value made last, if it was made for the same key.
template <typename Key, typename Value>
class LastOne {
 public:
  template <typename Make>
  Value& Get(const Key& key, Make make) {
    if (value_ == nullptr || !(key_ == key)) {
      value_.reset();  // first, so that never two are in memory
      value_ = make();
      key_ = key;
    }
    return *value_;
  }

 private:
  Key key_{};
  std::unique_ptr<Value> value_;
};

/// A field with the deposits in every type except blends.
struct FieldMap {
  explicit FieldMap(const FieldConfig& config, const Kernel& kernel = BestKernel())
      : field(config, kernel) {}
  void Deposit(PointUm point, uint16_t quanta, uint64_t now_ms) {
    for (const PheromoneLaw& law : field.config().pheromones) {
      if (!law.is_blend()) {
        field.Deposit(law.type, point, quanta, now_ms);
      }
    }
  }
  Field field;
};

struct FieldSpec {
  FieldConfig config;
  MapSpec map;
  const Kernel* kernel = &BestKernel();
  bool operator==(const FieldSpec&) const = default;
};

inline Field& FilledField(const FieldSpec& spec) {
  static LastOne<FieldSpec, FieldMap> last;
  return last
      .Get(spec,
           [&] {
             auto made = std::make_unique<FieldMap>(spec.config, *spec.kernel);
             Lay(spec.map, made.get());
             return made;
           })
      .field;
}

/// A LiteralMap or a ScannedMap.
template <typename Map>
Map& FilledMap(const MapSpec& spec, int reach) {
  static LastOne<MapSpec, Map> last;
  Map& map = last.Get(spec, [&] {
    auto made = std::make_unique<Map>(GeometryOf(spec.nodes), kAntennaDistanceUm, LawOf(reach));
    Lay(spec, made.get());
    return made;
  });
  map.set_law(LawOf(reach));
  return map;
}

/// So many that no query of a case comes from a place that the caches remember.
constexpr size_t kPoses = size_t{1} << 20;

inline const std::vector<PoseUm>& ManyPoses(int32_t nodes) {
  static LastOne<int32_t, std::vector<PoseUm>> last;
  return last.Get(
      nodes, [&] { return std::make_unique<std::vector<PoseUm>>(RandomPoses(nodes, kPoses, 1)); });
}

/// The same place, facing backwards. What the literal scan costs is proportional to the part of the
/// map that lies ahead; a pose and its opposite have all of it ahead between them, so that a few
/// queries make a fair mean.
inline PoseUm Opposite(PoseUm pose) {
  pose.heading = static_cast<uint16_t>(pose.heading + 32768);
  return pose;
}

/// One pose after the other, and again from the first.
class PoseCursor {
 public:
  const PoseUm& Next(const std::vector<PoseUm>& poses) {
    next_ = next_ + 1 < poses.size() ? next_ + 1 : 0;
    return poses[next_];
  }

 private:
  size_t next_ = 0;
};

}  // namespace pheromone::field::bench
