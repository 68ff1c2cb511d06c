#include "server/daemon/audit.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include "server/base/testing/temporary_folder.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::daemon {
namespace {

using control::Notice;

std::vector<boost::json::value> LinesOf(const std::string& path) {
  std::vector<boost::json::value> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    lines.push_back(boost::json::parse(line));
  }
  return lines;
}

class AuditTest : public ::testing::Test {
 protected:
  void Publish(bool is_done, const std::string& who, const std::string& what) {
    control_.Announce({Notice::Topic::kOperator, is_done, who, what});
  }
  std::string File(const std::string& name) const { return folder_ / name; }

  web::testing::FakeControl control_;
  TemporaryFolder folder_;
};

TEST_F(AuditTest, KeepsWhatOperatorsDidAndWhatWasRefusedAlsoOverARestart) {
  for (const char* const first : {"painted \"trail\" at (3, 6)", "undid: paint"}) {
    Audit audit(&control_, folder_ / "");
    Publish(true, "control socket uid 0", first);
    control_.Announce({Notice::Topic::kLink, true, "radio-a", ""});  // nobody's action
    Publish(false, "web 192.0.2.7", "unlock: refused, \n\x1b[2J");
  }
  const std::vector<boost::json::value> lines = LinesOf(File("audit.jsonl"));
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0].at("who"), "control socket uid 0");
  EXPECT_EQ(lines[0].at("what"), "painted \"trail\" at (3, 6)");
  EXPECT_EQ(lines[0].at("done"), true);
  EXPECT_EQ(lines[1].at("who"), "web 192.0.2.7");
  EXPECT_EQ(lines[1].at("what"), "unlock: refused, \n\x1b[2J");
  EXPECT_EQ(lines[1].at("done"), false);
  EXPECT_EQ(lines[2].at("what"), "undid: paint");
  const std::string time(lines[0].at("time").as_string());
  EXPECT_TRUE(time.size() == 24 && time.starts_with("20") && time.ends_with("Z")) << time;
  const auto mode = std::filesystem::status(File("audit.jsonl")).permissions();
  EXPECT_EQ(mode & std::filesystem::perms::others_all, std::filesystem::perms::none);
}

TEST_F(AuditTest, TakesABoundedPlace) {
  for (int i = 0; i < 10; ++i) {
    Audit audit(&control_, folder_ / "", 200);
    Publish(true, "web 192.0.2.7", std::string(100, 'a'));
    Publish(true, "web 192.0.2.7", std::to_string(i));
  }
  EXPECT_FALSE(std::filesystem::exists(File("audit.jsonl")));  // the next one begins it
  const std::vector<boost::json::value> lines = LinesOf(File("audit.1.jsonl"));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[1].at("what"), "9");
}

TEST_F(AuditTest, WithoutAPlaceTheServerGoesOn) {
  Audit without_folder(&control_, "");
  Audit without_right(&control_, "/proc/nothing");
  Publish(true, "web 192.0.2.7", "halted all robots");
}

}  // namespace
}  // namespace pheromone::daemon
