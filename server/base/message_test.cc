#include "server/base/message.h"

#include <gtest/gtest.h>

namespace pheromone {
namespace {

TEST(Messages, SayWhereInTheFormAnEditorUnderstands) {
  EXPECT_EQ(AtLine("a.csv", 3, 7, "no"), "a.csv:3:7: no");
  EXPECT_EQ(AtLine("a.csv", 3, 0, "no"), "a.csv:3: no");
  EXPECT_EQ(AtByte("a.npy", 0, "no"), "a.npy: byte 0: no");
}

TEST(Messages, QuoteShortlyAndPrintably) {
  EXPECT_EQ(Quoted("abc"), "\"abc\"");
  EXPECT_EQ(Quoted(std::string_view("\0\n\xFF~", 4)), "\"???~\"");
  EXPECT_EQ(Quoted(std::string(33, 'x')), "\"" + std::string(32, 'x') + "...\"");
}

}  // namespace
}  // namespace pheromone
