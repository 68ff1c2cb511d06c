#include "server/tags/sentence.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::tags {
namespace {

class SentenceTest : public testing::Test {
 protected:
  SentenceTest() {
    tables_.DefineRobot(15, "123-233-201");
    tables_.DefineString(15, 1, "http://example.org/ns#");
    tables_.DefineString(15, 2, "lookingfortag");
    naming_.tags.Add(7, "dock");
  }

  // The terms of a sentence as words 2 to 7, or the error.
  std::string WordsOf(const std::string& sentence) {
    const Result<Block> block = ParseSentence(sentence, 15, naming_, &tables_);
    if (!block.ok()) {
      return block.error();
    }
    std::string text;
    const Words words = ToWords(block.value());
    for (size_t i = 2; i < words.size(); ++i) {
      text += (i > 2 ? " " : "") + std::to_string(words[i]);
    }
    return text;
  }

  std::string Again(const std::string& sentence) {
    const Result<Block> block = ParseSentence(sentence, 15, naming_, &tables_);
    return block.ok() ? SentenceOf(block.value(), tables_, naming_) : block.error();
  }

  SymbolTables tables_;
  Naming naming_;
};

TEST_F(SentenceTest, ThePapersExampleIsAQuintet) {
  EXPECT_EQ(WordsOf("15 lookingfortag 244"), "-17 15 1 2 -3 244");
  EXPECT_EQ(
      SentenceOf({.author = 15, .subject = {-17, 15}, .predicate = {1, 2}, .object = {-3, 244}},
                 tables_, naming_),
      "robot:15 lookingfortag 244");
}

TEST_F(SentenceTest, EachTypeOfObjectHasItsForm) {
  tables_.DefineString(15, 3, "two \"words\"");
  EXPECT_EQ(WordsOf("15 lookingfortag -5"), "-17 15 1 2 -3 -5");
  EXPECT_EQ(WordsOf("15 lookingfortag 1.0"), "-17 15 1 2 -4 1065353216");
  EXPECT_EQ(WordsOf("15 lookingfortag 1e0"), "-17 15 1 2 -4 1065353216");
  EXPECT_EQ(WordsOf("15 lookingfortag -INF"), "-17 15 1 2 -4 -8388608");
  EXPECT_EQ(WordsOf("15 lookingfortag \"two \\\"words\\\"\""), "-17 15 1 2 -1 3");
  EXPECT_EQ(WordsOf("15 lookingfortag ' '"), "-17 15 1 2 -2 32");
  EXPECT_EQ(WordsOf("15 lookingfortag '\\''"), "-17 15 1 2 -2 39");
  EXPECT_EQ(WordsOf("15 lookingfortag 'U+000A'"), "-17 15 1 2 -2 10");
  EXPECT_EQ(WordsOf("15 lookingfortag 2006-01-28T14:20:00Z"), "-17 15 1 2 -5 1138458000");
  EXPECT_EQ(WordsOf("15 lookingfortag 2006-01-28"), "-17 15 1 2 -6 13176");
  EXPECT_EQ(WordsOf("15 lookingfortag 14:20:00"), "-17 15 1 2 -7 51600000");
  EXPECT_EQ(WordsOf("15 lookingfortag robot:15"), "-17 15 1 2 -17 15");
  EXPECT_EQ(WordsOf("15 lookingfortag robot:123-233-201"), "-17 15 1 2 -17 15");
  EXPECT_EQ(WordsOf("15 lookingfortag tag:7"), "-17 15 1 2 -18 7");
  EXPECT_EQ(WordsOf("tag:dock <http://example.org/ns#lookingfortag> lookingfortag"),
            "-18 7 1 2 1 2");
}

TEST_F(SentenceTest, NewWordsAndTextsGetNumbers) {
  EXPECT_EQ(WordsOf("15 foundtag \"book\""), "-17 15 1 3 -1 4");
  EXPECT_EQ(*tables_.StringOf(15, 3), "foundtag");
  EXPECT_EQ(WordsOf("15 foundtag <urn:book>"), "-17 15 1 3 0 5");
}

TEST_F(SentenceTest, WhatIsShownCanBeWritten) {
  for (const char* const sentence :
       {"robot:15 lookingfortag 244", "tag:7 prohibits wateringplants", "robot:15 speed 1.0",
        "robot:15 speed -0.0", "robot:15 speed 1e+10", "robot:15 speed NaN", "robot:15 speed INF",
        "robot:15 says \"a \\\\ and \\\" b\"", "robot:15 says 'x'", "robot:15 says '\\\\'",
        "robot:15 says 'U+0000'", "robot:15 washere 2006-01-28T14:20:00Z",
        "robot:15 washere -0001-12-31", "robot:15 washere 14:20:00.250", "robot:15 near tag:9",
        "<urn:book> is <http://example.org/ns#NaN>",
        "robot:15 met <http://robots.org/robot-number/9>",
        "robot:15 says <http://robots.org/unresolved/123-233-201/99>",
        "<http://robots.org/unresolved/123-233-201/1/99> is <http://robots.org/text/a%20b>"}) {
    EXPECT_EQ(Again(sentence), sentence);
  }
}

TEST_F(SentenceTest, ObjectsOfUnknownTypesAreShownAsNumbers) {
  EXPECT_EQ(SentenceOf({.author = 15, .subject = {-18, 7}, .predicate = {1, 2}, .object = {-16, 5}},
                       tables_, naming_),
            "tag:7 lookingfortag (-16, 5)");
}

TEST_F(SentenceTest, MistakesAreNamed) {
  EXPECT_EQ(
      WordsOf(""),
      "found 0 terms, expected three: a subject, a predicate and an object (text with spaces in "
      "quotation marks)");
  EXPECT_EQ(WordsOf("15 says two words").substr(0, 29), "found 4 terms, expected three");
  EXPECT_EQ(WordsOf("16 says x"),
            "the subject is 16, expected the number or unique ID of a robot in the table");
  EXPECT_EQ(WordsOf("15 met robot:99-1"),
            "the object is robot:99-1, expected the number or unique ID of a robot in the table");
  EXPECT_EQ(WordsOf("15 near tag:0"), "the object is tag:0, expected the number or name of a tag");
  EXPECT_EQ(WordsOf("15 near tag:gate"),
            "the object is tag:gate, expected the number or name of a tag");
  EXPECT_EQ(WordsOf("1.5 says x"),
            "the subject is 1.5, expected a robot's number, robot:ID, tag:NAME, a word or <IRI>");
  EXPECT_EQ(WordsOf("\"x\" says x"),
            "the subject is \"x\", expected a robot's number, robot:ID, tag:NAME, a word or <IRI>");
  EXPECT_EQ(WordsOf("15 244 x"), "the predicate is 244, expected a word or <IRI>");
  EXPECT_EQ(WordsOf("15 robot:15 x"), "the predicate is robot:15, expected a word or <IRI>");
  EXPECT_EQ(WordsOf("15 rdf:type x"), "the predicate is rdf:type, expected a word or <IRI>");
  EXPECT_EQ(WordsOf("15 says \"x"), "found \"x, expected \" at its end");
  EXPECT_EQ(WordsOf("15 says \"x\"y"), "found \"y\" after \"x\", expected a space");
  EXPECT_EQ(WordsOf("15 says \"\\n\""), "found \\n in \"\\n\", expected \\\" or \\\\");
  EXPECT_EQ(WordsOf("15 says <urn:x"), "found <urn:x, expected > at its end");
  EXPECT_EQ(WordsOf("15 says <x>"),
            "the object is <x>, expected an absolute IRI such as <http://example.org/ns#cleaning>");
  EXPECT_EQ(WordsOf("15 says 'ab'"),
            "the object is \"ab\", expected one character, or U+ and its number");
  EXPECT_EQ(WordsOf("15 says 2147483648"),
            "the object is \"2147483648\", expected a whole number from -2147483648 to 2147483647");
  EXPECT_EQ(
      WordsOf("15 says 2007-02-29"),
      "the object is \"2007-02-29\", expected a day of the calendar without a time zone, such "
      "as 2006-01-28");
  EXPECT_EQ(WordsOf("15 says 2006-01-28T14:20"),
            "the object is \"2006-01-28T14:20\", expected whole seconds from 1970 to 2106 with a "
            "time zone, such as 2006-01-28T14:20:00Z");
  EXPECT_EQ(
      WordsOf("15 says 25:00:00"),
      "the object is \"25:00:00Z\", expected UTC with at most milliseconds, such as 14:20:00Z");
  EXPECT_EQ(WordsOf("15 says \"" + std::string(256, 'x') + "\""),
            "the object is \"" + std::string(80, 'x') +
                "...\" of 256 bytes, expected strings of 1 to 255 bytes of UTF-8 without control "
                "characters");
  EXPECT_EQ(
      WordsOf("15 says ?"),
      "the object is ?, expected a number, a date or time, \"text\", 'c', robot:ID, tag:NAME, "
      "a word or <IRI>");
  EXPECT_FALSE(ParseSentence("15 says x", 3, naming_, &tables_).ok());
}

TEST_F(SentenceTest, AFailedSentenceLeavesTheTables) {
  const size_t before = tables_.rows().size();
  WordsOf("unheard-of says 2007-02-29");
  EXPECT_EQ(tables_.rows().size(), before);
}

}  // namespace
}  // namespace pheromone::tags
