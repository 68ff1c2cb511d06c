#include "server/core/petri/claim_names.h"

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
            "never ab + N1.a >= 2*N1.a");
  EXPECT_EQ(RenameIn("live a \"x y\"", {{"a", "1a"}}), "live \"1a\" \"x y\"");
  EXPECT_EQ(RenameIn("always a < \"b", {{"b", "c"}}), "always a < \"b");  // an error of the claim
}

// An entrance has a place `at`.
TEST(ClaimNames, AreNoKeywords) {
  const Renaming names{{"at", "N1.at"}, {"and", "N1.and"}, {"live", "N1.live"}, {"t", "or"}};
  EXPECT_EQ(RenameIn("overtaken at most 2 by t while \"at\" + live = 1", names),
            "overtaken at most 2 by \"or\" while N1.at + N1.live = 1");
}

}  // namespace
}  // namespace pheromone::petri
