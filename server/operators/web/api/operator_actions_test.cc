#include "server/operators/web/api/operator_actions.h"

#include <gtest/gtest.h>

#include <string>

#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

namespace pheromone::web {
namespace {

namespace json = boost::json;

std::string Text(OperatorActions* actions, const std::string& path, const std::string& body,
                 uint64_t now_ms, const std::string& answer = "{}",
                 const std::string& from = "web") {
  const auto notice = actions->Note(path, json::parse(body).as_object(),
                                    json::parse(answer).as_object(), from, now_ms);
  if (!notice) {
    return "";
  }
  EXPECT_EQ(notice->topic, control::Notice::Topic::kOperator);
  EXPECT_EQ(notice->subject, from);
  return notice->text;
}

TEST(OperatorActions, SayWhatWasDoneAndWhere) {
  struct Case {
    std::string path, body, answer, text;
  };
  for (const Case& it : std::initializer_list<Case>{
           {"paint", R"({"pheromone":"trail","points_m":[[3.5,6],[4,6]],"radius_m":0.1})", "{}",
            "painted \"trail\" at (3.5, 6)"},
           {"paint", R"({"pheromone":"trail","area_m":[1,2,3,4]})", "{}",
            "painted \"trail\" at (1, 2)"},
           {"erase", R"({"pheromone":"path","all":true})", "{}", "erased \"path\" everywhere"},
           {"deposit", R"({"pheromone":"trail","x_m":-1.5,"y_m":2})", "{}",
            "deposited \"trail\" at (-1.5, 2)"},
           {"command", R"({"link":"radio-a","id":7,"command":"halt","arguments":[]})", "{}",
            "robot radio-a 7: halt"},
           {"command", R"({"link":"radio-a","id":7,"command":"follow","arguments":[2]})", "{}",
            "robot radio-a 7: follow [2]"},
           {"goto", R"({"link":"radio-a","id":7,"x_m":3,"y_m":5})", "{}",
            "robot radio-a 7: sent to a goal at (3, 5)"},
           {"goto", R"({"link":"radio-a","id":7,"cancel":true})", "{}",
            "robot radio-a 7: goal cancelled"},
           {"goto", R"({"link":"radio-a","id":7,"x_m":3,"y_m":5,"cancel":false})", "{}",
            "robot radio-a 7: sent to a goal at (3, 5)"},
           {"halt", "{}", R"({"done":true,"links":["a","b"],"down":[{"name":"c"}]})",
            "halted all robots, on 2 of 3 links"},
           {"halt", "{}",
            R"({"links":["a"],"down":[{"role":"serves"},{"role":"standby"},{"role":"elsewhere"}]})",
            "halted all robots, on 1 of 2 links; other nodes send on 2"},
           {"laws", R"({"pheromone":"trail","tau_s":30})", "{}", "changed \"trail\": tau 30 s"},
           {"snapshot", "{}", R"({"snapshot":"17.snapshot"})", "snapshot 17.snapshot"},
           {"ticket", "{}", R"({"ticket":"secret","valid_s":1})", "made a ticket for a viewer"},
           {"tags", R"({"action":"erase","tag":"door","slot":1})", "{}", "tags: erase \"door\""},
           {"revoke", R"({"ids":[8,9]})", "{}", "revoked the keys of robots [8,9]"},
           {"nets", R"({"action":"reset","net":"bench"})", "{}", "nets: reset \"bench\""},
           {"undo", "{}", R"({"what":"paint \"trail\"","changed":3})", "undid: paint \"trail\""},
           {"redo", "{}", R"({"what":"paint \"trail\"","changed":3})", "redid: paint \"trail\""},
           {"something-new", "{}", "{}", "something-new"},
           {"unlock", "{}", "{}", ""},      // changes nothing
           {"capture", "{}", "{}", ""}}) {  // has a notice of its own
    OperatorActions actions;
    EXPECT_EQ(Text(&actions, "/api/v1/" + it.path, it.body, 0, it.answer), it.text) << it.body;
  }
}

