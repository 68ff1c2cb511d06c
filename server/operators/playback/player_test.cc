// At each moment of a recording the player shows what the live server showed then, whichever way it
// came there.

#include "server/operators/playback/player.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "server/base/file.h"
#include "server/operators/playback/testing/recording.h"

namespace pheromone::playback {
namespace {

using ::testing::HasSubstr;
using testing::Moment;
using testing::Recording;

class PlayerTest : public ::testing::Test {
 protected:
  static const Recording& recording() {
    static const Recording made(7, 20'000);
    return made;
  }
  static void Reach(Player* player, uint64_t time_ns, uint64_t portion = 1000) {
    player->Seek(time_ns);
    while (!player->Arrive(portion)) {
    }
  }
  static void ExpectAsLive(const Player& player, uint64_t time_ns, const Moment& live) {
    ASSERT_TRUE(player.has_views());
    EXPECT_EQ(player.time_ns(), time_ns);
    EXPECT_EQ(player.FieldTimeAt(time_ns), live.field_ms);
    EXPECT_EQ(player.engine().StateHash(), live.hash);
    const field::FieldReader reader(*player.Field(time_ns).field);
    std::vector<int64_t> levels;
    for (int i = 0; i < 25; ++i) {
      const auto sensed = reader.Sense(1, {{i % 5 * 900'000, i / 5 * 900'000}, 0}, live.field_ms);
      levels.push_back(sensed ? int64_t{sensed->left} + sensed->right : -1);
    }
    EXPECT_EQ(levels, live.levels);
    // The recording began when no robot had been heard.
    std::vector<std::pair<uint8_t, uint64_t>> requests;
    std::vector<std::string> states;
    for (const control::ClientView& client : player.Clients(time_ns)) {
      requests.emplace_back(client.id, client.traffic.requests);
      states.push_back(testing::StateText(client));
    }
    EXPECT_EQ(requests, live.requests);
    EXPECT_EQ(states, live.states);
  }
};

TEST_F(PlayerTest, ShowsEachMomentAsItWasLive) {
  Player player = recording().MakePlayer();
  EXPECT_EQ(player.problem(), "");
  ASSERT_GT(recording().moments.size(), 50u);
  for (const auto& [time_ns, live] : recording().moments) {
    Reach(&player, time_ns);
    ExpectAsLive(player, time_ns, live);
  }
  EXPECT_EQ(player.generation(), 1u);  // always forwards
}

TEST_F(PlayerTest, ShowsTheSameAfterAnyLeap) {
  std::mt19937 random(11);
  std::vector<std::pair<uint64_t, Moment>> moments(recording().moments.begin(),
                                                   recording().moments.end());
  for (const size_t checkpoints : {0u, 1u, 16u}) {
    Player player = recording().MakePlayer({.max_checkpoints = checkpoints});
    for (int i = 0; i < 30; ++i) {
      const auto& [time_ns, live] = moments[random() % moments.size()];
      Reach(&player, time_ns, 1 + random() % 5000);
      if (random() % 3 == 0) {  // on the way to elsewhere
        player.Seek(moments[random() % moments.size()].first);
        player.Arrive(500);
        Reach(&player, time_ns);
      }
      ExpectAsLive(player, time_ns, live);
    }
  }
}

TEST_F(PlayerTest, GoesBackFromACheckpointInsteadOfTheBeginning) {
  uint64_t replayed = 0;
  Player player =
      recording().MakePlayer({.on_record = [&](const capture::Record& /*record*/) { ++replayed; }});
  Reach(&player, player.range().end_ns);
  const uint64_t all = replayed;
  Reach(&player, player.range().end_ns - 1'000'000'000);
  EXPECT_LT(replayed - all, all / 2);  // from the beginning nearly all
  Player without = recording().MakePlayer({.checkpoint_bytes = 0});
  Reach(&without, without.range().end_ns);
  Reach(&without, without.range().begin_ns);
  EXPECT_EQ(without.generation(), 2u);
}

TEST_F(PlayerTest, ShowsNoRobotsOfLinksThatAreNoLongerConfigured) {
  const Recording made(7, 300'000);  // long enough for configurations with one link
  Player player = made.MakePlayer();
  Reach(&player, player.range().end_ns);
  EXPECT_EQ(player.problem(), "");
  ExpectAsLive(player, made.moments.rbegin()->first, made.moments.rbegin()->second);
}

TEST_F(PlayerTest, StaysWithinTheRange) {
  Player player = recording().MakePlayer();
  Reach(&player, 0);
  EXPECT_EQ(player.time_ns(), player.range().begin_ns);
  EXPECT_TRUE(player.has_views());
  Reach(&player, UINT64_MAX);
  EXPECT_EQ(player.time_ns(), player.range().end_ns);
  EXPECT_FALSE(player.next_ns().has_value());
}

TEST_F(PlayerTest, PheromonesEvaporateBetweenRecords) {
  Player player = recording().MakePlayer();
  const auto last = std::prev(recording().moments.end());
  const auto before = std::prev(last);
  const uint64_t between_ns = (before->first + last->first) / 2 / 1'000'000 * 1'000'000;
  Reach(&player, between_ns);
  EXPECT_EQ(player.FieldTimeAt(between_ns),
            before->second.field_ms + (between_ns - before->first) / 1'000'000);
}

class DamagedTest : public PlayerTest {
 protected:
  Player Of(const std::string& bytes) {
    const std::string path = folder_ / "damaged.pcapng";
    std::ofstream(path, std::ios::binary) << bytes;
    Player player(path, [path](uint64_t from) { return capture::OpenFile(path, from); });
    while (!player.Survey(1000)) {
    }
    return player;
  }
  const std::string bytes_ = ReadFile(recording().path).value();
  const TemporaryFolder folder_;
};

TEST_F(DamagedTest, IsPlayedUpToTheDamageAndNamesIt) {
  std::string bytes = bytes_;
  bytes[bytes.size() / 2] ^= 1;
  Player player = Of(bytes);
  EXPECT_THAT(player.problem(), HasSubstr("damaged.pcapng: block "));
  EXPECT_THAT(player.problem(), HasSubstr("at byte "));
  const uint64_t end_ns = player.range().end_ns;
  ASSERT_GT(end_ns, player.range().begin_ns);
  const auto after = recording().moments.lower_bound(end_ns);
  ASSERT_NE(after, recording().moments.begin());
  const auto& [time_ns, live] = *std::prev(after);
  Reach(&player, time_ns);
  ExpectAsLive(player, time_ns, live);
}

TEST_F(DamagedTest, OneThatIsBeingWrittenIsPlayedUpToItsPresentEnd) {
  Player player = Of(bytes_.substr(0, bytes_.size() * 2 / 3));
  EXPECT_NE(player.problem(), "");
  EXPECT_FALSE(player.has_failed());
  Reach(&player, UINT64_MAX);
  EXPECT_FALSE(player.has_failed());
  EXPECT_TRUE(player.has_views());
}

TEST_F(DamagedTest, WhatCannotBeReplayedEndsThereWithItsPosition) {
  std::vector<capture::Found> records = capture::testing::RecordsOf(bytes_);
  size_t changed = records.size() / 2;
  while (!std::holds_alternative<capture::Batch>(records[changed].record)) {
    ++changed;
  }
  std::get<capture::Batch>(records[changed].record).number += 1;
  Player player = Of(capture::testing::FileOf(records));
  EXPECT_EQ(player.problem(), "");
  Reach(&player, UINT64_MAX);
  EXPECT_TRUE(player.has_failed());
  EXPECT_THAT(player.problem(), HasSubstr("damaged.pcapng: record " + std::to_string(changed + 1) +
                                          ", after packet"));
  EXPECT_LT(player.time_ns(), player.range().end_ns);
  Reach(&player, player.range().begin_ns);  // what is before can be seen again
  EXPECT_FALSE(player.has_failed());
  EXPECT_TRUE(player.has_views());
}

TEST_F(DamagedTest, NothingAtAllIsAProblemToo) {
  for (const std::string& bytes : {std::string(), std::string("nonsense"), bytes_.substr(0, 300)}) {
    Player player = Of(bytes);
    EXPECT_NE(player.problem(), "");
    player.Seek(UINT64_MAX);
    EXPECT_TRUE(player.Arrive(1000));
    EXPECT_FALSE(player.has_views());
  }
  Player missing("no.pcapng", [](uint64_t from) { return capture::OpenFile("no.pcapng", from); });
  EXPECT_TRUE(missing.Survey(1000));
  EXPECT_THAT(missing.problem(), HasSubstr("no.pcapng"));
}

}  // namespace
}  // namespace pheromone::playback
