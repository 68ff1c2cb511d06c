#include "server/daemon/audit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "server/base/testing/temporary_folder.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::daemon {
namespace {

using control::Notice;

// Without the time, which comes first: {"time":"2026-11-26T21:50:01.123Z",...
std::vector<std::string> LinesOf(const std::string& path) {
  std::vector<std::string> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    EXPECT_TRUE(line.starts_with("{\"time\":\"20") && line.substr(32, 3) == "Z\",") << line;
    lines.push_back(line.substr(std::min<size_t>(35, line.size())));
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
  const std::string refused =
      R"("who":"web 192.0.2.7","what":"unlock: refused, \n\u001b[2J","done":false})";
  EXPECT_EQ(
      LinesOf(File("audit.jsonl")),
      (std::vector<std::string>{
          R"x("who":"control socket uid 0","what":"painted \"trail\" at (3, 6)","done":true})x",
          refused, R"("who":"control socket uid 0","what":"undid: paint","done":true})", refused}));
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
  const std::vector<std::string> lines = LinesOf(File("audit.1.jsonl"));
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[1], R"("who":"web 192.0.2.7","what":"9","done":true})");
}

// Nor is a link followed, which somebody else may have made.
TEST_F(AuditTest, WhatCannotBeWrittenHoldsUpNobody) {
  std::filesystem::create_symlink(File("elsewhere"), File("audit.jsonl"));
  {
    Audit audit(&control_, folder_ / "");
    Publish(true, "web 192.0.2.7", "first");
  }
  EXPECT_FALSE(std::filesystem::exists(File("elsewhere")));
  std::filesystem::remove(File("audit.jsonl"));
  {
    Audit audit(&control_, folder_ / "");
    Publish(true, "web 192.0.2.7", "second");
  }
  EXPECT_EQ(LinesOf(File("audit.jsonl")),
            (std::vector<std::string>{R"("who":"web 192.0.2.7","what":"second","done":true})"}));
}

}  // namespace
}  // namespace pheromone::daemon
