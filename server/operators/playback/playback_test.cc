// Play, pause, speed and seek, in a time that the test makes.

#include "server/operators/playback/playback.h"

#include <gtest/gtest.h>

#include "server/operators/playback/testing/recording.h"

namespace pheromone::playback {
namespace {

using Phase = State::Phase;
constexpr uint64_t kPortion = 1 << 20;
constexpr uint64_t kSecond = 1'000'000'000;

class PlaybackTest : public ::testing::Test {
 protected:
  void At(uint64_t now_ms) {
    while (playback_.Turn(now_ms, kPortion)) {
    }
  }
  uint64_t since_begin() const { return player_.time_ns() - player_.range().begin_ns; }

  static const testing::Recording& recording() {
    static const testing::Recording made(3, 10'000);
    return made;
  }
  Player player_ = recording().MakePlayer();
  Playback playback_{&player_};
};

TEST_F(PlaybackTest, IsPausedAtTheBeginningUntilItIsAskedToPlay) {
  EXPECT_EQ(playback_.state().phase, Phase::kBuffering);
  EXPECT_FALSE(playback_.is_ready());
  At(1000);
  EXPECT_TRUE(playback_.is_ready());
  EXPECT_EQ(playback_.state().phase, Phase::kPaused);
  At(9000);
  EXPECT_EQ(since_begin(), 0u);
}

TEST_F(PlaybackTest, PlaysAtTheSpeedThatIsAskedFor) {
  At(1000);
  EXPECT_EQ(playback_.Take({.play = true, .speed = 2}).phase, Phase::kPlaying);
  At(1000);
  At(2500);
  EXPECT_EQ(since_begin(), 3 * kSecond);
  playback_.Take({.play = true, .speed = 0.5});
  At(3000);
  At(5000);
  EXPECT_EQ(since_begin(), 4 * kSecond);  // the time between request and turn does not count
  playback_.Take({.play = false, .speed = 0.5});
  At(8000);
  EXPECT_EQ(since_begin(), 4 * kSecond);
  EXPECT_EQ(playback_.state().phase, Phase::kPaused);
}

TEST_F(PlaybackTest, BuffersUntilItIsWhereItIsToBe) {
  At(1000);
  const uint64_t goal_ns = player_.range().begin_ns + 7 * kSecond;
  const State answer = playback_.Take({.play = true, .speed = 1, .seek_ns = goal_ns});
  EXPECT_EQ(answer, (State{Phase::kBuffering, goal_ns, 1, true}));
  EXPECT_TRUE(playback_.Turn(1100, 1));
  EXPECT_FALSE(playback_.is_ready());
  EXPECT_FALSE(playback_.TakeNews().has_value());
  At(5000);
  EXPECT_TRUE(playback_.is_ready());
  EXPECT_EQ(playback_.TakeNews(), (State{Phase::kPlaying, goal_ns, 1, false}));
  EXPECT_FALSE(playback_.TakeNews().has_value());
  At(6000);
  At(7000);
  EXPECT_EQ(since_begin(), 8 * kSecond);
}

TEST_F(PlaybackTest, EndsAtTheEndAndGoesBackFromThere) {
  playback_.Take({.play = true, .speed = kMaxSpeed, .seek_ns = UINT64_MAX});
  At(1000);
  EXPECT_EQ(player_.time_ns(), player_.range().end_ns);
  EXPECT_EQ(playback_.TakeNews()->phase, Phase::kEnded);
  playback_.Take({.play = true, .speed = 1, .seek_ns = 0});
  At(2000);
  EXPECT_EQ(playback_.state(), (State{Phase::kPlaying, player_.range().begin_ns, 1, false}));
}

TEST_F(PlaybackTest, PlaysAsFastAsItCanIfThatIsTooSlow) {
  At(1000);
  playback_.Take({.play = true, .speed = 1});
  playback_.Turn(1000, 1);
  EXPECT_FALSE(playback_.Turn(9000, 1));  // eight seconds in a portion of a record
  const uint64_t reached = since_begin();
  EXPECT_LT(reached, 8 * kSecond);
  At(9500);
  EXPECT_EQ(since_begin(), reached + kSecond / 2);
}

TEST_F(PlaybackTest, SpeedsOutOfRangeAreBroughtIntoIt) {
  EXPECT_EQ(playback_.Take({.play = true, .speed = 1e30F}).speed, kMaxSpeed);
  EXPECT_EQ(playback_.Take({.play = true, .speed = -1}).speed, kMinSpeed);
}

}  // namespace
}  // namespace pheromone::playback
