#include "server/core/engine/service/traffic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using Fate = Traffic::Fate;

TEST(TrafficTest, CountsEachRobotOfEachLinkByItself) {
  Traffic traffic;
  traffic.Count(1, testing::Hello(7, 1), 100, Fate::kAnswered);
  traffic.Count(1, testing::Deposit(7, 1), 200, Fate::kAnswered);
  traffic.Count(1, testing::Deposit(7, 1), 250, Fate::kRepeated);
  traffic.Count(0, testing::Deposit(7, 1), 300, Fate::kRefused);
  const RobotTraffic* on_b = traffic.Find(1, 7);
  ASSERT_NE(on_b, nullptr);
  EXPECT_EQ(on_b->requests, 3u);
  EXPECT_EQ(on_b->repeats, 1u);
  EXPECT_EQ(on_b->refusals, 0u);
  EXPECT_EQ(on_b->last_ms, 250u);
  EXPECT_FALSE(on_b->pose.has_value());
  ASSERT_NE(traffic.Find(0, 7), nullptr);
  EXPECT_EQ(traffic.Find(0, 7)->refusals, 1u);
  EXPECT_EQ(traffic.Find(0, 8), nullptr);
  EXPECT_EQ(traffic.Find(9, 7), nullptr);
  std::vector<std::pair<LinkIndex, uint64_t>> seen;
  for (LinkIndex link = 0; link < 10; ++link) {
    traffic.ForEachOf(link, [&](uint8_t id, const RobotTraffic& robot) {
      EXPECT_EQ(id, 7);
      seen.emplace_back(link, robot.requests);
    });
  }
  EXPECT_EQ(seen, (std::vector<std::pair<LinkIndex, uint64_t>>{{0, 1}, {1, 3}}));
  EXPECT_EQ(traffic.by_opcode()[0x71], 1u);
  EXPECT_EQ(traffic.by_opcode()[0x21], 3u);
}

TEST(TrafficTest, RemembersThePoseThatWasReportedLast) {
  Traffic traffic;
  traffic.Count(0, testing::Sense(3, 100, -200, 16384), 1, Fate::kAnswered);
  traffic.Count(0, testing::Trace(3, 1, 300, 400, 5), 2, Fate::kRefused);
  traffic.Count(0, testing::Deposit(3, 2), 3, Fate::kAnswered);  // has a position, but no heading
  ASSERT_TRUE(traffic.Find(0, 3)->pose.has_value());
  EXPECT_EQ(traffic.Find(0, 3)->pose->x, 300);
  EXPECT_EQ(traffic.Find(0, 3)->pose->y, 400);
  EXPECT_EQ(traffic.Find(0, 3)->pose->heading, 5);
}

TEST(TrafficTest, RemembersWhichPheromoneIsAskedFor) {
  Traffic traffic;
  traffic.Count(0, testing::Deposit(3, 2), 1, Fate::kAnswered);
  EXPECT_EQ(traffic.Find(0, 3)->sensed_type, 0);
  protocol::Message sense = testing::Sense(3);
  sense.opcode = 0x05;
  traffic.Count(0, sense, 2, Fate::kAnswered);
  EXPECT_EQ(traffic.Find(0, 3)->sensed_type, 5);
  protocol::Message trace = testing::Trace(3, 1, 300, 400, 5);
  trace.opcode = 0x32;
  traffic.Count(0, trace, 3, Fate::kRefused);
  EXPECT_EQ(traffic.Find(0, 3)->sensed_type, 2);
  traffic.Count(0, testing::Deposit(3, 2), 4, Fate::kAnswered);  // laying is not following
  EXPECT_EQ(traffic.Find(0, 3)->sensed_type, 2);
}

TEST(TrafficTest, CountsHellosInARow) {
  Traffic traffic;
  for (int i = 1; i <= 300; ++i) {
    traffic.Count(0, testing::Hello(3, 1), 1, Fate::kAnswered);
    EXPECT_EQ(traffic.Find(0, 3)->hellos, std::min(i, 255));
  }
  protocol::Message ping = testing::Hello(3, 1);
  ping.opcode = static_cast<uint8_t>(protocol::Opcode::kPing);
  traffic.Count(0, ping, 2, Fate::kAnswered);
  EXPECT_EQ(traffic.Find(0, 3)->hellos, 0);
  traffic.Count(0, testing::Hello(3, 1), 3, Fate::kAnswered);
  traffic.NoteElsewhere({0, 3, {}, 4});  // it asks another server now
  EXPECT_EQ(traffic.Find(0, 3)->hellos, 0);
}

TEST(TrafficTest, AnEchoOfTheServersOwnFramesIsNoRobot) {
  Traffic traffic;
  protocol::Message echo = testing::Sense(3);
  echo.opcode |= protocol::kFromServer;
  traffic.Count(0, echo, 1, Fate::kIgnored);
  EXPECT_EQ(traffic.Find(0, 3), nullptr);
}

}  // namespace
}  // namespace pheromone::engine
