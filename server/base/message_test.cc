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

TEST(Messages, AByteOrderMarkIsSkippedOrNamed) {
  std::string_view text =
      "\xEF\xBB\xBF"
      "a = 1";
  EXPECT_TRUE(SkipByteOrderMark(&text).ok());
  EXPECT_EQ(text, "a = 1");
  EXPECT_TRUE(SkipByteOrderMark(&text).ok());
  EXPECT_EQ(text, "a = 1");
  for (std::string_view wide :
       {std::string_view("\xFF\xFE"
                         "a\0",
                         4),
        std::string_view("\xFE\xFF\0a", 4), std::string_view("\0\0\xFE\xFF", 4)}) {
    EXPECT_EQ(SkipByteOrderMark(&wide).ErrorOr(""),
              "found the byte order mark of UTF-16 or UTF-32, expected UTF-8");
  }
}

}  // namespace
}  // namespace pheromone
