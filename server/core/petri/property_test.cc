#include "server/core/petri/property.h"

#include <gtest/gtest.h>

#include <array>

namespace pheromone::petri {
namespace {

Net Crossing() {
  return {.name = "crossing",
          .places = {{.id = "a"}, {.id = "b-1"}, {.id = "c.x"}, {.id = "odd name"}},
          .transitions = {{.id = "go"}, {.id = "stop"}}};
}

Property Parsed(const std::string& text) {
  const Result<Property> parsed = ParseProperty(Crossing(), {"it", text});
  EXPECT_TRUE(parsed.ok()) << parsed.error();
  return parsed.ok() ? parsed.value() : Property{};
}

bool HoldsFor(const std::string& expression, const std::array<int64_t, 4>& tokens) {
  return Holds(Parsed("always " + expression).expression,
               [&](uint32_t place) { return tokens.at(place); });
}

TEST(Property, ComparesSums) {
  for (int64_t a = 0; a < 4; ++a) {
    for (int64_t b = 0; b < 4; ++b) {
      const std::array<int64_t, 4> tokens = {a, b, 2, 1};
      EXPECT_EQ(HoldsFor("a + b-1 <= 3", tokens), a + b <= 3);
      EXPECT_EQ(HoldsFor("2 * a < b-1 + 1", tokens), 2 * a < b + 1);
      EXPECT_EQ(HoldsFor("a - b-1 = 0", tokens), a == b);
      EXPECT_EQ(HoldsFor("1 + a != b-1", tokens), 1 + a != b);
      EXPECT_EQ(HoldsFor("- a >= - c.x", tokens), -a >= -2);
      EXPECT_EQ(HoldsFor("a + a > \"odd name\" + 3 * b-1", tokens), a + a > 1 + 3 * b);
    }
  }
}

TEST(Property, AndBindsCloserThanOr) {
  EXPECT_TRUE(HoldsFor("a = 0 or a = 1 and b-1 = 1", {0, 0, 0, 0}));
  EXPECT_FALSE(HoldsFor("(a = 0 or a = 1) and b-1 = 1", {0, 0, 0, 0}));
  EXPECT_FALSE(HoldsFor("not a = 0 or b-1 = 1", {0, 0, 0, 0}));
  EXPECT_TRUE(HoldsFor("not (a = 0 and b-1 = 1)", {0, 0, 0, 0}));
}

// What is bounded is how deep they are nested, not how many there are.
TEST(Property, MayCompareTwoHundredAndFiftyTimes) {
  for (const std::string word : {" or ", " and "}) {
    std::string text = "a = 1";
    for (int i = 1; i < 250; ++i) {
      text += word + "(not a = " + std::to_string(i + 1) + ")";
    }
    EXPECT_TRUE(HoldsFor(text, {1, 0, 0, 0})) << word;
    EXPECT_EQ(HoldsFor(text, {2, 0, 0, 0}), word == " or ");
  }
  EXPECT_TRUE(HoldsFor(std::string(100, '(') + "a = 1" + std::string(100, ')'), {1, 0, 0, 0}));
}

TEST(Property, NamesItsKindAndTransitions) {
  EXPECT_EQ(Parsed("never a > 1").kind, Property::Kind::kNever);
  EXPECT_EQ(Parsed("reachable a > 1").kind, Property::Kind::kReachable);
  EXPECT_EQ(Parsed("live stop go").transitions, (std::vector<uint32_t>{1, 0}));
  EXPECT_EQ(Parsed("deadlock-free").kind, Property::Kind::kDeadlockFree);
  EXPECT_EQ(Parsed("reversible").kind, Property::Kind::kReversible);
  const Property overtaken = Parsed("overtaken at most 3 by go while a = 1 or c.x = 0");
  EXPECT_EQ(overtaken.kind, Property::Kind::kOvertaken);
  EXPECT_EQ(overtaken.at_most, 3u);
  EXPECT_EQ(overtaken.transitions, (std::vector<uint32_t>{0}));
  EXPECT_EQ(PlacesOf(overtaken.expression), (std::vector<uint32_t>{0, 2}));
}

TEST(Property, SaysWhereTextIsWrong) {
  const auto error = [](const std::string& text) {
    const Result<Property> parsed = ParseProperty(Crossing(), {"it", text});
    return parsed.ErrorOr("");
  };
  EXPECT_EQ(error("sometimes a = 1"),
            "claim \"it\", column 1: found \"sometimes\", expected always, never, reachable, live, "
            "deadlock-free, reversible or overtaken");
  EXPECT_EQ(error("always d = 1"),
            "claim \"it\", column 8: found \"d\", expected the ID of a place");
  EXPECT_EQ(error("always a + 1"),
            "claim \"it\", column 13: found the end, expected <=, <, =, !=, >= or >");
  EXPECT_EQ(error("always (a = 1"), "claim \"it\", column 14: found the end, expected \")\"");
  EXPECT_EQ(error("always a = 1 b"),
            "claim \"it\", column 14: found \"b\", expected and, or, or the end");
  EXPECT_EQ(error("live go left"),
            "claim \"it\", column 9: found \"left\", expected the ID of a transition");
  EXPECT_EQ(error("overtaken at most go by go while a = 1"),
            "claim \"it\", column 19: found \"go\", expected a number from 0 to 1000000000");
  EXPECT_EQ(error("always a = 99999999999999999999"),
            "claim \"it\", column 12: found \"99999999999999999999\", expected a number from 0 to "
            "1000000000");
  EXPECT_EQ(error("always \"a = 1"),
            "claim \"it\", column 8: found a quotation mark without its end, expected the ID of a "
            "place");
  EXPECT_NE(error("always " + std::string(100'000, '(')).find("at most 200 parentheses"),
            std::string::npos);
}

}  // namespace
}  // namespace pheromone::petri
