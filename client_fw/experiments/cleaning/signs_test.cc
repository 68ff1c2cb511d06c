// What a cleaning robot understands of what others have left on the tags, and of its own earlier
// life: the real firmware, radio and engine.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"

namespace pheromone::swarm {
namespace {

using engine::TagsChanged;
using tags::RowKind;

constexpr int64_t kZoneUm = 1'000'000;
constexpr int32_t kOther = 77;  // a robot of another make
constexpr uint32_t kLeaseMs = 30'000;

class CleaningSignsTest : public testing::Test {
 protected:
  // Two zones beside each other, and a robot in the first.
  static SimulationConfig TwoZones() {
    SimulationConfig config;
    config.engine = EngineConfigOf(PathExperiment());
    config.engine.tags.tags = {{"left", kZoneUm / 2, kZoneUm, kZoneUm * 12 / 10},
                               {"right", kZoneUm * 3 / 2, kZoneUm, kZoneUm * 12 / 10}};
    config.robot.client.id = 1;
    config.robot.client.boot_counter = 100;
    config.robot.client.type = 2;
    client::PrepareForCleaning(&config.robot.client);
    config.robot.start = {0.5, 1, 0};
    config.robot.cleaner = client::CleanerParameters{.cleaning_ms = 2000, .lease_s = 6};
    return config;
  }

  void Change(const TagsChanged& change) {
    std::vector<engine::Outgoing> out;
    const auto submitted = simulation_.service().Submit(change, &out);
    ASSERT_TRUE(submitted.ok()) << submitted.error();
  }

  void Define(RowKind kind, int32_t robot, int32_t number, const std::string& text) {
    Change({TagsChanged::Define{{kind, robot, number, text}}});
  }

  // On the tag of the first zone: it is so since `number` words say so.
  void Sign(int32_t author, int32_t name_space, int32_t number, uint32_t lease_ms) {
    Change(
        {TagsChanged::Write{.tag = 1,
                            .lease_ms = lease_ms,
                            .block = {author, 0, {-18, 1}, {name_space, number}, {-17, author}}}});
  }

  // Which zones it has cleaned until then; 0: none.
  std::vector<uint16_t> CleanedUntil(int64_t ms) {
    std::vector<uint16_t> zones;
    const client::Cleaner& cleaner = *simulation_.robot().cleaner();
    bool before = false;
    while (simulation_.now_ms() < ms) {
      simulation_.RunTo(simulation_.now_ms() + 1);
      if (cleaner.is_cleaning() && !before) {
        zones.push_back(cleaner.target());
      }
      before = cleaner.is_cleaning();
    }
    return zones;
  }

  static bool Has(const std::vector<uint16_t>& zones, uint16_t zone) {
    return std::find(zones.begin(), zones.end(), zone) != zones.end();
  }

