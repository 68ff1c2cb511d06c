// [journal]: its keys, and each way to get it wrong.

#include "server/config/testing/config_text.h"

namespace pheromone::config {
namespace {

using Durability = JournalConfig::Durability;

std::string Appended(std::string_view text) {
  return Replaced(37, "listen = \"127.0.0.1:4950\"\n" + std::string(text));
}

TEST(JournalSection, WithoutItTheDefaultsCount) {
  const auto config = ParseConfig(kGood, "f.toml");
  ASSERT_TRUE(config.ok());
  EXPECT_EQ(config.value().journal, JournalConfig{});
  EXPECT_EQ(config.value().journal.durability, Durability::kDurable);
  EXPECT_TRUE(config.value().journal.folder.empty());
}

TEST(JournalSection, AllOfItIsRead) {
  const auto config = ParseConfig(
      Appended("[journal]\nfolder = \"state\"\ndurability = \"relaxed\"\nsync_s = 0.25\n"
               "segment_mib = 2\nsnapshot_mib = 3\nsnapshot_s = 60\nkeep_snapshots = 4\n"
               "evaporate_while_down = false"),
      "f.toml");
  ASSERT_TRUE(config.ok()) << config.error();
  JournalConfig expected;
  expected.folder = "state";
  expected.durability = Durability::kRelaxed;
  expected.sync_interval_ms = 250;
  expected.segment_bytes = 2 << 20;
  expected.snapshot_bytes = 3 << 20;
  expected.snapshot_ms = 60'000;
  expected.keep_snapshots = 4;
  expected.evaporate_while_down = false;
  EXPECT_EQ(config.value().journal, expected);
}

class JournalErrorsTest : public ErrorsTest {};

TEST_P(JournalErrorsTest, NamesPlaceKeyAndExpectation) {
  EXPECT_EQ(ErrorOf(Appended("[journal]\n" + std::string(GetParam().with))),
            "f.toml:" + std::string(GetParam().error));
}

INSTANTIATE_TEST_SUITE_P(
    Journal, JournalErrorsTest,
    ::testing::Values(
        Case{0, "folder = \"\"",
             "39:10: journal.folder: found the string \"\", expected a string that is not empty"},
        Case{0, "durability = \"sometimes\"",
             "39:14: journal.durability: found the string \"sometimes\", expected one of "
             "\"durable\", \"relaxed\", \"none\""},
        Case{0, "segment_mib = 0",
             "39:15: journal.segment_mib: found 0, expected a whole number from 1 to 1024"},
        Case{0, "keep_snapshots = 0",
             "39:18: journal.keep_snapshots: found 0, expected a whole number from 1 to 100"},
        Case{0, "snapshot_s = 0.5",
             "39:14: journal.snapshot_s: found 0.5, expected a number from 1 to 604800"},
        Case{0, "sync_s = 1",
             "39:1: journal.sync_s: not permitted with durability = \"durable\" or \"none\", "
             "expected only with \"relaxed\""},
        Case{0, "evaporate_while_down = 1",
             "39:24: journal.evaporate_while_down: found 1, expected true or false"},
        Case{0, "foldr = \"x\"", "39:1: journal.foldr: unknown key, expected folder?"}));

TEST(JournalSection, IsATable) {
  EXPECT_EQ(ErrorOf("journal = 3\n" + std::string(kGood)),
            "f.toml:1:11: journal: found 3, expected a table [journal]");
}

}  // namespace
}  // namespace pheromone::config
