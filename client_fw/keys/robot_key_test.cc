#include "client_fw/keys/robot_key.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "server/base/file.h"
#include "server/base/testing/temporary_folder.h"

namespace pheromone::keys {
namespace {

using ::testing::HasSubstr;

constexpr char kHex[] = "000102030405060708090a0B0C0D0E0f";

class RobotKeyTest : public ::testing::Test {
 protected:
  std::string File(const std::string& name, const std::string& text) {
    const std::string path = (folder_ / name).string();
    std::ofstream(path) << text;
    std::filesystem::permissions(
        path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    return path;
  }

  TemporaryFolder folder_;
};

TEST_F(RobotKeyTest, IsInTheFirstLine) {
  for (const char* const rest : {"", "\n", "\r\n", "\nrobot 7\n"}) {
    const auto key = TakeKey(File("key", std::string(kHex) + rest));
    ASSERT_TRUE(key.ok()) << key.error();
    for (uint8_t i = 0; i < 16; ++i) {
      EXPECT_EQ(i, key.value().bytes.at(i));
    }
    EXPECT_FALSE(key.value().open_to_others);
  }
}

TEST_F(RobotKeyTest, AnythingElseIsRefusedAndNotShown) {
  const std::string hex = kHex;
  for (const std::string& text :
       {std::string(), "\n" + hex, hex.substr(1), hex + "0", " " + hex.substr(1),
        hex.substr(0, 30) + "0x", hex.substr(0, 30) + "-1", hex.substr(0, 31) + "g"}) {
    const std::string path = File("key", text);
    const auto key = TakeKey(path);
    ASSERT_FALSE(key.ok()) << text;
    EXPECT_THAT(key.error(), HasSubstr(path));
    EXPECT_THAT(key.error(), HasSubstr("expected 32 hexadecimal digits"));
    EXPECT_EQ(std::string::npos, key.error().find("0102"));
    EXPECT_FALSE(std::filesystem::exists(path + ".starts")) << "no start was counted";
  }
  const auto missing = TakeKey((folder_ / "missing").string());
  ASSERT_FALSE(missing.ok());
  EXPECT_THAT(missing.error(), HasSubstr("missing"));
}

TEST_F(RobotKeyTest, OthersThatMayReadItAreNoticed) {
  const std::string path = File("key", kHex);
  for (const auto perms : {std::filesystem::perms::group_read, std::filesystem::perms::others_read,
                           std::filesystem::perms::others_write}) {
    std::filesystem::permissions(path, std::filesystem::perms::owner_read | perms);
    EXPECT_TRUE(TakeKey(path).value().open_to_others);
  }
}

TEST_F(RobotKeyTest, EachStartHasANumberOfItsOwn) {
  const std::string path = File("key", kHex);
  for (uint16_t start = 1; start <= 20; ++start) {
    EXPECT_EQ(start, TakeKey(path).value().start);
    EXPECT_EQ(std::to_string(start) + "\n", ReadFile(path + ".starts").value());
  }
  File("key.starts", "65534");
  EXPECT_EQ(65535, TakeKey(path).value().start);
  const auto used_up = TakeKey(path);
  ASSERT_FALSE(used_up.ok());
  EXPECT_THAT(used_up.error(),
              HasSubstr("key.starts: 65535 starts, expected at most 65534: new keys"));
}

TEST_F(RobotKeyTest, ACountThatIsNoneIsRefused) {
  const std::string path = File("key", kHex);
  for (const char* const text : {"", "x", "-1", "65536", "5 6", "99999999999999999999"}) {
    const std::string starts = File("key.starts", text);
    const auto key = TakeKey(path);
    ASSERT_FALSE(key.ok()) << text;
    EXPECT_THAT(key.error(), HasSubstr(starts));
    EXPECT_EQ(text, ReadFile(starts).value());
  }
}

TEST_F(RobotKeyTest, WithoutACountThereIsNoKey) {
  const std::string path = File("key", kHex);
  std::filesystem::create_directory(path + ".starts");
  const auto key = TakeKey(path);
  ASSERT_FALSE(key.ok());
  EXPECT_THAT(key.error(), HasSubstr("key.starts"));
}

}  // namespace
}  // namespace pheromone::keys
