// [[tag]] and [tags].
#include "server/config/describe.h"
#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

class TagTest : public FolderTest {
 protected:
  tags::Settings Tags(std::string_view more) const {
    const Result<Config> parsed = Parse(more);
    EXPECT_TRUE(parsed.ok()) << parsed.error();
    return parsed.ok() ? parsed.value().engine.tags : tags::Settings{};
  }
  std::string ErrorIn(std::string_view more) const {
    const Result<Config> parsed = Parse(more);
    return parsed.ErrorOr("");
  }
};

constexpr std::string_view kDoor = "[[tag]]\nname = \"door\"\nx_m = 1.5\ny_m = 2\n";

TEST_F(TagTest, NeedNotBeThere) {
  EXPECT_TRUE(Tags("").tags.empty());
}

TEST_F(TagTest, HaveAPlaceARangeAndSlots) {
  const auto settings =
      Tags(std::string(kDoor) +
           "[[tag]]\nname = \"far\"\nx_m = 10\ny_m = 8\nrange_m = 32.767\nslots = 64\n");
  EXPECT_EQ(settings.tags,
            (std::vector<tags::TagSettings>{{"door", 1'500'000, 2'000'000, 1'000'000, 8},
                                            {"far", 10'000'000, 8'000'000, 32'767'000, 64}}));
  EXPECT_EQ(settings.privileged, std::vector<std::string>{"operator"});
}

TEST_F(TagTest, NameTheirPrivilegedAuthors) {
  EXPECT_EQ(Tags("[tags]\nprivileged = [\"ann\", \"123-233-201\"]\n").privileged,
            (std::vector<std::string>{"ann", "123-233-201"}));
  EXPECT_EQ(Tags("[tags]\nprivileged = []\n").privileged, std::vector<std::string>{});
}

TEST_F(TagTest, AreDescribed) {
  const Result<Config> parsed = Parse(kDoor);
  ASSERT_TRUE(parsed.ok());
  const std::vector<std::string> lines = DescribeConfig(parsed.value());
  EXPECT_NE(std::find(lines.begin(), lines.end(),
                      "tag \"door\" at (1.5, 2), 8 slots, in range up to 1 m"),
            lines.end());
}

TEST_F(TagTest, MistakesAreNamed) {
  EXPECT_EQ(ErrorIn("[[tag]]\nname = \"a\"\nx_m = 11\ny_m = 2\n"),
            "f.toml:31:7: tag[1].x_m: found 11, expected a number from 0 to 10");
  EXPECT_EQ(ErrorIn("[[tag]]\nname = \"a\"\ny_m = 2\n"),
            "f.toml:29:1: tag[1].x_m: missing, expected a number from 0 to 10");
  EXPECT_EQ(ErrorIn(std::string(kDoor) + "range_m = 40\n"),
            "f.toml:33:11: tag[1].range_m: found 40, expected a number from 0.000001 to 32.767");
  EXPECT_EQ(ErrorIn(std::string(kDoor) + "slots = 65\n"),
            "f.toml:33:9: tag[1].slots: found 65, expected a whole number from 1 to 64");
  EXPECT_EQ(ErrorIn(std::string(kDoor) + std::string(kDoor)),
            "f.toml:34:8: tag[2].name: found the string \"door\" again, expected a value not used "
            "by another tag");
  EXPECT_EQ(ErrorIn("[tags]\nprivileged = \"ann\"\n"),
            "f.toml:30:14: tags.privileged: found the string \"ann\", expected unique IDs of 1 to "
            "255 bytes, such as [\"operator\"]");
  EXPECT_EQ(ErrorIn("[tags]\nprivileged = [\"\"]\n"),
            "f.toml:30:15: tags.privileged: found the string \"\", expected unique IDs of 1 to 255 "
            "bytes, such as [\"operator\"]");
  EXPECT_EQ(ErrorIn("[tags]\nprivilged = []\n"),
            "f.toml:30:1: tags.privilged: unknown key, expected privileged?");
}

}  // namespace
}  // namespace pheromone::config
