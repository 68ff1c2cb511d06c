#include "server/robots/signing/keys_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include "server/base/testing/temporary_folder.h"

namespace pheromone::signing {
namespace {

constexpr const char* kDigits = "000102030405060708090a0b0c0d0eFF";
constexpr Key kKeyOfSeven = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 255};
constexpr Key kKeyOfEight = {0xAB, 1};

TEST(KeysFile, ALineIsARobot) {
  const auto file =
      KeysFile::Parse("# robots\n\n 7\t" + std::string(kDigits) +
                          "  the red one \r\n254 ffffffffffffffffffffffffffffffff# spare\n"
                          "1 10000000000000000000000000000000",
                      "k");
  ASSERT_TRUE(file.ok()) << file.error();
  const auto& robots = file.value().robots();
  ASSERT_EQ(robots.size(), 3U);
  EXPECT_EQ(robots.at(7).key, kKeyOfSeven);
  EXPECT_EQ(robots.at(7).comment, "the red one");
  EXPECT_EQ(robots.at(7).line, 3U);
  EXPECT_EQ(robots.at(254).comment, "spare");
  EXPECT_EQ(robots.at(1).key, (Key{0x10}));
  EXPECT_EQ(robots.at(1).comment, "");
  EXPECT_EQ(file.value().keys().at(7), kKeyOfSeven);
  EXPECT_EQ(file.value().keys().size(), 3U);
}

TEST(KeysFile, AnEmptyFileIsOfNoRobots) {
  EXPECT_TRUE(KeysFile::Parse("", "k").value().robots().empty());
}

struct Mistake {
  std::string text;
  std::string error;
};

class KeysFileMistakes : public ::testing::TestWithParam<Mistake> {};

TEST_P(KeysFileMistakes, NameFileLineAndWhatWasExpected) {
  EXPECT_EQ(KeysFile::Parse(GetParam().text, "robots.keys").ErrorOr("none"), GetParam().error);
}

INSTANTIATE_TEST_SUITE_P(
    All, KeysFileMistakes,
    ::testing::Values(
        Mistake{"#\n0 " + std::string(kDigits),
                "robots.keys:2: found \"0\" as ID, expected a whole number from 1 to 254"},
        Mistake{"255 " + std::string(kDigits),
                "robots.keys:1: found \"255\" as ID, expected a whole number from 1 to 254"},
        Mistake{"256 " + std::string(kDigits),
                "robots.keys:1: found \"256\" as ID, expected a whole number from 1 to 254"},
        Mistake{"7x " + std::string(kDigits),
                "robots.keys:1: found \"7x\" as ID, expected a whole number from 1 to 254"},
        Mistake{"-7 " + std::string(kDigits),
                "robots.keys:1: found \"-7\" as ID, expected a whole number from 1 to 254"},
        // It is a secret.
        Mistake{kDigits,
                "robots.keys:1: found a word of 32 characters as ID, expected a whole "
                "number from 1 to 254"},
        Mistake{"7", "robots.keys:1: robot 7 has no key, expected ID KEY [COMMENT]"},
        Mistake{"7 # later", "robots.keys:1: robot 7 has no key, expected ID KEY [COMMENT]"},
        Mistake{"7 " + std::string(kDigits).substr(1),
                "robots.keys:1: found a key of 31 digits, expected 32 hexadecimal digits"},
        Mistake{"7 " + std::string(kDigits) + "0",
                "robots.keys:1: found a key of 33 digits, expected 32 hexadecimal digits"},
        Mistake{"7 00:01",
                "robots.keys:1: character 3 of the key is no digit, expected 32 "
                "hexadecimal digits"},
        Mistake{"7 " + std::string(kDigits) + "\n\n7 ffffffffffffffffffffffffffffffff",
                "robots.keys:3: robot 7 again, as in line 1, expected one line a robot, with a key "
                "of its own"},
        Mistake{"7 " + std::string(kDigits) + "\n8 000102030405060708090A0B0C0D0Eff",
                "robots.keys:2: the key of robot 7 again, as in line 1, expected one line a "
                "robot, with a key of its own"},
        Mistake{std::string("\xFF\xFE\x37\0", 4),
                "robots.keys:1: found the byte order mark of UTF-16 or UTF-32, expected UTF-8"}));

TEST(KeysFile, ChangesKeepAllOtherLines) {
  auto file = KeysFile::Parse("# ours\r\n7 " + std::string(kDigits) +
                                  " red\n\n# blue:\n9 ffffffffffffffffffffffffffffffff # blue",
                              "k");
  ASSERT_TRUE(file.ok()) << file.error();
  EXPECT_FALSE(file.value().Add(7, kKeyOfEight));
  EXPECT_TRUE(file.value().Add(8, kKeyOfEight));
  EXPECT_TRUE(file.value().Remove(7));
  EXPECT_FALSE(file.value().Remove(7));
  EXPECT_EQ(file.value().text(),
            "# ours\r\n\n# blue:\n9 ffffffffffffffffffffffffffffffff # blue\n"
            "8 ab010000000000000000000000000000\n");
  EXPECT_TRUE(file.value().Remove(9));  // its line has moved
  EXPECT_EQ(file.value().text(), "# ours\r\n\n# blue:\n8 ab010000000000000000000000000000\n");
  EXPECT_EQ(file.value().keys(), (Keys{{8, kKeyOfEight}}));
}

class KeysFileOnDisk : public ::testing::Test {
 protected:
  mode_t Mode() const {
    struct stat status {};
    return stat(path_.c_str(), &status) == 0 ? status.st_mode & 07777u : 0;
  }