TEST(OperatorActions, TellOneStrokeOnce) {
  OperatorActions actions;
  const std::string stroke = R"({"pheromone":"trail","points_m":[[1,1],[2,2]]})";
  const std::string on = R"({"pheromone":"trail","points_m":[[2,2],[3,3]],"continues":41})";
  const std::string other = R"({"pheromone":"path","points_m":[[2,2],[3,3]],"continues":41})";
  const std::string area = R"({"pheromone":"trail","area_m":[1,1,2,2]})";
  const auto paint = [&](const std::string& body, uint64_t now_ms) {
    return Text(&actions, "/api/v1/paint", body, now_ms);
  };
  EXPECT_EQ(paint(stroke, 0), "painted \"trail\" at (1, 1)");
  EXPECT_EQ(paint(on, 1999), "");
  EXPECT_EQ(paint(on, 3998), "");  // since the last part, not since the first
  EXPECT_EQ(paint(on, 5998), "painted \"trail\" at (2, 2)");
  EXPECT_EQ(paint(other, 5999), "painted \"path\" at (2, 2)");
  EXPECT_EQ(paint(on, 6000), "painted \"trail\" at (2, 2)");
  EXPECT_EQ(paint(area, 6001), "painted \"trail\" at (1, 1)");  // not by a brush: each is told
  EXPECT_EQ(paint(area, 6002), "painted \"trail\" at (1, 1)");
  EXPECT_EQ(Text(&actions, "/api/v1/erase", on, 6003), "erased \"trail\" at (2, 2)");
}

// Two operators, or one who paints at several places, do as many things as there are requests.
TEST(OperatorActions, TellWhatContinuesNoStrokeOfTheSameOperator) {
  OperatorActions actions;
  const std::string alone = R"({"pheromone":"trail","points_m":[[1,1],[2,2]]})";
  const std::string none = R"({"pheromone":"trail","points_m":[[1,1],[2,2]],"continues":0})";
  const std::string on = R"({"pheromone":"trail","points_m":[[2,2],[3,3]],"continues":41})";
  const auto erase = [&](const std::string& body, uint64_t now_ms, const std::string& from) {
    return Text(&actions, "/api/v1/erase", body, now_ms, "{}", from);
  };
  EXPECT_EQ(erase(alone, 0, "pheromonectl"), "erased \"trail\" at (1, 1)");
  EXPECT_EQ(erase(alone, 700, "pheromonectl"), "erased \"trail\" at (1, 1)");
  EXPECT_EQ(erase(none, 800, "pheromonectl"), "erased \"trail\" at (1, 1)");
  EXPECT_EQ(erase(on, 900, "web"), "erased \"trail\" at (2, 2)");
  EXPECT_EQ(erase(on, 1000, "web"), "");
  EXPECT_EQ(erase(on, 1100, "pheromonectl"), "erased \"trail\" at (2, 2)");
  // A brush on empty ground has no edit to continue.
  EXPECT_EQ(
      Text(&actions, "/api/v1/erase", alone, 1200, R"({"edit":null,"changed":0})", "pheromonectl"),
      "");
}

TEST(OperatorActions, TellAFirstRefusalOfEachClientAndCountTheOthersForAWhile) {
  OperatorActions actions;
  const auto refuse = [&](const std::string& from, uint64_t now_ms, int status = 401) {
    const auto notice = actions.NoteRefusal("/api/v1/halt", status, "found no token", from, now_ms);
    EXPECT_TRUE(!notice || !notice->is_on);
    return notice ? notice->subject + ": " + notice->text : "";
  };
  EXPECT_EQ(refuse("a", 5), "a: halt: refused, found no token");
  EXPECT_EQ(refuse("a", 6), "");
  EXPECT_EQ(refuse("b", 7), "b: halt: refused, found no token");
  EXPECT_EQ(refuse("a", 10'004), "");
  EXPECT_EQ(refuse("a", 10'005), "a: halt: refused, found no token; 2 more before");
  EXPECT_EQ(refuse("a", 20'005), "a: halt: refused, found no token");
  EXPECT_EQ(refuse("b", 20'006, 409), "b: halt: refused, found no token");
  EXPECT_EQ(refuse("b", 40'006, 503), "b: halt: failed, found no token");
  const auto long_one =
      actions.NoteRefusal("/api/v1/goto", 400, std::string(5000, 'a'), "c", 40'007);
  EXPECT_EQ(long_one->text, "goto: refused, " + std::string(OperatorActions::kMaxReason, 'a'));
}

// However many addresses there are, and all at once.
TEST(OperatorActions, TellOfABoundedNumberOfClients) {
  OperatorActions actions;
  int told = 0;
  for (int i = 0; i < 100'000; ++i) {
    told += actions.NoteRefusal("/api/v1/halt", 401, "no", std::to_string(i), 1) ? 1 : 0;
  }
  EXPECT_EQ(told, OperatorActions::kMaxRefusals);
  EXPECT_LE(actions.clients(), OperatorActions::kMaxClients);
}

}  // namespace
}  // namespace pheromone::web
