// What --check and `config show` say of how the server is reached.

#include <gmock/gmock.h>

#include <filesystem>

#include "server/config/describe.h"
#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class DescribeReachTest : public FolderTest {
 protected:
  const std::string here_ = std::filesystem::current_path().string();
};

TEST_F(DescribeReachTest, EachKindOfLinkIsToldWithWhatItIsReachedBy) {
  const Result<Config> parsed = Parse(
      "[[link]]\nname = \"b\"\nkind = \"serial\"\nport = \"/dev/ttyUSB0\"\nbaud = 19200\n"
      "required = true\n"
      "[[link]]\nname = \"c\"\nkind = \"serial\"\nusb = \"0403:6001:A5\"\n"
      "[[link]]\nname = \"d\"\nkind = \"tcp\"\nlisten = \"[::1]:4950\"\n"
      "[[link]]\nname = \"e\"\nkind = \"udp\"\nlisten = \"127.0.0.1:4951\"\n"
      "[[tracker]]\nname = \"ceiling\"\nlisten = \"127.0.0.1:4960\"\n"
      "[web]\nlisten = \"127.0.0.1:8377\"\n");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  EXPECT_THAT(DescribeReach(parsed.value(), nullptr),
              ElementsAre("link a: pty " + here_ + "/a",
                          "link b: serial /dev/ttyUSB0, 19200 baud, required",
                          "link c: serial usb 0403:6001:A5, 9600 baud", "link d: tcp [::1]:4950",
                          "link e: udp 127.0.0.1:4951", "tracker ceiling: udp 127.0.0.1:4960",
                          "control: " + here_ + "/pheromoned.sock",
                          "web: http://127.0.0.1:8377, read-only"));
}

TEST_F(DescribeReachTest, TheSocketIsInTheRuntimeDirectoryUnlessItIsAbsolute) {
  EXPECT_THAT(
      DescribeReach(Parse("").value(), "/run/a:/run/b"),
      ElementsAre("link a: pty " + here_ + "/a", "control: /run/a/pheromoned.sock", "web: none"));
  EXPECT_THAT(DescribeReach(Parse("[control]\nsocket = \"/run/x\"\n").value(), "/run/a"),
              ElementsAre(testing::_, "control: /run/x", testing::_));
  EXPECT_THAT(DescribeReach(Parse("[control]\nenabled = false\n").value(), "/run/a"),
              ElementsAre(testing::_, "control: none", testing::_));
}

TEST_F(DescribeReachTest, ATokenIsMentionedAndNotTold) {
  Write("token", "0123456789abcdef");
  const auto lines = DescribeReach(
      Parse("[web]\nlisten = \"[::1]:80\"\ntoken_file = \"token\"\n").value(), nullptr);
  EXPECT_EQ(lines.back(),
            "web: http://[::1]:80, changes require the token in " + (folder_ / "token").string());
  std::filesystem::remove(folder_ / "token");
  EXPECT_EQ(DescribeReach(Parse("[web]\nlisten = \"[::1]:80\"\ntoken_file = \"token\"\n").value(),
                          nullptr)
                .back(),
            "web: http://[::1]:80, changes require the token in " + (folder_ / "token").string() +
                ", to be created");
}

TEST_F(DescribeReachTest, ACheckOutsideOfAServiceSaysWhereAServiceHasRelativePaths) {
  const Config config = Parse("").value();
  EXPECT_THAT(DescribeCheck("f.toml", config, nullptr).text,
              HasSubstr("\n  a systemd service resolves relative paths differently"));
  EXPECT_THAT(DescribeCheck("f.toml", config, folder_.c_str()).text,
              Not(HasSubstr("relative paths")));
}

}  // namespace
}  // namespace pheromone::config