  Status Change(const std::function<Status(KeysFile*)>& change) const {
    return KeysFile::Change(path_, KeysFile::IfMissing::kBegin, change);
  }

  const TemporaryFolder folder_;
  const std::string path_ = (folder_ / "robots.keys").string();
};

TEST_F(KeysFileOnDisk, IsReadAsItWasWrittenByItsOwnerOnly) {
  std::string text;
  const mode_t before = umask(0);
  const Status written = Change([&](KeysFile* file) {
    EXPECT_TRUE(file->Add(7, kKeyOfSeven));
    text = file->text();
    return Ok();
  });
  umask(before);
  ASSERT_TRUE(written.ok()) << written.error();
  EXPECT_EQ(Mode(), 0600U);
  const auto read = KeysFile::Read(path_);
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(read.value().keys(), (Keys{{7, kKeyOfSeven}}));
  EXPECT_EQ(read.value().text(), text);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(KeysFileOnDisk, ThatOthersMayReadOrChangeIsRefused) {
  ASSERT_TRUE(Change([](KeysFile*) { return Ok(); }).ok());
  for (const mode_t mode : {0640u, 0604u, 0620u, 0602u}) {
    ASSERT_EQ(chmod(path_.c_str(), mode), 0);
    EXPECT_EQ(KeysFile::Read(path_).ErrorOr("none"),
              path_ +
                  ": others than its owner may read it or change it, expected mode 0600: "
                  "chmod 600 " +
                  path_);
  }
  ASSERT_EQ(chmod(path_.c_str(), 0400), 0);
  EXPECT_TRUE(KeysFile::Read(path_).ok());
}

TEST_F(KeysFileOnDisk, IsUnchangedByAChangeThatFails) {
  EXPECT_EQ(Change([](KeysFile*) { return Error{"no"}; }).ErrorOr(""), "no");
  EXPECT_FALSE(std::filesystem::exists(path_));
  EXPECT_EQ(KeysFile::Change(path_, KeysFile::IfMissing::kError, [](KeysFile*) { return Ok(); })
                .ErrorOr(""),
            path_ + ": cannot be opened: No such file or directory");
}

TEST_F(KeysFileOnDisk, ThatIsMissingOrWrongIsNamed) {
  EXPECT_EQ(KeysFile::Read(path_).ErrorOr("none"),
            path_ + ": cannot be opened: No such file or directory");
  std::ofstream(path_) << "\n7\n";
  ASSERT_EQ(chmod(path_.c_str(), 0600), 0);
  EXPECT_EQ(KeysFile::Read(path_).ErrorOr("none"),
            path_ + ":2: robot 7 has no key, expected ID KEY [COMMENT]");
}

}  // namespace
}  // namespace pheromone::signing
