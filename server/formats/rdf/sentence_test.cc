#include "server/formats/rdf/sentence.h"

#include <gtest/gtest.h>

#include <bit>
#include <string>

namespace pheromone::tags {
namespace {

class SentenceTest : public ::testing::Test {
 protected:
  SentenceTest() {
    tables_.DefineRobot(1, "operator");
    tables_.DefineRobot(15, "123-233-201");
  }

  Block Parsed(std::string_view sentence) {
    const Result<Block> block = ParseSentence(sentence, 1, &tables_);
    EXPECT_TRUE(block.ok()) << sentence << ": " << block.error();
    return block.ok() ? block.value() : Block{};
  }
  Term Object(const std::string& text) { return Parsed("15 is " + text).object; }
  std::string ErrorOf(std::string_view sentence) {
    const Result<Block> block = ParseSentence(sentence, 1, &tables_);
    return block.ErrorOr("");
  }

  SymbolTables tables_;
};

TEST_F(SentenceTest, ThePapersExample) {
  const Block block = Parsed("15 lookingfortag 244");
  EXPECT_EQ(block.author, 1);
  EXPECT_EQ(block.subject, (Term{-17, 15}));
  EXPECT_EQ(*tables_.StringOf(1, block.predicate.space), "http://example.org/ns#");
  EXPECT_EQ(*tables_.StringOf(1, block.predicate.value), "lookingfortag");
  EXPECT_EQ(block.object, (Term{-3, 244}));
}

TEST_F(SentenceTest, ObjectsOfEachType) {
  EXPECT_EQ(*tables_.StringOf(1, Object("\"wet \\\"paint\\\" \\\\\"").value), "wet \"paint\" \\");
  EXPECT_EQ(Object("'x'"), (Term{-2, 'x'}));
  EXPECT_EQ(Object("' '"), (Term{-2, ' '}));
  EXPECT_EQ(Object("'''"), (Term{-2, '\''}));
  EXPECT_EQ(Object("'\u6e05'"), (Term{-2, 0x6e05}));
  EXPECT_EQ(Object("'U+000A'"), (Term{-2, 10}));
  EXPECT_EQ(Object("-2147483648"), (Term{-3, INT32_MIN}));
  EXPECT_EQ(Object("1.5"), (Term{-4, 0x3fc00000}));
  EXPECT_EQ(Object("-0.0"), (Term{-4, INT32_MIN}));
  EXPECT_EQ(Object("1e3"), (Term{-4, 0x447a0000}));
  EXPECT_EQ(Object("-INF"), (Term{-4, std::bit_cast<int32_t>(0xff800000u)}));
  EXPECT_EQ(Object("2006-01-28T14:20:00Z"), (Term{-5, 1'138'458'000}));
  EXPECT_EQ(Object("2106-02-07T06:28:15Z"), (Term{-5, -1}));
  EXPECT_EQ(Object("1970-01-02"), (Term{-6, 1}));
  EXPECT_EQ(Object("1969-12-31"), (Term{-6, -1}));
  EXPECT_EQ(Object("2000-02-29"), (Term{-6, 11'016}));
  EXPECT_EQ(Object("14:20:00"), (Term{-7, 51'600'000}));
  EXPECT_EQ(Object("23:59:59.999"), (Term{-7, 86'399'999}));
  EXPECT_EQ(Object("robot:15"), (Term{-17, 15}));
  EXPECT_EQ(Object("robot:123-233-201"), (Term{-17, 15}));
  EXPECT_EQ(Object("tag:7"), (Term{-18, 7}));
  EXPECT_EQ(Object("type-99:-7"), (Term{-99, -7}));
}

TEST_F(SentenceTest, NumbersBeginWithOne) {
  EXPECT_EQ(Parsed("1 is tag:1").subject, (Term{-17, 1}));
  EXPECT_EQ(Parsed("tag:1 is robot:1").subject, (Term{-18, 1}));
  EXPECT_EQ(Object("tag:1"), (Term{-18, 1}));
  EXPECT_EQ(Object("robot:1"), (Term{-17, 1}));
  for (const char* const sentence : {"0 is 1", "tag:0 is 1", "1 is tag:0", "1 is robot:0"}) {
    EXPECT_NE(ErrorOf(sentence), "") << sentence;
  }
}

TEST_F(SentenceTest, IrisAreSplitBehindTheirNamespace) {
  const Term term = Object("<http://robots.org/robot/door>");
  EXPECT_EQ(*tables_.StringOf(1, term.space), "http://robots.org/robot/");
  EXPECT_EQ(*tables_.StringOf(1, term.value), "door");
  EXPECT_EQ(Object("<urn:door>").space, 0);
  EXPECT_EQ(Object("<http://example.org/ns#open>"), Object("open"));
}

TEST_F(SentenceTest, AnIriIsTheSameHoweverItIsSplit) {
  tables_.DefineString(15, 4, "http://example.org/");
  tables_.DefineString(15, 5, "ns#open");
  tables_.DefineString(15, 6, "http://example.org/ns#open");
  EXPECT_EQ(ObjectText({4, 5}, 15, tables_), "open");
  EXPECT_EQ(ObjectText({0, 6}, 15, tables_), "open");
  EXPECT_EQ(ObjectText({4, 4}, 15, tables_), "<http://example.org/http://example.org/>");
  EXPECT_EQ(IriText("http://example.org/ns#open"), "open");
  EXPECT_EQ(IriText("http://example.org/ns#7"), "<http://example.org/ns#7>");
  EXPECT_EQ(IriText("http://example.org/ns#"), "<http://example.org/ns#>");
  // What an author has said before, it says with the same numbers: so that --replace finds it.
  tables_.DefineString(1, 8, "http://example.org/");
  tables_.DefineString(1, 9, "ns#shut");
  EXPECT_EQ(Object("shut"), (Term{8, 9}));
}

TEST_F(SentenceTest, PrintedSentencesReadBackTheSame) {
  for (const std::string_view sentence :
       {"15 lookingfortag 244",
        "tag:7 note \"wet \\\"paint\\\" \\\\\"",
        "door is open",
        "15 is 'x'",
        "15 is '''",
        "15 is 'U+000A'",
        "15 is '\u6e05'",
        "15 is 1.5",
        "15 is 100.0",
        "15 is 1e+30",
        "15 is -0.0",
        "15 is NaN",
        "15 is INF",
        "15 is 2006-01-28T14:20:00Z",
        "15 is 2106-02-07T06:28:15Z",
        "15 is 2000-02-29",
        "15 is 14:20:00",
        "15 is 23:59:59.007",
        "15 is robot:15",
        "15 is tag:7",
        "15 is type-99:-7",
        "15 is <urn:door>",
        "<http://robots.org/a/b> <http://robots.org/c> <http://x.y/#z>",
        "15 is <http://example.org/ns#5>",
        "15 is unknown:0/999",
        "15 unknown:998/999 7"}) {
    const Block block = Parsed(sentence);
    EXPECT_EQ(SentenceOf(block, tables_), sentence);
  }
}

TEST_F(SentenceTest, KnownStringsAreUsedAgain) {
  Parsed("15 lookingfortag 244");
  const size_t rows = tables_.rows().size();
  Parsed("12 lookingfortag lookingfortag");
  EXPECT_EQ(tables_.rows().size(), rows);
}

TEST_F(SentenceTest, MistakesAreNamed) {
  EXPECT_EQ(ErrorOf("15 lookingfortag"), "found 2 terms, expected subject, predicate and object");
  EXPECT_EQ(ErrorOf(""), "found 0 terms, expected subject, predicate and object");
  EXPECT_EQ(ErrorOf("15 is \"open"), "a quotation mark or angle bracket is not closed");
  EXPECT_EQ(ErrorOf("0 is 1"), "the subject is 0, expected a robot's number from 1 on");
  EXPECT_EQ(ErrorOf("1.5 is 1"),
            "the subject is 1.5, expected a robot's number, robot:ID, tag:NUMBER, a word or <IRI>");
  EXPECT_EQ(ErrorOf("15 7 1"), "the predicate is 7, expected a word or <IRI>");
  EXPECT_EQ(ErrorOf("15 \"is\" 1"), "the predicate is \"is\", expected a word or <IRI>");
  EXPECT_EQ(ErrorOf("15 is robot:none"),
            "the object is robot:none, expected robot: and the number or unique ID of a known "
            "robot");
  EXPECT_EQ(ErrorOf("15 is tag:0"), "the object is tag:0, expected tag: and the number of a tag");
  EXPECT_EQ(ErrorOf("15 is 2147483648"),
            "the object is 2147483648, expected a number, \"text\", 'c', a time, robot:ID, "
            "tag:NUMBER, a word or <IRI>");
  EXPECT_EQ(ErrorOf("15 is 2001-02-29").substr(0, 25), "the object is 2001-02-29,");
  EXPECT_EQ(ErrorOf("15 is 24:00:00").substr(0, 23), "the object is 24:00:00,");
  EXPECT_EQ(ErrorOf("15 is 2106-02-07T06:28:16Z").substr(0, 14), "the object is ");
  EXPECT_EQ(ErrorOf("15 is <door>"), "the object is <door>, expected an absolute IRI");
  EXPECT_EQ(ErrorOf("15 is 'ab'"),
            "the object is 'ab', expected one character between apostrophes");
  EXPECT_EQ(ErrorOf("15 is \"" + std::string(256, 'x') + '"'),
            "the object has a text of 256 bytes, expected 1 to 255 of UTF-8 without control "
            "characters");
}

}  // namespace
}  // namespace pheromone::tags
