#include "server/operators/web/http.h"

#include <gtest/gtest.h>

#include <limits>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/control/json_text.h"

namespace pheromone::web {
namespace {

using Query = std::vector<std::pair<std::string, std::string>>;

TEST(TargetTest, PathAndQueryAreDecoded) {
  const auto target = ParseTarget("/a%2Fb+c?x=1&name=a+b%26c&empty=&flag");
  ASSERT_TRUE(target.has_value());
  EXPECT_EQ(target->path, "/a/b+c");
  EXPECT_EQ(target->query, (Query{{"x", "1"}, {"name", "a b&c"}, {"empty", ""}, {"flag", ""}}));
  EXPECT_EQ(ParseTarget("/")->path, "/");
  EXPECT_TRUE(ParseTarget("/x?")->query.empty());
  EXPECT_EQ(ParseTarget("/x?a=1&&b=2&")->query, (Query{{"a", "1"}, {"b", "2"}}));
}

TEST(TargetTest, WhatIsNoPathOrBadlyEscapedIsNone) {
  for (const char* bad : {"", "*", "http://host/x", "/%", "/%4", "/%4g", "/a?x=%zz", "/a?%1=2"}) {
    EXPECT_FALSE(ParseTarget(bad).has_value()) << bad;
  }
}

TEST(RefuseTest, SaysWhatWhereAndExpectedAsJson) {
  const Response refused = Refuse(400, {"found \"a\nb\"", "x_m", "a number"});
  EXPECT_EQ(refused.status, 400);
  EXPECT_EQ(refused.content_type, "application/json");
  EXPECT_EQ(refused.body,
            "{\"error\":{\"what\":\"found \\\"a\\nb\\\"\",\"where\":\"x_m\",\"expected\":\"a "
            "number\"}}\n");
}

// RFC 3629 and its examples of what is not UTF-8.
TEST(JsonTextTest, OnlyWellFormedTextStaysAsItIs) {
  const std::string unknown = "\xEF\xBF\xBD";
  for (const char* good :
       {"", "plain", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xED\x9F\xBF", "\xEE\x80\x80",
        "\xEF\xBF\xBF", "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_EQ(WellFormed(good), good);
  }
  for (const std::string_view bad :
       {"\x80", "\xBF", "\xC0\xAF", "\xC1\xBF", "\xC2", "\xE0\x9F\xBF", "\xE2\x82", "\xED\xA0\x80",
        "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFE", "\xFF"}) {
    std::string expected;
    for (size_t i = 0; i < bad.size(); ++i) {
      expected += unknown;
    }
    EXPECT_EQ(WellFormed(bad), expected);
    EXPECT_EQ(WellFormed("a" + std::string(bad) + "b"), "a" + expected + "b");
  }
  EXPECT_EQ(ToText({{"k\xFF", "v\xFF"}}), "{\"k" + unknown + "\":\"v" + unknown + "\"}\n");
}

TEST(JsonTextTest, NumbersAreShortAndReadBackTheSame) {
  EXPECT_EQ(ToText({{"a", 0.1}, {"b", {1, -2.5, 1e300}}, {"c", nullptr}, {"d\"", true}}),
            "{\"a\":0.1,\"b\":[1,-2.5,1e+300],\"c\":null,\"d\\\"\":true}\n");
  EXPECT_EQ(ToText(std::numeric_limits<uint64_t>::max()), "18446744073709551615\n");
  EXPECT_EQ(ToText(std::numeric_limits<double>::infinity()), "null\n");
  for (const double number : {1.0 / 3, 6.02214076e23, 5e-324, -0.0}) {
    EXPECT_EQ(boost::json::parse(ToText(number)).to_number<double>(), number);
  }
}

}  // namespace
}  // namespace pheromone::web
