#include "client_fw/swarm/own_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "server/core/engine/testing/bench.h"

namespace pheromone::swarm {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// 10 m x 10 m, with a square of "path", a virtual modem without medium access, and two with it.
config::Config ServerWithASquare() {
  config::Config server;
  server.engine = engine::testing::SmallConfig();
  server.engine.field.pheromones[0].name = "trail";
  server.engine.field.pheromones[1].name = "path";
  field::Path square;
  square.type = 2;
  square.closed = true;
  square.points = {{2'000'000, 2'000'000},
                   {4'000'000, 2'000'000},
                   {4'000'000, 4'000'000},
                   {2'000'000, 4'000'000}};
  server.engine.field.paths = {square};
  server.links = {{.name = "plain"}};
  for (const char* const name : {"radio-a", "radio-b"}) {
    server.links.push_back({.name = name,
                            .baud = 19200,
                            .medium_access = true,
                            .turnaround_ms = 5,
                            .adapter_latency_ms = 1,
                            .server_delay_ms = 3});
  }
  return server;
}

TEST(OwnServerTest, RobotsStartEvenlyAlongThePathAndLookAlongIt) {
  const auto swarm = MakeSwarm(ServerWithASquare(), {{"plain", "/lab/plain.pty"}}, {.robots = 8});
  ASSERT_TRUE(swarm.ok()) << swarm.error();
  const RobotGroup& group = swarm.value().scenario.groups.at(0);
  EXPECT_EQ(group.count, 8);
  EXPECT_EQ(group.client.type, 2);
  ASSERT_EQ(group.starts.size(), 8u);
  // The square is 8 m around: half a metre after the corner, and then one each metre.
  const double expected[8][3] = {{2.5, 2, 0},   {3.5, 2, 0},   {4, 2.5, 90},  {4, 3.5, 90},
                                 {3.5, 4, 180}, {2.5, 4, 180}, {2, 3.5, -90}, {2, 2.5, -90}};
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(group.starts[i].x_m, expected[i][0], 1e-6) << i;
    EXPECT_NEAR(group.starts[i].y_m, expected[i][1], 1e-6) << i;
    EXPECT_NEAR(group.starts[i].heading_rad, expected[i][2] * M_PI / 180, 1e-6) << i;
  }
}

TEST(OwnServerTest, LinksThatGrantTurnsAreUsedIfThereAreAny) {
  const config::Config server = ServerWithASquare();
  const auto swarm =
      MakeSwarm(server, {{"plain", "/plain"}, {"radio-a", "/a"}, {"radio-b", "/b"}}, {.robots = 5});
  ASSERT_TRUE(swarm.ok()) << swarm.error();
  EXPECT_THAT(swarm.value().ports, ElementsAre("/a", "/b"));
  EXPECT_THAT(swarm.value().links, ElementsAre("radio-a", "radio-b"));
  EXPECT_EQ(swarm.value().load.access, LinkKind::kMediumAccess);
  EXPECT_EQ(swarm.value().scenario.channels, 2);
  EXPECT_EQ(swarm.value().scenario.timing.baud, 19200);
  EXPECT_EQ(swarm.value().scenario.timing.turnaround_ns, 5'000'000);
  EXPECT_EQ(swarm.value().scenario.timing.adapter_ns, 1'000'000);
  EXPECT_EQ(swarm.value().load.robots, 3);
  EXPECT_EQ(swarm.value().load.period_ms, 200);

  // Channels are alike: one with another rate is left out.
  config::Config mixed = server;
  mixed.links[2].baud = 9600;
  EXPECT_THAT(MakeSwarm(mixed, {{"radio-a", "/a"}, {"radio-b", "/b"}}, {.robots = 5}).value().ports,
              ElementsAre("/a"));

  const auto plain = MakeSwarm(server, {{"plain", "/plain"}}, {.robots = 5});
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain.value().load.access, LinkKind::kBuffered);
}

TEST(OwnServerTest, ALongerPeriodHasALongerFailSafeAndASpeedThatFits) {
  const auto swarm =
      MakeSwarm(ServerWithASquare(), {{"plain", "/p"}}, {.robots = 12, .period_s = 2});
  ASSERT_TRUE(swarm.ok());
  EXPECT_EQ(swarm.value().scenario.groups[0].client.period_ms, 2000);
  EXPECT_EQ(swarm.value().scenario.groups[0].client.fail_safe_ms, 4000);
  EXPECT_EQ(swarm.value().why_slower, "");
  // K (T + t) + K^2 / (2 a) <= c + sigma = 0.5 m: at most 0.5 m / 2.15 s.
  EXPECT_LE(swarm.value().scenario.groups[0].client.speed_mm_s, 230);
}

TEST(OwnServerTest, RobotsThatTheLinkDoesNotHoldAtTheUsualPeriodAskLessOften) {
  const config::Config server = ServerWithASquare();
  const auto swarm = MakeSwarm(server, {{"plain", "/p"}}, {.robots = 12});
  ASSERT_TRUE(swarm.ok());
  // 130 ms for each: 28 ms for 26 bytes, the window of 100 ms, two slots of 1 ms.
  EXPECT_EQ(swarm.value().scenario.groups[0].client.period_ms, 1600);
  EXPECT_EQ(swarm.value().scenario.groups[0].client.fail_safe_ms, 3200);
  EXPECT_THAT(swarm.value().why_slower, HasSubstr("medium_access = true"));
  EXPECT_EQ(MakeSwarm(server, {{"plain", "/p"}}, {.robots = 3}).value().why_slower, "");
  // As wished, although it does not fit.
  const auto wished = MakeSwarm(server, {{"plain", "/p"}}, {.robots = 12, .period_s = 0.2});
  EXPECT_EQ(wished.value().scenario.groups[0].client.period_ms, 200);
  EXPECT_FALSE(Fits(wished.value().load));
  // 254 would be answered every 33 s.
  EXPECT_THAT(MakeSwarm(server, {{"plain", "/p"}}, {.robots = 254}).error(),
              HasSubstr("--robots: 254 robots on a channel of 9600 baud"));
}

TEST(OwnServerTest, TheLoadHasTheShortestFailSafeOfAllGroupsHoweverLong) {
  Scenario scenario;
  for (const uint16_t fail_safe_ms : {uint16_t{60'000}, uint16_t{40'000}}) {
    RobotGroup group;
    group.client.fail_safe_ms = fail_safe_ms;
    scenario.groups.push_back(group);
  }
  EXPECT_EQ(LoadOf(scenario, LinkKind::kBuffered).fail_safe_ms, 40'000);
}

TEST(OwnServerTest, WhatIsMissingIsSaidWithWhatThereIs) {
  const config::Config server = ServerWithASquare();
  EXPECT_THAT(
      MakeSwarm(server, {}, {.robots = 1}).error(),
      HasSubstr("found the links plain, radio-a, radio-b, expected one that is a virtual modem"));
  EXPECT_THAT(MakeSwarm(server, {{"plain", "/p"}}, {.robots = 1, .pheromone = "moss"}).error(),
              HasSubstr("found \"moss\", expected one of 1 (\"trail\"), 2 (\"path\")"));
  EXPECT_THAT(MakeSwarm(server, {{"plain", "/p"}}, {.robots = 1, .pheromone = "trail"}).error(),
              HasSubstr("no [[path]] of pheromone \"trail\""));
}

}  // namespace
}  // namespace pheromone::swarm