  Simulation simulation_{TwoZones()};
};

TEST_F(CleaningSignsTest, ASignOfAnotherMakeIsUnderstood) {
  Define(RowKind::kRobot, kOther, kOther, "sweeper");
  Define(RowKind::kString, kOther, 40, "http://robots.org/");
  Define(RowKind::kString, kOther, 41, "cleaning#occupiedBy");
  Sign(kOther, 40, 41, kLeaseMs);
  EXPECT_EQ(Has(CleanedUntil(kLeaseMs), 1), false);
  EXPECT_GE(simulation_.robot().cleaner()->cleaned(), 3u) << "of the other zone";
  EXPECT_TRUE(Has(CleanedUntil(kLeaseMs + 10'000), 1)) << "the lease has ended";
}

TEST_F(CleaningSignsTest, AWholeIriIsUnderstood) {
  Define(RowKind::kRobot, kOther, kOther, "sweeper");
  Define(RowKind::kString, kOther, 7, std::string(client::kCleaningBase) + "occupiedBy");
  Sign(kOther, 0, 7, kLeaseMs);
  EXPECT_FALSE(Has(CleanedUntil(kLeaseMs), 1));
}

TEST_F(CleaningSignsTest, SomethingElseIsNoSign) {
  Define(RowKind::kRobot, kOther, kOther, "sweeper");
  Define(RowKind::kString, kOther, 1, client::kCleaningBase);
  Define(RowKind::kString, kOther, 2, "occupiedByNobody");
  Define(RowKind::kString, kOther, 3, std::string(200, 'x'));
  Sign(kOther, 1, 2, kLeaseMs);
  Sign(kOther, 3, 3, kLeaseMs);
  EXPECT_TRUE(Has(CleanedUntil(10'000), 1));
}

TEST_F(CleaningSignsTest, WhatIsLeasedAndNotDefinedYetIsTakenForASign) {
  Define(RowKind::kRobot, kOther, kOther, "sweeper");
  Sign(kOther, 5, 6, kLeaseMs);
  EXPECT_FALSE(Has(CleanedUntil(kLeaseMs), 1));
  EXPECT_TRUE(Has(CleanedUntil(kLeaseMs + 10'000), 1));
}

TEST_F(CleaningSignsTest, WhenAnotherHasCleanedCounts) {
  Define(RowKind::kRobot, kOther, kOther, "sweeper");
  Define(RowKind::kString, kOther, 1, client::kCleaningBase);
  Define(RowKind::kString, kOther, 2, "cleanedBy");
  Sign(kOther, 1, 2, 0);
  const std::vector<uint16_t> zones = CleanedUntil(20'000);
  ASSERT_FALSE(zones.empty());
  EXPECT_EQ(zones.front(), 2) << "the first one was cleaned just now";
}

TEST_F(CleaningSignsTest, AnOperatorKeepsItAway) {
  Define(RowKind::kRobot, kOther, kOther, "operator");
  Define(RowKind::kString, kOther, 1, client::kCleaningBase);
  Define(RowKind::kString, kOther, 2, "keepAway");
  Sign(kOther, 1, 2, 0);
  EXPECT_FALSE(Has(CleanedUntil(60'000), 1));
  EXPECT_GE(simulation_.robot().cleaner()->cleaned(), 3u) << "of the other zone";
  Change({TagsChanged::Erase{.tag = 1, .slot = 0}});
  EXPECT_TRUE(Has(CleanedUntil(80'000), 1)) << "the sign is gone";
}

// A sign may come at any moment of a cycle: before a look, between reading and claiming, on the
// way.
class CleaningSignMomentTest : public CleaningSignsTest, public testing::WithParamInterface<int> {};

TEST_P(CleaningSignMomentTest, OnlyWhoHasClaimedTheZoneCleansThereAfterwards) {
  Define(RowKind::kRobot, kOther, kOther, "operator");
  Define(RowKind::kString, kOther, 6, std::string(client::kCleaningBase) + "keepAway");
  CleanedUntil(GetParam());
  Sign(kOther, 0, 6, 0);
  const bool is_claimed = simulation_.service().Inspect(
      [](const engine::Engine& engine) { return engine.tags().Find(1)->tag.leased() > 0; });
  const std::vector<uint16_t> zones = CleanedUntil(GetParam() + 40'000);
  const auto times = std::count(zones.begin(), zones.end(), 1);
  EXPECT_LE(times, is_claimed ? 1 : 0);
  EXPECT_GE(zones.size(), 2u) << "of the other zone";
}

INSTANTIATE_TEST_SUITE_P(Cycle, CleaningSignMomentTest, testing::Range(10'000, 30'000, 250));

TEST_F(CleaningSignsTest, AnOperatorWantsItCleanedAgain) {
  Define(RowKind::kRobot, kOther, kOther, "operator");
  Define(RowKind::kString, kOther, 6, std::string(client::kCleaningBase) + "cleanAgain");
  // It has just cleaned the first zone, and would go on with the other.
  const client::Cleaner& cleaner = *simulation_.robot().cleaner();
  for (uint32_t before = 0; before == cleaner.cleaned() || cleaner.target() != 1;) {
    before = cleaner.cleaned();
    simulation_.RunTo(simulation_.now_ms() + 1);
    ASSERT_LT(simulation_.now_ms(), 60'000);
  }
  Sign(kOther, 0, 6, 0);
  const std::vector<uint16_t> zones = CleanedUntil(simulation_.now_ms() + 60'000);
  ASSERT_GE(zones.size(), 4u) << testing::PrintToString(zones);
  EXPECT_EQ((std::vector<uint16_t>{zones.begin(), zones.begin() + 4}),
            (std::vector<uint16_t>{1, 2, 1, 2}))
      << "the sign counts once";
}

TEST_F(CleaningSignsTest, AfterAResetItGoesOnWithItsOwnClaim) {
  Define(RowKind::kRobot, kOther, kOther, "cleaner-001");  // its number from before
  Define(RowKind::kString, kOther, 1, client::kCleaningBase);
  Define(RowKind::kString, kOther, 2, "occupiedBy");
  Define(RowKind::kString, kOther, 3, "cleanedBy");
  Sign(kOther, 1, 2, kLeaseMs);
  const std::vector<uint16_t> zones = CleanedUntil(10'000);
  ASSERT_FALSE(zones.empty());
  EXPECT_EQ(zones.front(), 1);
  EXPECT_GE(simulation_.robot().cleaner()->cleaned(), 1u);
}

TEST_F(CleaningSignsTest, NumbersWithAnotherMeaningAreLeftAlone) {
  Define(RowKind::kRobot, kOther, kOther, "cleaner-001");
  Define(RowKind::kString, kOther, 2, "what another firmware called so");
  CleanedUntil(20'000);
  EXPECT_GE(simulation_.robot().cleaner()->cleaned(), 2u);
  simulation_.service().Inspect([](const engine::Engine& engine) {
    const auto& rows = engine.tags().symbols().rows();
    int own = 0;
    for (const tags::Row& row : rows) {
      own += row.kind == RowKind::kString && row.number >= 4 ? 1 : 0;
    }
    EXPECT_EQ(own, 3);
    return 0;
  });
}

}  // namespace
}  // namespace pheromone::swarm
