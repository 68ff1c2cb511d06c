#include "server/robots/links/link_router.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/scripted_log.h"

namespace pheromone::links {
namespace {

using engine::testing::MessageOf;
using radio::RoundMember;
using std::chrono::seconds;
using Members = std::vector<RoundMember>;

protocol::Message HelloWithPeriod(uint8_t id, uint8_t period) {
  return MessageOf(protocol::HelloRequest{id, 1, 1, period});
}

// A robot without a turn would wait for eight seconds until it says HELLO again.
TEST(LinkRouter, AServerThatHasJustBegunTakesAllRobotsOfTheLogForPresent) {
  engine::ClockReading now{5'000, 1'600'000'000'000};
  const auto read_clock = [&now] { return now; };
  engine::testing::ScriptedLog log;
  engine::Service leader(&log, read_clock);
  ASSERT_TRUE(leader.Configure(engine::testing::SmallConfig(), 7).ok());
  std::vector<engine::Outgoing> out;
  const std::vector<protocol::Message> hellos = {HelloWithPeriod(5, 10), HelloWithPeriod(6, 0),
                                                 HelloWithPeriod(7, 20)};
  leader.Handle(0, hellos, &out);
  engine::testing::ScriptedLog other_log;
  engine::Service follower(&other_log, read_clock);
  for (const auto& [stamp, event] : log.events) {
    ASSERT_TRUE(follower.Follow(stamp, event, &out).ok());
  }

  const Clock::time_point begin{};
  const LinkRouter router(&follower, begin);
  EXPECT_EQ(router.MembersOfRounds(0, begin + seconds(2)), (Members{{5, 10}, {7, 20}}));
  EXPECT_EQ(router.MembersOfRounds(1, begin + seconds(2)), Members{});
  now.boottime_ms += 1'000;
  const uint64_t heard_ms =
      follower.Inspect([&](const engine::Engine& /*it*/) { return follower.FieldTimeInside(); });
  follower.NotePoses(std::vector<engine::HeardPose>{{0, 7, {5000, 5000, 0}, heard_ms}});
  EXPECT_EQ(router.MembersOfRounds(0, begin + seconds(31)), (Members{{7, 20}}));
  now.boottime_ms += 31'000;
  EXPECT_EQ(router.MembersOfRounds(0, begin + seconds(31)), Members{});
  EXPECT_EQ(router.MembersOfRounds(0, begin + seconds(2)), (Members{{5, 10}}));
}

}  // namespace
}  // namespace pheromone::links
