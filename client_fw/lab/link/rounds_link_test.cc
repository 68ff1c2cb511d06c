#include "client_fw/lab/link/rounds_link.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "client_fw/lab/link/measured_rounds.h"
#include "server/base/file.h"

namespace pheromone::lab {
namespace {

TEST(Distribution, IsThatOfTheValuesInItsBins) {
  Distribution gaps;
  gaps.Add(198, 200, 6);
  gaps.Add(410, 410, 3);
  gaps.Add(900, 1000, 1);
  EXPECT_NEAR(gaps.Mean(), (6 * 199 + 3 * 410 + 950) / 10.0, 1e-9);
  EXPECT_NEAR(gaps.ShareAbove(200), 0.4, 1e-9);
  EXPECT_NEAR(gaps.ShareAbove(199), 0.6, 1e-9);
  EXPECT_NEAR(gaps.ShareAbove(480), 0.1, 1e-9);
  EXPECT_EQ(gaps.ShareAbove(1000), 0);
  // Two of six each.
  EXPECT_EQ(gaps.At(0), 198);
  EXPECT_EQ(gaps.At(0.19), 198);
  EXPECT_EQ(gaps.At(0.21), 199);
  EXPECT_EQ(gaps.At(0.59), 200);
  EXPECT_EQ(gaps.At(0.61), 410);
  EXPECT_EQ(gaps.At(0.89), 410);
  EXPECT_EQ(gaps.At(0.9999), 1000);
}

TEST(MeasuredRounds, AWrongLineIsNamed) {
  const std::string header = "lost_percent,robots,figure,from_ms,to_ms,count\n";
  const std::string good = "0,1,gap,200,200,5\n0,1,age,34,40,5\n";
  ASSERT_TRUE(ReadMeasuredRounds(header + good).ok());
  EXPECT_EQ(ReadMeasuredRounds(header + good + "0,2,gap,9,8,5\n").ErrorOr("none"),
            "measured rounds, line 4: found \"0,2,gap,9,8,5\", expected values of "
            "lost_percent,robots,figure,from_ms,to_ms,count");
  for (const char* line : {"0,2,gap,9,10", "0,2,lag,9,10,1", "0,2,gap,9,10,0", "0,2,gap,9,10,1,",
                           "0,2,gap,-9,10,1", "x,2,gap,9,10,1", ""}) {
    EXPECT_FALSE(ReadMeasuredRounds(header + good + line + "\n").ok()) << line;
  }
  EXPECT_FALSE(ReadMeasuredRounds(good).ok());
  EXPECT_EQ(ReadMeasuredRounds(header + "0,3,gap,200,200,5\n").ErrorOr("none"),
            "measured rounds: 3 robots with 0 % lost have no gaps or no ages");
}

TEST(MeasuredRounds, AreThereForEachNumberOfRobotsAndLoss) {
  EXPECT_EQ(MeasuredRounds().size(), 3u * kMaxMeasuredRobots);
  for (const int lost : {0, 1, 5}) {
    for (int robots = 1; robots <= kMaxMeasuredRobots; ++robots) {
      EXPECT_NE(FindMeasured(lost, robots), nullptr) << robots << " robots, " << lost << " %";
    }
  }
  EXPECT_EQ(FindMeasured(2, 8), nullptr);
}

// The rows of the channel experiment's own table, by their columns.
std::vector<std::map<std::string, std::string>> ChannelRows() {
  std::istringstream text(ReadFile(std::string(PHEROMONE_SOURCE_DIR) +
                                   "/client_fw/experiments/channel/results/rounds.csv")
                              .value());
  const auto fields = [](const std::string& line) {
    std::vector<std::string> list;
    std::istringstream from(line);
    for (std::string field; std::getline(from, field, ',');) {
      list.push_back(field);
    }
    return list;
  };
  std::string line;
  std::getline(text, line);
  const std::vector<std::string> names = fields(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(text, line)) {
    const std::vector<std::string> values = fields(line);
    rows.emplace_back();
    for (size_t i = 0; i < names.size(); ++i) {
      rows.back()[names[i]] = values[i];
    }
  }
  return rows;
}

// Answers a second, pose ages and fail-safe stops are those that the experiment has counted.
TEST(MeasuredRounds, AreThoseOfTheChannelExperiment) {
  int compared = 0;
  for (const auto& row : ChannelRows()) {
    if (row.at("access") != "rounds" || row.at("turnaround_ms") != "2" ||
        row.at("hidden_pairs") != "0" || row.at("together") != "0" || row.at("simple") != "0") {
      continue;
    }
    const int robots = std::stoi(row.at("robots"));
    const MeasuredChannel* channel = FindMeasured(std::stoi(row.at("frame_loss_percent")), robots);
    ASSERT_NE(channel, nullptr);
    SCOPED_TRACE(row.at("robots") + " robots, " + row.at("frame_loss_percent") + " % lost");
    const double answers = std::stod(row.at("goodput_per_s"));
    // A bin has no more than its two ends: where most gaps are 200 ms, that is up to 3 %.
    EXPECT_NEAR(1000 * robots / channel->gaps.Mean(), answers,
                (robots < 8 ? 0.03 : 0.015) * answers);
    EXPECT_NEAR(static_cast<double>(channel->pose_ages.At(0.5)),
                std::stod(row.at("pose_age_p50_ms")), 10);
    const double stops = std::stod(row.at("fail_safe_stops"));
    const double modelled = channel->gaps.ShareAbove(480) * answers * 60 * 10;
    EXPECT_LE(modelled, 1.2 * stops + 20);
    EXPECT_GE(modelled, stops / 1.2 - 20);
    ++compared;
  }
  EXPECT_EQ(compared, 10);
}

TEST(RoundsLink, DrawsItsExchangesFromTheTable) {
  constexpr int kExchanges = 20'000;
  for (const int robots : {1, 8, 20}) {
    for (const int lost : {0, 5}) {
      const RoundsLink link(static_cast<size_t>(robots),
                            {.robots_per_channel = 40, .lost_percent = lost}, 7);
      const MeasuredChannel& channel = *FindMeasured(lost, robots);
      LinkExchange exchange = link.First(0);
      EXPECT_GE(exchange.ask_ms, 0);
      const int64_t first_ms = exchange.answer_ms;
      int stops = 0;
      for (int i = 0; i < kExchanges; ++i) {
        const LinkExchange next = link.After(0, exchange);
        ASSERT_GE(next.ask_ms, exchange.answer_ms);
        ASSERT_GE(next.answer_ms, next.ask_ms);
        stops += next.answer_ms - exchange.answer_ms > 480 ? 1 : 0;
        exchange = next;
      }
      const double mean_ms = static_cast<double>(exchange.answer_ms - first_ms) / kExchanges;
      EXPECT_NEAR(mean_ms, channel.gaps.Mean(), 0.02 * channel.gaps.Mean());
      EXPECT_NEAR(static_cast<double>(stops) / kExchanges, channel.gaps.ShareAbove(480), 0.01);
    }
  }
}

// 20 robots on channels for 8: three channels of 7, 7 and 6.
TEST(RoundsLink, RobotsAreOnAsManyChannelsAsTheyNeed) {
  EXPECT_EQ(ChannelsOf(20, 8), 3u);
  EXPECT_EQ(ChannelsOf(8, 8), 1u);
  const RoundsLink link(20, {.robots_per_channel = 8}, 1);
  const auto mean_ms = [&](size_t robot) {
    LinkExchange exchange = link.First(robot);
    const int64_t first_ms = exchange.answer_ms;
    for (int i = 0; i < 5000; ++i) {
      exchange = link.After(robot, exchange);
    }
    return static_cast<double>(exchange.answer_ms - first_ms) / 5000;
  };
  EXPECT_NEAR(mean_ms(0), FindMeasured(0, 7)->gaps.Mean(), 1);
  EXPECT_NEAR(mean_ms(4), FindMeasured(0, 7)->gaps.Mean(), 1);
  EXPECT_NEAR(mean_ms(2), FindMeasured(0, 6)->gaps.Mean(), 1);
}

}  // namespace
}  // namespace pheromone::lab
