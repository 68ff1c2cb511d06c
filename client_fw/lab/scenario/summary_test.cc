#include "client_fw/lab/scenario/summary.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "server/base/file.h"

namespace pheromone::lab {
namespace {

class SummaryTest : public ::testing::Test {
 protected:
  SummaryTest()
      : path_(std::filesystem::temp_directory_path() /
              ("lab_summary_" + std::to_string(getpid()) + ".csv")) {
    std::filesystem::remove(path_);
  }
  ~SummaryTest() override { std::filesystem::remove(path_); }

  std::string Text() const { return ReadFile(path_).value(); }

  const std::string path_;
};

TEST_F(SummaryTest, ARowIsThereOnceHoweverOftenItIsAppended) {
  ASSERT_TRUE(AppendRow(path_, {"a,b", "1,2"}).ok());
  ASSERT_TRUE(AppendRow(path_, {"a,b", "1,3"}).ok());
  ASSERT_TRUE(AppendRow(path_, {"a,b", "1,2"}).ok());
  EXPECT_EQ(Text(), "a,b\n1,2\n1,3\n");
}

TEST_F(SummaryTest, AHalfRowIsCutOff) {
  ASSERT_TRUE(AppendRow(path_, {"a,b", "1,2"}).ok());
  std::ofstream(path_, std::ios::app) << "1,";
  ASSERT_TRUE(AppendRow(path_, {"a,b", "1,3"}).ok());
  EXPECT_EQ(Text(), "a,b\n1,2\n1,3\n");
  std::ofstream(path_) << "a,";  // the first process was killed in the header
  ASSERT_TRUE(AppendRow(path_, {"a,b", "1,2"}).ok());
  EXPECT_EQ(Text(), "a,b\n1,2\n");
}

TEST_F(SummaryTest, RowsWithOtherColumnsAreNotMixed) {
  ASSERT_TRUE(AppendRow(path_, {"a,b", "1,2"}).ok());
  EXPECT_EQ(AppendRow(path_, {"a,c", "1,3"}).ErrorOr("none"),
            path_ +
                ": found rows with other columns, expected those of this scenario; write its "
                "runs to a file of their own");
  EXPECT_EQ(Text(), "a,b\n1,2\n");
}

TEST_F(SummaryTest, ADeviceIsNoFileOfRows) {
  EXPECT_EQ(AppendRow("/dev/full", {"a", "1"}).ErrorOr("none"), "/dev/full: is not a regular file");
  EXPECT_EQ(AppendRow("/nonexistent/x.csv", {"a", "1"}).ErrorOr("none"),
            "/nonexistent/x.csv: No such file or directory");
}

TEST_F(SummaryTest, ManyAppendAtOnce) {
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([this, i] {
      for (int row = 0; row < 10; ++row) {
        EXPECT_TRUE(AppendRow(path_, {"a,b", std::to_string(i) + "," + std::to_string(row)}).ok());
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  const std::string text = Text();
  EXPECT_EQ(text.size(), 4u + 80 * 4);
  EXPECT_EQ(text.find("a,b\n"), 0u);
  for (int i = 0; i < 80; ++i) {
    EXPECT_NE(text.find("\n" + std::to_string(i / 10) + "," + std::to_string(i % 10) + "\n"),
              std::string::npos);
  }
}

// A sweep may have levels: what one of them does not measure is an empty field.
TEST_F(SummaryTest, RunsOfAllLevelsHaveTheSameColumns) {
  LabScenario scenario;
  scenario.name = "x";
  LabResult air;
  air.on_air = true;
  air.robots = 3;
  LabResult world;
  world.tally.path_errors = {20'000, 2};
  const SummaryRow of_world = SummaryOf(scenario, world, "abc");
  const SummaryRow of_air = SummaryOf(scenario, air, "abc");
  EXPECT_EQ(of_air.header, of_world.header);
  EXPECT_EQ(of_air.row, "x,abc,1,3,0" + std::string(15, ',') + "0,0,,0000000000000000");
  EXPECT_TRUE(of_world.row.ends_with(",0,0,10,0000000000000000")) << of_world.row;
}

TEST_F(SummaryTest, TextIsQuotedAsCsvNeeds) {
  LabScenario scenario;
  scenario.name = "x";
  scenario.parameters = {{"robots[1].senses", "[\"trail\", 2]"}};
  LabResult result;
  result.robots = 3;
  const SummaryRow row = SummaryOf(scenario, result, "abc");
  EXPECT_EQ(row.header.substr(0, 55), "scenario,commit,seed,robots[1].senses,robots,time_s,del");
  EXPECT_EQ(row.row.substr(0, 32), "x,abc,1,\"[\"\"trail\"\", 2]\",3,0,0,0");
  EXPECT_EQ(row.row.substr(row.row.size() - 17), ",0000000000000000");
}

}  // namespace
}  // namespace pheromone::lab
