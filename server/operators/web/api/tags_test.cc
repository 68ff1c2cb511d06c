#include "server/operators/web/api/tags.h"

#include <gtest/gtest.h>

#include <string>

#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

class TagsApiTest : public ::testing::Test {
 protected:
  TagsApiTest() {
    control::TagView door{.content = {3, "door", tags::Tag(2), 0},
                          .place = tags::Place{3, 1'500'000, -250'000, 1'000'000},
                          .privileged = {1},
                          .lease_s = {0, 12.5}};
    door.content.tag.Restore(1, {{15, 1'138'458'000, {1, 2}, {3, 4}, {-3, 244}}, 7, 99'000});
    control_.tags = {door, {.content = {4, "007", tags::Tag(1), 0}, .lease_s = {0}}};
    control_.rows = {{tags::RowKind::kRobot, 15, 15, "123-233-201"},
                     {tags::RowKind::kString, 15, 2, "p\u00f5rand"}};
  }

  std::string Get(const std::string& target) {
    return testing::AnswerOf(&api_, {.method = "GET", .target = "/api/v1/" + target}).body;
  }
  std::string Post(const std::string& body) {
    return testing::AnswerOf(
               &api_, {.method = "POST", .target = "/api/v1/tags", .local = true, .body = body})
        .body;
  }

  testing::FakeControl control_;
  Api api_{&control_, {"0123456789abcdef", {"lab"}}};
};

TEST_F(TagsApiTest, TagsAreListed) {
  EXPECT_EQ(
      Get("tags"),
      R"({"tags":[{"name":"door","number":3,"configured":true,"x_m":1.5,"y_m":-0.25,"range_m":1,)"
      R"("slots":2,"used":1,"generation":0},{"name":"007","number":4,"configured":false,)"
      R"("x_m":null,"y_m":null,"range_m":null,"slots":1,"used":0,"generation":0}],"next":null})"
      "\n");
}

TEST_F(TagsApiTest, ContentsAreWords) {
  const std::string body = Get("tags?first=3&contents=1");
  EXPECT_NE(body.find(R"("blocks":[{"slot":1,"generation":7,"lease_s":12.5,"privileged":true,)"
                      R"("author":15,"time_s":1138458000,"subject":[1,2],"predicate":[3,4],)"
                      R"("object":[-3,244]}])"),
            std::string::npos)
      << body;
}

TEST_F(TagsApiTest, SymbolsAreRows) {
  EXPECT_EQ(Get("symbols?first=1"),
            "{\"rows\":[{\"kind\":\"string\",\"robot\":15,\"number\":2,\"text\":\"p\u00f5rand\","
            "\"link\":\"radio\",\"id\":7}],\"total\":2,\"next\":null}\n");
}

TEST_F(TagsApiTest, ABlockIsWritten) {
  EXPECT_EQ(Post(R"({"action":"write","tag":"007","author":15,"block":[-17,15,3,4,-3,-244],)"
                 R"("time_s":5,"slot":0,"expected":65535,"replace":true,"lease_s":60.5})"),
            "{\"done\":true}\n");
  ASSERT_EQ(control_.tag_changes.size(), 1u);
  const auto& change = std::get<engine::TagsChanged::Write>(control_.tag_changes[0].change);
  EXPECT_EQ(change.tag, 4);
  EXPECT_EQ(change.block, (tags::Block{15, 5, {-17, 15}, {3, 4}, {-3, -244}}));
  EXPECT_EQ(change.slot, 0);
  EXPECT_EQ(change.expected, 65'535);
  EXPECT_TRUE(change.is_state);
  EXPECT_EQ(change.lease_ms, 60'500u);
}

TEST_F(TagsApiTest, ABlockIsErasedAndASymbolDefined) {
  Post(R"({"action":"erase","tag":"door","slot":1})");
  Post(R"({"action":"define","kind":"string","robot":15,"number":7,"text":"x"})");
  ASSERT_EQ(control_.tag_changes.size(), 2u);
  const auto& erased = std::get<engine::TagsChanged::Erase>(control_.tag_changes[0].change);
  EXPECT_EQ(erased.slot, 1);
  EXPECT_FALSE(erased.expected);
  const auto& defined = std::get<engine::TagsChanged::Define>(control_.tag_changes[1].change);
  EXPECT_EQ(defined.row, (tags::Row{tags::RowKind::kString, 15, 7, "x"}));
}

TEST_F(TagsApiTest, WhatARobotOrOperatorsHaveDefinedIsForgotten) {
  Post(R"({"action":"forget","link":"radio-a","id":7})");
  Post(R"({"action":"forget"})");
  ASSERT_EQ(control_.tag_changes.size(), 2u);
  const auto maker = [&](size_t i) {
    return std::get<engine::TagsChanged::Forget>(control_.tag_changes[i].change).maker;
  };
  EXPECT_EQ(maker(0), (tags::Maker{"radio-a", 7}));
  EXPECT_EQ(maker(1), tags::Maker{});
}

TEST_F(TagsApiTest, MistakesAreNamed) {
  const auto has = [&](const std::string& body, const std::string& words) {
    const std::string answer = Post(body);
    EXPECT_NE(answer.find(words), std::string::npos) << answer;
  };
  has(R"({"action":"burn"})", "one of write, erase, define, forget");
  has(R"({"action":"forget","link":"radio-a"})", "a link and the ID of a robot, or neither");
  has(R"({"action":"forget","id":7})", "a link and the ID of a robot, or neither");
  has(R"({"action":"forget","link":"radio-a","id":256})", "id");
  has(R"({})", "action");
  has(R"({"action":"write","tag":"none","author":15,"block":[1,2,3,4,5,6]})", "the name of a tag");
  has(R"({"action":"write","tag":"door","author":15,"block":[1,2,3,4,5]})", "six numbers");
  has(R"({"action":"write","tag":"door","author":15,"block":[1,2,3,4,5,2147483648]})",
      "six numbers");
  has(R"({"action":"write","tag":"door","author":0,"block":[1,2,3,4,5,6]})", "author");
  has(R"({"action":"write","tag":"door","author":1,"block":[1,2,3,4,5,6],"lease_s":3601})",
      "lease_s");
  has(R"({"action":"define","kind":"noun","robot":1,"number":1,"text":"x"})",
      "one of robot, string, mapping");
  has(R"({"action":"erase","tag":"door"})", "slot");
  EXPECT_TRUE(control_.tag_changes.empty());
  control_.outcome = Error{"tag \"door\": it is full"};
  has(R"({"action":"write","tag":"door","author":15,"block":[1,2,3,4,5,6]})", "it is full");
}

}  // namespace
}  // namespace pheromone::web
