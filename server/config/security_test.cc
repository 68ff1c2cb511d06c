// Signed links: the keys files that are read, and each way to get them wrong.
#include <gmock/gmock.h>

#include <filesystem>
#include <string>

#include "server/config/describe.h"
#include "server/config/testing/config_text.h"
#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

using signing::Keys;
using signing::Security;
using ::testing::Contains;
using ::testing::EndsWith;
using ::testing::IsEmpty;

constexpr std::string_view kRobot7 = "7 000102030405060708090a0b0c0d0e0f the red one\n";
const Keys kRobots = {{7, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}}};

// Begins on line 29.
std::string UdpLink(const std::string& keys) {
  return "[[link]]\nname = \"net\"\nkind = \"udp\"\nlisten = \"127.0.0.1:4951\"\n" + keys;
}

class SecurityTest : public FolderTest {
 protected:
  void WriteKeys(std::string_view text, unsigned mode = 0600) const {
    Write("robots.keys", text);
    std::filesystem::permissions(folder_ / "robots.keys", std::filesystem::perms{mode});
  }
};

TEST_F(SecurityTest, EachSignedLinkHasTheKeysOfItsFile) {
  WriteKeys(kRobot7);
  for (const std::string kind : {"accept", "require"}) {
    const Result<Config> parsed =
        Parse(UdpLink("security = \"" + kind + "\"\nkeys = \"robots.keys\"\n"));
    ASSERT_TRUE(parsed.ok()) << parsed.error();
    const Config& config = parsed.value();
    EXPECT_EQ(config.links[0].security, Security::kOff);
    EXPECT_EQ(config.links[1].security, kind == "accept" ? Security::kAccept : Security::kRequire);
    EXPECT_EQ(config.links[1].keys_path, (folder_ / "robots.keys").string());
    EXPECT_EQ(config.keys, (std::map<std::string, Keys>{{"net", kRobots}}));
    EXPECT_THAT(config.warnings, IsEmpty());
  }
}

TEST_F(SecurityTest, LinksAreUnsignedUnlessTheConfigurationSaysOtherwise) {
  for (const std::string keys : {"", "security = \"off\"\n"}) {
    const Result<Config> parsed = Parse(UdpLink(keys));
    ASSERT_TRUE(parsed.ok()) << parsed.error();
    EXPECT_EQ(parsed.value().links[1].security, Security::kOff);
    EXPECT_EQ(parsed.value().links[1].keys_path, "");
    EXPECT_THAT(parsed.value().keys, IsEmpty());
  }
}

TEST_F(SecurityTest, OtherKeysAreNotAnotherLink) {
  WriteKeys(kRobot7);
  const std::string text = UdpLink("security = \"require\"\nkeys = \"robots.keys\"\n");
  const Result<Config> before = Parse(text);
  WriteKeys("8 ffffffffffffffffffffffffffffffff\n");
  const Result<Config> after = Parse(text);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_EQ(before.value().links, after.value().links);
  EXPECT_NE(before.value().keys, after.value().keys);
}

TEST_F(SecurityTest, MistakesOfTheFileAreToldAtTheKeyThatNamesIt) {
  const std::string text = UdpLink("security = \"require\"\nkeys = \"robots.keys\"\n");
  EXPECT_EQ(ErrorOf(text),
            "f.toml:34:8: link[2].keys: robots.keys: cannot be opened: No such file or directory");
  WriteKeys("\n7 00\n");
  EXPECT_EQ(ErrorOf(text),
            "f.toml:34:8: link[2].keys: robots.keys:2: found a key of 2 digits, expected 32 "
            "hexadecimal digits");
  WriteKeys(kRobot7, 0640);
  EXPECT_EQ(ErrorOf(text),
            "f.toml:34:8: link[2].keys: robots.keys: others than its owner may read it or change "
            "it, expected mode 0600: chmod 600 robots.keys");
}

TEST_F(SecurityTest, AFileWithoutKeysIsAWarning) {
  WriteKeys("# none yet\n");
  const Result<Config> parsed = Parse(UdpLink("security = \"require\"\nkeys = \"robots.keys\"\n"));
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  ASSERT_EQ(parsed.value().warnings.size(), 1U);
  EXPECT_THAT(parsed.value().warnings[0].text,
              EndsWith("link[2].keys: no robot has a key, so none is heard on this link"));
}

TEST_F(SecurityTest, WhatIsRequiredIsDescribed) {
  WriteKeys(kRobot7);
  const auto lines = [&](const std::string& security) {
    return DescribeReach(
        Parse(UdpLink("security = \"" + security + "\"\nkeys = \"robots.keys\"\n")).value(),
        nullptr);
  };
  EXPECT_THAT(lines("require"),
              Contains("link net: udp 127.0.0.1:4951, signed frames required, keys: 1"));
  EXPECT_THAT(lines("accept"),
              Contains("link net: udp 127.0.0.1:4951, signed frames accepted, keys: 1"));
}

TEST_F(SecurityTest, AConfigurationWithoutFolderReadsNoKeys) {
  const Result<Config> parsed =
      ParseConfig(Replaced(29, "path = \"a\"\nsecurity = \"require\"\nkeys = \"none\""), "f.toml");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  EXPECT_EQ(parsed.value().keys, (std::map<std::string, Keys>{{"radio-a", {}}}));
  EXPECT_THAT(parsed.value().warnings, IsEmpty());
}

class SecurityErrorsTest : public ErrorsTest {};

TEST_P(SecurityErrorsTest, NamesPlaceKeyAndExpectation) {
  ExpectError();
}

INSTANTIATE_TEST_SUITE_P(
    Security, SecurityErrorsTest,
    ::testing::Values(
        Case{29, "path = \"a.pty\"\nsecurity = true",
             "30:12: link[1].security: found true, expected one of \"off\", \"accept\", "
             "\"require\""},
        Case{29, "path = \"a.pty\"\nsecurity = \"on\"",
             "30:12: link[1].security: found the string \"on\", expected one of \"off\", "
             "\"accept\", \"require\""},
        Case{
            29, "path = \"a.pty\"\nsecurity = \"require\"",
            "26:1: link[1].keys: missing, expected the file with the robots' keys, as pheromonectl "
            "keys new makes it"},
        Case{29, "path = \"a.pty\"\nsecurity = \"accept\"\nkeys = 7",
             "31:8: link[1].keys: found 7, expected a string that is not empty"},
        Case{29, "path = \"a.pty\"\nkeys = \"robots.keys\"",
             "30:1: link[1].keys: not permitted with security = \"off\", expected security = "
             "\"accept\" or \"require\""},
        Case{29, "path = \"a.pty\"\nsecurity = \"off\"\nkeys = \"robots.keys\"",
             "31:1: link[1].keys: not permitted with security = \"off\", expected security = "
             "\"accept\" or \"require\""}));

}  // namespace
}  // namespace pheromone::config
