#include "server/base/text.h"

#include <gtest/gtest.h>

namespace pheromone {
namespace {

TEST(Text, IsTrimmedOfTheBlanksThatAreNamed) {
  EXPECT_EQ(Trim("\r\t a b \t\r"), "a b");
  EXPECT_EQ(Trim("a"), "a");
  EXPECT_EQ(Trim("\ta\n"), "a\n");
  EXPECT_EQ(Trim(" \ta \n", " \n"), "\ta");
}

TEST(Text, OfBlanksAloneIsItsEmptyEnd) {
  const std::string_view blanks = " \t ";
  EXPECT_EQ(Trim(blanks).size(), 0u);
  EXPECT_EQ(Trim(blanks).data(), blanks.data() + blanks.size());
  EXPECT_EQ(Trim(""), "");
}

TEST(Text, HasLowerCaseForTheLettersOfAsciiAlone) {
  EXPECT_EQ(ToLower("AZaz@[`{09.-_\xC3\x84"), "azaz@[`{09.-_\xC3\x84");
  EXPECT_EQ(ToLower(""), "");
}

TEST(Text, OfACellIsQuotedIfItHasTo) {
  EXPECT_EQ(CsvCell("a b;'c'"), "a b;'c'");
  EXPECT_EQ(CsvCell("a,b"), "\"a,b\"");
  EXPECT_EQ(CsvCell("say \"a\"\n"), "\"say \"\"a\"\"\n\"");
}

}  // namespace
}  // namespace pheromone
