#include "server/core/tags/store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

namespace pheromone::tags {
namespace {

constexpr int64_t kClockS = 1'138'458'000;  // 2006-01-28T14:20:00Z

// Of ten names, those that a random mask selects.
Settings RandomSettings(std::mt19937* random) {
  Settings settings;
  const auto mask = (*random)();
  for (int i = 0; i < 10; ++i) {
    if ((mask >> i & 1u) != 0) {
      settings.tags.push_back({"tag-" + std::to_string(i), i * 1'000'000, 0, 500'000,
                               static_cast<uint8_t>(1 + (*random)() % 4)});
    }
  }
  return settings;
}

Figures CountedAnew(const Store& store) {
  Figures figures;
  for (uint16_t number = 1; number <= store.last_number(); ++number) {
    if (const NamedTag* const it = store.Find(number)) {
      ++(store.PlaceOf(number) != nullptr ? figures.configured : figures.unconfigured);
      for (const Slot& slot : it->tag.slots()) {
        ++figures.slots;
        figures.blocks += slot.block.author != 0;
        figures.leased += slot.lease_end_ms != 0;
      }
    }
  }
  figures.definitions = store.symbols().rows().size();
  return figures;
}

TEST(StoreTest, FiguresAreWhatIsCountedAnew) {
  std::mt19937 random(1);
  Store store;
  uint64_t now_ms = 0;
  Figures most;
  for (int step = 0; step < 20'000; ++step) {
    now_ms += random() % 100;
    const auto number = static_cast<uint16_t>(1 + random() % 10);
    const auto slot = static_cast<uint8_t>(random() % 4);
    const auto author = static_cast<int32_t>(1 + random() % 3);
    switch (random() % 16) {
      case 0: {
        const Settings settings = RandomSettings(&random);
        if (store.Check(settings).ok()) {
          store.Configure(settings);
        }
        break;
      }
      case 1:
        store.Define({RowKind::kRobot, author, author, "robot-" + std::to_string(author)});
        break;
      case 2:
        store.Expire(now_ms, 2);
        break;
      case 3:
      case 4:
        if (store.Find(number) != nullptr) {
          store.Erase(number, slot, author, {});
        }
        break;
      default:
        if (store.Find(number) != nullptr) {
          const Block block = {
              author, static_cast<uint32_t>(kClockS), {-17, author}, {1, 2}, {-3, step}};
          store.Write(number, {.block = block, .lease_ms = random() % 2 == 0 ? 0u : 1000u}, now_ms,
                      kClockS);
        }
    }
    const Figures found = store.figures();
    ASSERT_EQ(found, CountedAnew(store)) << "step " << step;
    most.unconfigured = std::max(most.unconfigured, found.unconfigured);
    most.leased = std::max(most.leased, found.leased);
  }
  EXPECT_GT(most.unconfigured, 2u);
  EXPECT_GT(most.leased, 2u);
  const Store copy = store;
  EXPECT_EQ(copy.figures(), store.figures());
}

TEST(StoreTest, APlanHoldsWhileWhatGoesIsNotWrittenOn) {
  Store store;
  store.Configure({.tags = {{"door", 0, 0, 1, 8}, {"plant", 0, 0, 1, 2}, {"lamp", 0, 0, 1, 2}}});
  store.Define({RowKind::kRobot, 1, 1, "one"});
  const WriteRequest note = {
      .block = {1, static_cast<uint32_t>(kClockS), {-17, 1}, {1, 2}, {-3, 1}}};
  store.Write(3, note, 0, kClockS);
  const Settings settings = {.tags = {{"new", 5, 0, 1, 3}, {"door", 7, 0, 1, 4}}};
  const Result<Plan> plan = MakePlan(store.Look(), settings);
  ASSERT_TRUE(plan.ok());
  EXPECT_TRUE(store.IsCurrent(plan.value()));
  store.Write(1, note, 0, kClockS);
  EXPECT_TRUE(store.IsCurrent(plan.value()));
  store.Write(2, note, 0, kClockS);
  EXPECT_FALSE(store.IsCurrent(plan.value())) << "plant would be kept now";
  store.Clear(2, 0);
  EXPECT_TRUE(store.IsCurrent(plan.value()));
  store.Clear(3, 0);
  EXPECT_FALSE(store.IsCurrent(plan.value())) << "lamp would be forgotten now";
  store.Write(3, note, 0, kClockS);
  ASSERT_TRUE(store.IsCurrent(plan.value()) && store.Check(plan.value()).ok());
  store.Take(plan.value());
  EXPECT_EQ(store.NumberOf("new"), 2) << "the first free number";
  EXPECT_EQ(store.NumberOf("plant"), std::nullopt);
  EXPECT_EQ(store.NumberOf("lamp"), 3);
  EXPECT_EQ(store.PlaceOf(1)->x_um, 7);
  EXPECT_EQ(store.InRange(5, 0), std::vector<uint16_t>{2});
  EXPECT_EQ(store.figures(), (Figures{2, 1, 9, 2, 0, 1}));
  EXPECT_FALSE(store.IsCurrent(plan.value()));
}

TEST(StoreTest, FiguresAreRestored) {
  const Settings settings = {.tags = {{"door", 0, 0, 1, 8}, {"plant", 0, 0, 1, 2}}};
  Store store;
  store.Configure(settings);
  store.Define({RowKind::kRobot, 1, 1, "one"});
  const Block block = {1, static_cast<uint32_t>(kClockS), {-17, 1}, {1, 2}, {-3, 1}};
  store.Write(1, {.block = block}, 0, kClockS);
  store.Write(1, {.block = block, .lease_ms = 1000}, 0, kClockS);
  ByteWriter writer;
  store.Save(&writer);
  ByteReader reader(writer.bytes());
  Store same;
  same.Restore(settings, &reader);
  ASSERT_TRUE(reader.ok()) << reader.error();
  EXPECT_EQ(same.figures(), (Figures{2, 0, 10, 2, 1, 1}));
}

}  // namespace
}  // namespace pheromone::tags
