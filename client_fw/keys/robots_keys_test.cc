#include "client_fw/keys/robots_keys.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "server/base/testing/temporary_folder.h"

namespace pheromone::keys {
namespace {

constexpr char kFile[] =
    "7 000102030405060708090a0b0c0d0eff the red one\n"
    "8 ab010000000000000000000000000000\n";

class RobotsKeysTest : public ::testing::Test {
 protected:
  RobotsKeysTest() {
    std::ofstream(path_) << kFile;
    std::filesystem::permissions(path_, std::filesystem::perms::owner_read);
  }

  const TemporaryFolder folder_;
  const std::string path_ = (folder_ / "robots.keys").string();
};

TEST_F(RobotsKeysTest, EachStartHasTheKeysAndANumberOfItsOwn) {
  const RobotsKeys first = TakeKeys(path_, {7, 8}).value();
  EXPECT_EQ(first.first_start, 1);
  EXPECT_EQ(first.keys.at(7),
            (signing::Key{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 255}));
  EXPECT_EQ(first.keys.at(8), (signing::Key{0xAB, 1}));
  // Which robots they are makes no difference: each number is used once with any key of the file.
  EXPECT_EQ(TakeKeys(path_, {8}, 3).value().first_start, 2);
  EXPECT_EQ(TakeKeys(path_, {7}).value().first_start, 5);
}

TEST_F(RobotsKeysTest, ARobotWithoutAKeyIsNamedAndNoStartIsCounted) {
  EXPECT_EQ(TakeKeys(path_, {7, 8, 9}).error(),
            path_ + ": robot 9 has no key, expected a line \"9 KEY\"");
  EXPECT_FALSE(std::filesystem::exists(path_ + ".starts"));
}

TEST_F(RobotsKeysTest, AFileThatOthersMayReadIsRefused) {
  std::filesystem::permissions(path_, std::filesystem::perms::group_read,
                               std::filesystem::perm_options::add);
  EXPECT_NE(TakeKeys(path_, {7}).error().find(path_), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path_ + ".starts"));
}

}  // namespace
}  // namespace pheromone::keys
