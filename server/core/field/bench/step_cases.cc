#include <memory>
#include <utility>

#include "server/core/field/bench/cases.h"
#include "server/core/field/bench/maps.h"

namespace pheromone::field::bench {
namespace {

constexpr int kRobots = 100;
// Before the clock runs, robots drive until their oldest trails are gone: 15 quanta of 16 s are the
// most that a node can hold, and a robot that passes leaves about six.
constexpr int kWarmUpFrames = 120 * kFramesPerSecond;

// Robots on their round, and the time. `map.density_percent` > 0: they drive over a map that is
// full already and hardly evaporates while it is measured, on a short round, so that their own
// trails hardly add to it.
class Drive {
 public:
  explicit Drive(const CaseKey& key)
      : robots_(key.robots),
        poses_(RobotPoses(key.map.nodes, key.robots,
                          key.map.density_percent > 0 ? kPoses / 16 : kPoses, 3)) {}

  const PoseUm& Next() {
    if (++robot_ == robots_) {
      robot_ = 0;
      now_ms_ = kNowMs + 1000 * ++frame_ / kFramesPerSecond;
    }
    return cursor_.Next(poses_);
  }
  uint64_t now_ms() const { return now_ms_; }
  bool frame_begins() const { return robot_ == 0; }

 private:
  int robots_;
  int robot_ = 0;
  uint64_t frame_ = 0;
  uint64_t now_ms_ = kNowMs;
  std::vector<PoseUm> poses_;
  PoseCursor cursor_;
};

PheromoneLaw LawFor(const CaseKey& key) {
  PheromoneLaw law = LawOf(key.reach);
  if (key.map.density_percent > 0) {
    law.tau_ms = 3'600'000;
  }
  return law;
}

// A map with robots on it that lasts over the repetitions of a case.
template <typename Map>
struct World {
  template <typename... Args>
  explicit World(const CaseKey& key, Args&&... args)
      : drive(key), map(std::forward<Args>(args)...) {
    if (key.map.density_percent > 0) {
      Lay(key.map, &map);
    }
    for (int i = 0; i < kWarmUpFrames * key.robots && key.map.density_percent == 0; ++i) {
      const PoseUm& pose = drive.Next();
      map.Deposit(pose.position, 1, drive.now_ms());
    }
  }
  Drive drive;
  Map map;
};

Case FieldStep(CaseKey key) {
  key.variant = kField;
  return {.key = key,
          .run =
              [=](benchmark::State& state) {
                static LastOne<std::string, World<FieldMap>> last;
                auto& [drive, map] = last.Get(key.name(), [&] {
                  return std::make_unique<World<FieldMap>>(key,
                                                           ConfigOf(key.map.nodes, LawFor(key)));
                });
                Field& field = map.field;
                for (auto _ : state) {
                  const PoseUm& pose = drive.Next();
                  const uint64_t now_ms = drive.now_ms();
                  if (drive.frame_begins() && field.NextDeadline().value_or(UINT64_MAX) <= now_ms) {
                    field.Advance(now_ms);
                  }
                  field.Deposit(kType, pose.position, 1, now_ms);
                  benchmark::DoNotOptimize(field.Sense(kType, pose, now_ms));
                }
              },
          .seconds = kFieldSeconds};
}

Case LiteralStep(CaseKey key) {
  key.variant = kLiteralScan;
  return {.key = key,
          .run =
              [=](benchmark::State& state) {
                static LastOne<std::string, World<LiteralMap>> last;
                auto& [drive, map] = last.Get(key.name(), [&] {
                  return std::make_unique<World<LiteralMap>>(key, GeometryOf(key.map.nodes),
                                                             kAntennaDistanceUm, LawFor(key));
                });
                for (auto _ : state) {
                  const PoseUm& pose = drive.Next();
                  for (const PoseUm& facing : {pose, Opposite(pose)}) {
                    map.Deposit(pose.position, 1, drive.now_ms());
                    benchmark::DoNotOptimize(map.Sense(facing, drive.now_ms()));
                  }
                }
              },
          .operations = 2};
}

Case WideStep(CaseKey key, bool skipping) {
  key.variant = skipping ? kSkippingScan : kWideScan;
  return {key, [=](benchmark::State& state) {
            static LastOne<std::string, World<ScannedMap>> last;
            auto& [drive, map] = last.Get(key.name(), [&] {
              return std::make_unique<World<ScannedMap>>(key, GeometryOf(key.map.nodes),
                                                         kAntennaDistanceUm, LawFor(key));
            });
            for (auto _ : state) {
              const PoseUm& pose = drive.Next();
              map.Deposit(pose.position, 1, drive.now_ms());
              benchmark::DoNotOptimize(skipping
                                           ? map.SenseSkipping(BestWide(), pose, drive.now_ms())
                                           : map.Sense(BestWide(), pose, drive.now_ms()));
            }
          }};
}

// A whole frame in each iteration.
Case DenseSweepStep(CaseKey key) {
  key.variant = kDenseSweep;
  return {key,
          [=](benchmark::State& state) {
            Drive drive(key);
            DenseGrid grid(GeometryOf(key.map.nodes), kAntennaDistanceUm, key.reach);
            for (auto _ : state) {
              grid.Evaporate(BestWide(), 0.999f);
              for (int robot = 0; robot < key.robots; ++robot) {
                const PoseUm& pose = drive.Next();
                grid.Stamp(BestWide(), pose.position);
                benchmark::DoNotOptimize(grid.Sense(pose));
              }
            }
          },
          static_cast<double>(key.robots)};
}

}  // namespace

std::vector<Case> RobotStepCases() {
  std::vector<Case> cases;
  const auto add = [&cases](int32_t nodes, double density_percent, int reach, int robots) {
    const CaseKey key{
        kRobotStep, "", {.nodes = nodes, .density_percent = density_percent}, reach, robots};
    cases.push_back(FieldStep(key));
    cases.push_back(LiteralStep(key));
    cases.push_back(WideStep(key, false));
    cases.push_back(WideStep(key, true));
    cases.push_back(DenseSweepStep(key));
  };
  for (const int32_t nodes : {100, 300, 1000, 2000, 4000}) {
    add(nodes, 0, kStandardReach, kRobots);
  }
  for (const double density_percent : {0.1, 1.0, 10.0, 100.0}) {
    add(1000, density_percent, kStandardReach, kRobots);
  }
  for (const int reach : {4, 20}) {
    add(1000, 0, reach, kRobots);
  }
  for (const int robots : {1, 10, 1000}) {
    add(1000, 0, kStandardReach, robots);
  }
  return cases;
}

}  // namespace pheromone::field::bench
