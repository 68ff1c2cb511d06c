// [capture]: what it means, and each way to get it wrong.

#include "server/config/testing/config_text.h"

namespace pheromone::config {
namespace {

CaptureSettings Read(const std::string& table) {
  const Result<Config> config = ParseConfig(std::string(DefaultConfigText()) + table, "lab.toml");
  EXPECT_TRUE(config.ok()) << config.error();
  return config.ok() ? config.value().capture : CaptureSettings();
}

TEST(CaptureSettings, WithoutTheTableNothingIsRecorded) {
  const CaptureSettings expected{
      .start = false, .folder = "captures", .file_mb = 64, .most_files = 16};
  EXPECT_EQ(Read(""), expected);
  EXPECT_EQ(Read("[capture]\n"), expected);
}

TEST(CaptureSettings, TakesWhatTheTableSays) {
  const CaptureSettings expected{.start = true, .folder = "x/y", .file_mb = 5, .most_files = 0};
  EXPECT_EQ(Read("[capture]\nstart = true\nfolder = \"x/y\"\nmax_mb = 5\nmax_files = 0\n"),
            expected);
}

TEST(CaptureSettings, TheTextOfTheFileGoesAlong) {
  const Result<Config> config = ParseConfig(DefaultConfigText(), "lab.toml");
  ASSERT_TRUE(config.ok());
  EXPECT_EQ(config.value().text, DefaultConfigText());
}

class CaptureErrorsTest : public ErrorsTest {};

TEST_P(CaptureErrorsTest, NamesPlaceKeyAndExpectation) {
  ExpectError();
}

// After the text, whose last line is 37.
INSTANTIATE_TEST_SUITE_P(
    Captures, CaptureErrorsTest,
    ::testing::Values(
        Case{37, "listen = \"127.0.0.1:4950\"\n[capture]\nfolder = \"\"",
             "39:10: capture.folder: found the string \"\", expected a string that is not empty"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[capture]\nfolder = 3",
             "39:10: capture.folder: found 3, expected a string that is not empty"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[capture]\nstart = \"yes\"",
             "39:9: capture.start: found the string \"yes\", expected true or false"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[capture]\nmax_mb = 0",
             "39:10: capture.max_mb: found 0, expected a whole number from 1 to 1000000"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[capture]\nmax_files = -1",
             "39:13: capture.max_files: found -1, expected a whole number from 0 to 1000000"},
        Case{37, "listen = \"127.0.0.1:4950\"\n[capture]\nmax_file = 1",
             "39:1: capture.max_file: unknown key, expected max_files?"}));

}  // namespace
}  // namespace pheromone::config
