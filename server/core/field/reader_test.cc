// Readers beside the writer: what they see is plausible while tiles, leaves and configurations come
// and go under them. Under ThreadSanitizer, that no access races. All threads end by counting.

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "server/core/field/field.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::Between;
using testing::BytesOf;
using testing::HashFromADump;
using testing::OneIn;
using testing::Random;
using testing::RandomPoint;
using testing::RandomPose;
using testing::TrailConfig;
using testing::TrailLaw;

constexpr int kReaders = 3;

TEST(FieldReader, SeesWhatTheFieldSees) {
  Field field(TrailConfig());
  const FieldReader reader(field);
  ASSERT_TRUE(reader.ok());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 0);
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  EXPECT_EQ(reader.Sense(1, pose, 0), field.Sense(1, pose, 0));
  EXPECT_EQ(reader.Sense(1, pose, 70'000), field.Sense(1, pose, 70'000));
  SenseError error = SenseError::kNone;
  EXPECT_FALSE(reader.Sense(2, pose, 0, &error).has_value());
  EXPECT_EQ(error, SenseError::kUnknownPheromone);
  int nodes = 0;
  reader.VisitLevels(1, 0, [&](NodeIndex node, uint32_t level) {
    EXPECT_EQ(node, (NodeIndex{50, 52}));
    EXPECT_EQ(level, 8 * kLevelsPerQuantum);
    ++nodes;
  });
  reader.VisitLevels(2, 0, [&](NodeIndex, uint32_t) { ++nodes; });
  EXPECT_EQ(nodes, 1);
}

TEST(FieldReader, AnswersManyAsItAnswersEach) {
  Field field(TrailConfig());
  Random random(21);
  for (int i = 0; i < 3'000; ++i) {
    field.Deposit(1, RandomPoint(random, field.config().map), 8, 0);
  }
  const FieldReader reader(field);
  std::vector<PoseUm> poses;
  poses.reserve(200);
  for (int i = 0; i < 200; ++i) {
    poses.push_back(RandomPose(random, field.config().map));
  }
  poses[7].position.x = -1;  // off the map: no answer, and the others have theirs
  std::vector<std::optional<Intensities>> answers(poses.size());
  reader.SenseEach(1, poses, 500, answers);
  EXPECT_FALSE(answers[7].has_value());
  int telling = 0;
  for (size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(answers[i], field.Sense(1, poses[i], 500)) << i;
    telling += answers[i] && answers[i]->left > 0 && answers[i]->right > 0 ? 1 : 0;
  }
  EXPECT_GE(telling, 150);
}

TEST(FieldReader, SaysWhenThereIsNoPlaceLeft) {
  const Field field(TrailConfig());
  std::vector<std::unique_ptr<FieldReader>> readers;
  for (size_t i = 0; i < Reclaimer::kReaders; ++i) {
    readers.push_back(std::make_unique<FieldReader>(field));
    ASSERT_TRUE(readers.back()->ok());
  }
  EXPECT_FALSE(FieldReader(field).ok());
  readers.pop_back();
  EXPECT_TRUE(FieldReader(field).ok());
}

