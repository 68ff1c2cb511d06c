#include "server/core/petri/claim_names.h"

#include <gtest/gtest.h>

namespace pheromone::petri {
namespace {

TEST(ClaimNames, AreWordsAndTextsInQuotes) {
  const Renaming names{{"always", "no"}, {"and", "no"}, {"N1", "no"}, {"N1.a", "A"},
                       {"b c", "B"},     {"b", "no"},   {"_d", "no"}, {"_d-1", "D"}};
  EXPECT_EQ(RenameIn("always 2 * N1.a - \"b c\" <= 10 and(_d-1=0)", names),
            "always 2 * A - B <= 10 and(D=0)");
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
