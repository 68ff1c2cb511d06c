#include "server/petri/claim_names.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace pheromone::petri {
namespace {

TEST(ClaimNames, AreWordsAndTextsInQuotes) {
  std::vector<std::string> names;
  ForEachName("always 2 * N1.a - \"b c\" <= 10 and(_d-1=0)",
              [&](std::string_view name) { names.emplace_back(name); });
  EXPECT_EQ(names, (std::vector<std::string>{"N1.a", "b c", "_d-1"}));
}

TEST(ClaimNames, AreRenamedAsWholeWordsAndQuotedIfTheyMustBe) {
  EXPECT_EQ(RenameIn("never ab + a >= 2*\"a\"", {{"a", "N1.a"}, {"b", "c"}}),
            "never ab + N1.a >= 2*\"N1.a\"");
  EXPECT_EQ(RenameIn("live a \"x y\"", {{"a", "1a"}}), "live \"1a\" \"x y\"");
  EXPECT_EQ(RenameIn("always a < \"b", {{"b", "c"}}), "always a < \"c\"");
}

// An entrance has a place `at`.
TEST(ClaimNames, AreNoKeywords) {
  const Renaming names{{"at", "N1.at"}, {"and", "N1.and"}, {"live", "N1.live"}, {"t", "N1.t"}};
  EXPECT_EQ(RenameIn("overtaken at most 2 by t while \"at\" + live = 1", names),
            "overtaken at most 2 by N1.t while \"N1.at\" + N1.live = 1");
  EXPECT_EQ(RenameIn("always at = 1 and \"and\" = 1", names),
            "always N1.at = 1 and \"N1.and\" = 1");
  EXPECT_EQ(RenameIn("live t live", names), "live N1.t N1.live");
}

}  // namespace
}  // namespace pheromone::petri