// Whoever follows the changes alone has, at the end, what there is: none was missed, whenever he
// looked.
TEST(FieldReader, WhoeverFollowsTheChangesHasTheMap) {
  FieldConfig config = TrailConfig();
  config.map.width_um = 30'000'000;  // 301 x 101 nodes, three leaves
  config.pheromones[0].tau_ms = 0;
  Field field(config);
  std::atomic<bool> done{false};
  using Levels = std::map<NodeIndex, uint32_t>;
  std::vector<Levels> copies(kReaders);
  std::vector<int> parts(kReaders);
  std::vector<std::thread> readers;
  for (size_t i = 0; i < kReaders; ++i) {
    readers.emplace_back([&, i] {
      const FieldReader reader(field);
      Levels& copy = copies[i];
      uint64_t since = 0;
      const NodeArea all{{0, 0}, {301, 101}};
      for (bool last = false; !last;) {
        last = done.load();
        std::vector<NodeArea> changed;
        since =
            reader
                .VisitChanged(1, all, since, [&](const NodeArea& part) { changed.push_back(part); })
                .number;
        for (const NodeArea& part : changed) {
          std::erase_if(copy, [&](const auto& it) { return part.Contains(it.first); });
          reader.VisitLevels(1, part, 0,
                             [&](NodeIndex node, uint32_t level) { copy[node] = level; });
          ++parts[i];
        }
      }
    });
  }
  Random random(78);
  for (int i = 0; i < 20'000; ++i) {
    const PointUm point{Between(random, 0, 9) * 3'000'000 + Between(random, 0, 400'000),
                        Between(random, 0, 3) * 3'000'000 + Between(random, 0, 400'000)};
    FieldEdit edit;
    edit.points = {point, {point.x + 500'000, point.y + 500'000}};
    edit.action = FieldEdit::Action::kErase;
    edit.shape = OneIn(random, 2'000) ? FieldEdit::Shape::kAll : FieldEdit::Shape::kRectangle;
    if (OneIn(random, 4)) {
      EXPECT_TRUE(field.Edit(edit, 0).ok());
    } else {
      field.Deposit(1, point, 1, 0);
    }
    if (i % 64 == 0) {
      field.ReleaseMemory();
    }
  }
  done = true;
  for (std::thread& reader : readers) {
    reader.join();
  }
  Levels expected;
  field.VisitLevels(1, 0, [&](NodeIndex node, uint32_t level) { expected[node] = level; });
  EXPECT_FALSE(expected.empty());
  for (size_t i = 0; i < kReaders; ++i) {
    EXPECT_EQ(copies[i], expected) << "reader " << i;
    EXPECT_GT(parts[i], 0);
  }
}

// The highest of anything that the writer below ever does.
constexpr uint16_t kMaxQuanta = 8;
constexpr int64_t kMaxQuantumMicro = 250'000;

// A small map that is always nearly full of short trails, so that tiles are retired and handed out
// again all the time.
FieldConfig BusyConfig() {
  FieldConfig config = TrailConfig();
  config.map.width_um = 30'000'000;  // 301 x 101 nodes, three leaves
  config.pheromones[0].tau_ms = 40;
  config.pheromones[0].max_count = kMaxQuanta;
  config.pheromones.push_back(TrailLaw());
  config.pheromones[1].type = 2;
  config.pheromones[1].evaporation = Evaporation::kExponential;
  config.pheromones[1].profile = Profile::kGaussian;
  config.pheromones[1].core_um = 0;
  config.pheromones[1].sigma_um = 200'000;
  config.pheromones[1].cutoff_um = 600'000;
  config.pheromones[1].tau_ms = 20;
  PheromoneLaw blend;
  blend.type = 3;
  blend.blend = {{1, 1000}, {2, 1000}};
  config.pheromones.push_back(blend);
  config.memory_bytes = 2 * BytesOf(config.map, 40, 3);
  return config;
}

// One of a few configurations that a field may go to from any other.
FieldConfig RandomBusyConfig(Random& random) {
  FieldConfig config = BusyConfig();
  config.pheromones[0].tau_ms = Between(random, 20, 60);
  config.pheromones[0].quantum_micro = OneIn(random, 2) ? 125'000 : kMaxQuantumMicro;
  config.pheromones[1].directional = OneIn(random, 2);
  if (OneIn(random, 2)) {
    config.paths = {{.type = 1, .count = 4, .points = {{1'000'000, 3'000'000}, {2'000'000, 0}}}};
  }
  if (OneIn(random, 2)) {
    ObstacleMask mask(config.map.columns(), config.map.rows());
    mask.BlockRow(50, 10, 200);
    config.obstacles = Shared<ObstacleMask>(std::move(mask));
  }
  return config;
}

// P where every node in reach holds the most at full strength.
int64_t MostIntensity(const FieldConfig& config, int parts) {
  const int64_t side = 2 * int64_t{600'000} / config.map.cell_um + 1;
  return int64_t{parts} * side * side * kMaxQuanta * kMaxQuantumMicro * 4096 / 1'000'000;
}

struct Seen {
  int64_t something = 0;
  int64_t nodes = 0;
};

// Looks until the writer is done, and so many times at least.
Seen Look(const Field& field, const std::atomic<uint64_t>& now_ms, const std::atomic<bool>& done,
          int rounds, uint64_t seed) {
  Random random(seed);
  const FieldReader reader(field);
  EXPECT_TRUE(reader.ok());
  const MapGeometry map = BusyConfig().map;
  Seen seen;
  for (int i = 0; i < rounds || !done.load(); ++i) {
    const auto type = static_cast<uint8_t>(Between(random, 1, 3));
    const auto p = reader.Sense(type, RandomPose(random, map), now_ms.load());
    const int64_t most = MostIntensity(BusyConfig(), type == 3 ? 2 : 1);
    if (!p.has_value() || p->left < 0 || p->right < 0 || p->left > most || p->right > most) {
      ADD_FAILURE() << "implausible";
      break;
    }
    seen.something += p->left != 0 || p->right != 0 ? 1 : 0;
    if (i % 16 == 0) {
      reader.VisitLevels(type, now_ms.load(), [&](NodeIndex node, uint32_t level) {
        EXPECT_TRUE(node.column >= 0 && node.column < map.columns());
        EXPECT_TRUE(node.row >= 0 && node.row < map.rows());
        EXPECT_TRUE(level != 0 && level <= uint32_t{kMaxQuanta} * kLevelsPerQuantum);
        ++seen.nodes;
      });
    }
  }
  return seen;
}

TEST(FieldReader, LooksOnWhileTheFieldChanges) {
  Random random(77);
  Field field(BusyConfig());
  std::atomic<uint64_t> now_ms{1'000};
  std::atomic<bool> done{false};
  std::vector<Seen> seen(kReaders);
  std::vector<std::thread> readers;
  for (size_t i = 0; i < kReaders; ++i) {
    readers.emplace_back([&, i] { seen[i] = Look(field, now_ms, done, 4'000, i); });
  }
  int refused = 0;
  PointUm robot;
  for (int i = 0; i < 60'000; ++i) {
    const uint64_t now = now_ms.fetch_add(random() % 2) + 1;
    const auto type = static_cast<uint8_t>(Between(random, 1, 2));
    robot = OneIn(random, 8) ? RandomPoint(random, field.config().map)
                             : PointUm{robot.x + Between(random, -50'000, 50'000),
                                       robot.y + Between(random, 0, 9)};
    const auto quanta = static_cast<uint16_t>(Between(random, 1, kMaxQuanta));
    refused += field.Deposit(type, robot, quanta, now) == DepositResult::kMapFull ? 1 : 0;
    if (field.NextDeadline().value_or(UINT64_MAX) <= now) {
      field.Advance(now);
    }
    if (i % 500 == 0) {
      const FieldConfig next = RandomBusyConfig(random);
      if (field.CheckReconfigure(next, now).ok()) {
        field.Reconfigure(next, now);
      }
    }
    if (i % 777 == 0) {
      FieldEdit edit;
      edit.type = type;
      edit.shape = FieldEdit::Shape::kAll;
      edit.action = FieldEdit::Action::kErase;
      EXPECT_TRUE(field.Edit(edit, now).ok());
    }
  }
  done = true;
  for (std::thread& reader : readers) {
    reader.join();
  }
  for (const Seen& it : seen) {
    EXPECT_GT(it.something, 0);
    EXPECT_GT(it.nodes, 0);
  }
  EXPECT_EQ(field.hash(), HashFromADump(field));
  EXPECT_GT(refused, 0) << "the map was never full";
}

// Places are taken and given back by many threads at once.
TEST(FieldReader, ComesAndGoesInManyThreads) {
  Field field(TrailConfig());
  std::vector<std::thread> threads;
  threads.reserve(kReaders);
  for (int t = 0; t < kReaders; ++t) {
    threads.emplace_back([&field, t] {
      for (int i = 0; i < 500; ++i) {
        const FieldReader reader(field);
        ASSERT_TRUE(reader.ok());
        ASSERT_TRUE(reader.Sense(1, {{t * int64_t{1'000'000}, 5'000'000}, 0}, 0).has_value());
      }
    });
  }
  for (uint64_t i = 0; i < 2'000; ++i) {
    field.Deposit(1, {static_cast<int64_t>(i * 4'987 % 10'000'000), 5'000'000}, 1, 10'000 * i);
    field.Advance(10'000 * i);
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
}

}  // namespace
}  // namespace pheromone::field
