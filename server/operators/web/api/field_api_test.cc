// What the API shows of the field, and what it changes there and on robots.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/formats/maps/csv_grid.h"
#include "server/formats/maps/png_picture.h"
#include "server/operators/web/api/api.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using field::FieldEdit;

class FieldApiTest : public ::testing::Test {
 protected:
  Response Get(const std::string& target) {
    return testing::AnswerOf(&api_, {.method = "GET", .target = "/api/v1/" + target});
  }
  Response Answer(const std::string& path, const std::string& body) {
    return testing::AnswerOf(
        &api_, {.method = "POST", .target = "/api/v1/" + path, .local = true, .body = body});
  }
  int Post(const std::string& path, const std::string& body) { return Answer(path, body).status; }
  json::value PostForJson(const std::string& path, const std::string& body) {
    return json::parse(Answer(path, body).body);
  }

  testing::FakeControl control_;
  Api api_{&control_, {}};
};

TEST_F(FieldApiTest, ARasterHasTheTopRowFirstAndNullWhereThereAreObstacles) {
  control_.field.Deposit(1, {500'000, 0}, 3, 0);            // node (1, 0): 3 quanta of 0.25
  control_.field.Deposit(1, {4'000'000, 3'000'000}, 8, 0);  // node (8, 6)
  const json::value raster = json::parse(Get("field?pheromone=trail").body);
  EXPECT_EQ(raster.at("columns").to_number<int>(), 9);
  EXPECT_EQ(raster.at("rows").to_number<int>(), 7);
  EXPECT_EQ(raster.at("cell_m").to_number<double>(), 0.5);
  EXPECT_EQ(raster.at("maximum").to_number<double>(), 2);
  const json::array& rows = raster.at("values").as_array();
  ASSERT_EQ(rows.size(), 7u);
  EXPECT_EQ(rows[0].as_array()[8].to_number<double>(), 2);
  EXPECT_TRUE(rows[6].as_array()[0].is_null());
  EXPECT_EQ(rows[6].as_array()[1].to_number<double>(), 0.75);
  EXPECT_EQ(rows[6].as_array()[2].to_number<double>(), 0);
}

TEST_F(FieldApiTest, TheSameAsCsvAndAsAPicture) {
  control_.field.Deposit(2, {2'000'000, 1'000'000}, 8, 0);  // node (4, 2)
  const Response csv = Get("field?pheromone=2&format=csv");
  EXPECT_EQ(csv.content_type, "text/csv");
  const auto grid = maps::ParseCsvGrid(csv.body, "answer");
  ASSERT_TRUE(grid.ok()) << grid.error();
  EXPECT_EQ(grid.value().At(4, 2), 2);
  EXPECT_TRUE(std::isnan(grid.value().At(0, 0)));
  const Response png = Get("field?pheromone=path&format=png&pixels_per_cell=3");
  EXPECT_EQ(png.content_type, "image/png");
  const auto picture = maps::ParsePng(png.body, "answer");
  ASSERT_TRUE(picture.ok()) << picture.error();
  EXPECT_EQ(picture.value().raster.columns, 27);
  EXPECT_EQ(picture.value().raster.rows, 21);
}

TEST_F(FieldApiTest, AnAreaAndFewerCells) {
  control_.field.Deposit(2, {2'000'000, 1'000'000}, 2, 0);
  const json::value raster =
      json::parse(Get("field?pheromone=2&area_m=1.0,0.5,3.0,2.0&nodes_per_cell=2").body);
  // Nodes 2-6 across and 1-4 up make 3 x 2 cells; node (4, 2) lies in the second of the lower ones.
  EXPECT_EQ(raster.at("columns").to_number<int>(), 3);
  EXPECT_EQ(raster.at("rows").to_number<int>(), 2);
  EXPECT_EQ(raster.at("values").as_array()[1].as_array()[1].to_number<double>(), 0.5);
  EXPECT_EQ(Get("field?pheromone=2&pixels_per_cell=0").status, 400);
  EXPECT_EQ(Get("field?pheromone=guide").status, 400);
}

// 2001 x 2001 nodes, 0.5 m apart.
field::FieldConfig LargeField() {
  field::FieldConfig config = testing::SmallField();
  config.map.width_um = 1'000'000'000;
  config.map.height_um = 1'000'000'000;
  config.obstacles = {};
  return config;
}

// As many nodes a cell as make a thousand cells of the longer side.
TEST(LargeFieldApi, LongAreasHaveSeveralNodesACell) {
  testing::FakeControl control(LargeField());
  Api api(&control, {});
  const auto size = [&api](const std::string& area) {
    const json::value raster =
        json::parse(testing::AnswerOf(&api, {.method = "GET",
                                             .target = "/api/v1/field?pheromone=2&area_m=" + area})
                        .body);
    return std::pair(raster.at("columns").to_number<int>(), raster.at("rows").to_number<int>());
  };
  EXPECT_EQ(size("0,0,0.5,499.5"), std::pair(2, 1000));
  EXPECT_EQ(size("0,0,0.5,500"), std::pair(1, 501));  // 1001 nodes
  EXPECT_EQ(size("0,0,0.5,999.5"), std::pair(1, 1000));
  EXPECT_EQ(size("0,0,0.5,1000"), std::pair(1, 667));  // 2001 nodes
  EXPECT_EQ(size("0,3,499.5,3.5"), std::pair(1000, 2));
  EXPECT_EQ(size("0,3,500,3.5"), std::pair(501, 1));
  EXPECT_EQ(size("0,3,1000,3.5"), std::pair(667, 1));
}

// However large it is, it is in memory once.
TEST(LargeFieldApi, WhoWaitsForTheSamePictureSharesIt) {
  testing::FakeControl control(LargeField());
  std::vector<Work> held;
  Lanes lanes;
  lanes.pictures = [&held](Work work) {
    held.push_back(std::move(work));
    return true;
  };
  Api api(&control, {}, lanes);
  std::vector<Response> responses;
  for (int i = 0; i < 3; ++i) {
    api.Handle({.method = "GET", .target = "/api/v1/field?pheromone=2", .local = true},
               [&](const Response& response) { responses.push_back(response); });
  }
  ASSERT_EQ(held.size(), 1u);
  held[0]();
  ASSERT_EQ(responses.size(), 3u);
  ASSERT_NE(responses[0].content, nullptr) << responses[0].body;
  EXPECT_EQ(responses[1].content, responses[0].content);
  EXPECT_EQ(responses[2].content, responses[0].content);
}

TEST(LargeFieldApi, AnAreaOfAsManyPixelsAsThereMayBeAndNotOneRowMore) {
  testing::FakeControl control(LargeField());
  Api api(&control, {});
  const auto picture = [&api](const std::string& area) {
    return testing::AnswerOf(
        &api,
        {.method = "GET",
         .target = "/api/v1/field?pheromone=2&format=png&pixels_per_cell=100&area_m=" + area});
  };
  EXPECT_EQ(picture("3,4,12.5,13.5").status, 200);  // 20 x 20 nodes: 4 000 000 pixels
  const Response high = picture("3,4,12.5,14");
  EXPECT_EQ(high.status, 400);
  EXPECT_NE(high.body.find("2000 x 2100"), std::string::npos) << high.body;
  const Response wide = picture("3,4,13,13.5");
  EXPECT_EQ(wide.status, 400);
  EXPECT_NE(wide.body.find("2100 x 2000"), std::string::npos) << wide.body;
}

TEST_F(FieldApiTest, APictureThatWouldBeTooLargeIsRefused) {
  EXPECT_EQ(Get("field?pheromone=2&format=png&pixels_per_cell=100").status, 200);  // 900 x 700
  EXPECT_EQ(Get("field?pheromone=2&format=png&pixels_per_cell=101").status, 400);
}

TEST_F(FieldApiTest, SenseIsWhatARobotWouldSmellThere) {
  control_.field.Deposit(1, {2'000'000, 2'000'000}, 4, 0);
  control_.field.Deposit(2, {2'500'000, 1'000'000}, 2, 0);
  for (const auto& [name, type] : {std::pair("trail", 1), std::pair("3", 3)}) {
    const auto smelled =
        control_.field.Sense(static_cast<uint8_t>(type), {{2'000'000, 1'500'000}, 8192}, 1000);
    const json::value answer = json::parse(
        Get("sense?pheromone=" + std::string(name) + "&x_m=2&y_m=1.5&heading_deg=45").body);
    EXPECT_EQ(answer.at("left").at("intensity").to_number<double>() * 4096,
              static_cast<double>(smelled->left));
    EXPECT_EQ(answer.at("right").at("intensity").to_number<double>() * 4096,
              static_cast<double>(smelled->right));
    EXPECT_NE(smelled->left, smelled->right);
    // Half a metre to the left of a robot that faces 45 degrees: up and to the left.
    EXPECT_NEAR(answer.at("left").at("x_m").to_number<double>(), 2 - 0.5 * std::sqrt(0.5), 1e-4);
    EXPECT_NEAR(answer.at("left").at("y_m").to_number<double>(), 1.5 + 0.5 * std::sqrt(0.5), 1e-4);
  }
  EXPECT_EQ(Get("sense?pheromone=1&x_m=-1&y_m=0").status, 409);
}

TEST_F(FieldApiTest, ADepositGoesToTheNearestNodeAsADepositOfARobotDoes) {
  EXPECT_EQ(Post("deposit", R"({"pheromone":"path","x_m":1.2,"y_m":0.7,"quanta":3})"), 200);
  ASSERT_EQ(control_.edits.size(), 1u);
  field::Field edited(testing::SmallField());
  field::Field deposited(testing::SmallField());
  ASSERT_TRUE(edited.Edit(control_.edits[0], 5).ok());
  ASSERT_EQ(deposited.Deposit(2, {1'200'000, 700'000}, 3, 5), field::DepositResult::kDone);
  EXPECT_EQ(edited.hash(), deposited.hash());
  EXPECT_EQ(Post("deposit", R"({"pheromone":1,"x_m":9,"y_m":0})"), 409);    // off the map
  EXPECT_EQ(Post("deposit", R"({"pheromone":1,"x_m":0.1,"y_m":0})"), 409);  // in the wall
  EXPECT_EQ(control_.edits.size(), 1u);
}

TEST_F(FieldApiTest, AnEditSaysWhatItChangedAndMayContinueTheLastOne) {
  const json::value made = PostForJson("paint", R"({"pheromone":2,"area_m":[0.5,0.5,1,1]})");
  EXPECT_EQ(made.at("edit").to_number<int>(), 41);  // by the fake
  EXPECT_EQ(made.at("changed").to_number<int>(), made.at("nodes").to_number<int>() - 1);
  EXPECT_EQ(Post("erase", R"({"pheromone":2,"area_m":[1,1,2,2],"continues":41})"), 200);
  EXPECT_EQ(control_.edits[0].continues, 0u);
  EXPECT_EQ(control_.edits[1].continues, 41u);
  EXPECT_EQ(Post("erase", R"({"pheromone":2,"area_m":[1,1,2,2],"continues":-1})"), 400);
}

TEST_F(FieldApiTest, UndoAndRedoSayWhatItWas) {
  const json::value undone = PostForJson("undo", "{}");
  EXPECT_TRUE(undone.at("done").as_bool());
  EXPECT_EQ(undone.at("edit").to_number<int>(), 41);
  EXPECT_EQ(undone.at("what").as_string(), "stroke of \"path\"");
  EXPECT_EQ(undone.at("time_s").to_number<double>(), 1'700'000'000.5);
  EXPECT_EQ(undone.at("changed").to_number<int>(), 84);
  EXPECT_EQ(PostForJson("redo", "{}").at("changed").to_number<int>(), 85);
  EXPECT_EQ(Post("undo", R"({"edit":41})"), 400);
  control_.outcome = Error{"nothing to undo"};
  EXPECT_EQ(Post("undo", "{}"), 409);
}

TEST_F(FieldApiTest, PaintAndEraseTakeOneOfThreeShapes) {
  EXPECT_EQ(Post("paint", R"({"pheromone":1,"points_m":[[0,1],[2.5,1]],"radius_m":0.25,
                              "units":0.5,"add":true})"),
            200);
  EXPECT_EQ(Post("paint", R"({"pheromone":2,"area_m":[3,2,1,0]})"), 200);
  EXPECT_EQ(Post("erase", R"({"pheromone":"trail","all":true})"), 200);
  ASSERT_EQ(control_.edits.size(), 3u);
  FieldEdit stroke;
  stroke.type = 1;
  stroke.shape = FieldEdit::Shape::kStroke;
  stroke.action = FieldEdit::Action::kAdd;
  stroke.level = 128;  // two quanta of 0.25, 64 levels each
  stroke.radius_um = 250'000;
  stroke.points = {{0, 1'000'000}, {2'500'000, 1'000'000}};
  EXPECT_EQ(control_.edits[0], stroke);
  FieldEdit rectangle;
  rectangle.type = 2;
  rectangle.level = 8 * 64;  // the maximum
  rectangle.points = {{3'000'000, 2'000'000}, {1'000'000, 0}};
  EXPECT_EQ(control_.edits[1], rectangle);
  FieldEdit all;
  all.shape = FieldEdit::Shape::kAll;
  all.action = FieldEdit::Action::kErase;
  EXPECT_EQ(control_.edits[2], all);
}

// Nodes are half a metre apart, from (0, 0) to (4, 3).
TEST_F(FieldApiTest, AnEditTellsHowManyNodesItTouchedAndWhetherAPartOfItIsOffTheMap) {
  const auto told = [&](const std::string& shape) {
    const Response response =
        testing::AnswerOf(&api_, {.method = "POST",
                                  .target = "/api/v1/paint",
                                  .local = true,
                                  .body = R"({"pheromone":1,)" + shape + "}"});
    EXPECT_EQ(response.status, 200) << response.body;
    const json::value value = json::parse(response.body);
    return std::pair(value.at("nodes").to_number<int>(), value.at("partly_off_the_map").as_bool());
  };
  EXPECT_EQ(told(R"("area_m":[0,0,1,0.5])"), std::pair(6, false));
  EXPECT_EQ(told(R"("area_m":[4,3,9,9])"), std::pair(1, true));
  EXPECT_EQ(told(R"("points_m":[[1,1],[2,1]],"radius_m":0.1)"), std::pair(3, false));
  EXPECT_EQ(told(R"("points_m":[[1,0]],"radius_m":0.5)"), std::pair(4, true));
  EXPECT_EQ(told(R"("points_m":[[0.5,0.5]],"radius_m":0.5)"), std::pair(5, false));
  EXPECT_EQ(told(R"("all":true)"), std::pair(63, false));
}

TEST_F(FieldApiTest, WhatTouchesNoNodeOfTheMapIsNotCalledDone) {
  for (const char* shape : {R"("area_m":[5,0,6,1])", R"("points_m":[[-1,0]],"radius_m":0.5)",
                            R"("points_m":[[0.25,0.25]],"radius_m":0.1)"}) {
    for (const char* change : {"paint", "erase"}) {
      const Response response =
          testing::AnswerOf(&api_, {.method = "POST",
                                    .target = std::string("/api/v1/") + change,
                                    .local = true,
                                    .body = R"({"pheromone":1,)" + std::string(shape) + "}"});
      EXPECT_EQ(response.status, 409) << shape;
      EXPECT_NE(response.body.find("the shape contains no node of the map"), std::string::npos);
    }
  }
  EXPECT_TRUE(control_.edits.empty());
}

TEST_F(FieldApiTest, EvaporationIsChangedInMilliseconds) {
  EXPECT_EQ(Post("laws", R"({"pheromone":"path","tau_s":2.5})"), 200);
  EXPECT_EQ(control_.changed_tau, (std::pair<uint8_t, int64_t>(2, 2'500)));
  EXPECT_EQ(Post("laws", R"({"pheromone":1,"tau_s":0})"), 200);
  EXPECT_EQ(control_.changed_tau, (std::pair<uint8_t, int64_t>(1, 0)));
  for (const char* bad :
       {R"({"pheromone":1})", R"({"pheromone":1,"tau_s":-1})", R"({"pheromone":1,"tau_s":"x"})",
        R"({"pheromone":1,"tau_s":null})", R"({"pheromone":1,"tau_s":1e10})",
        R"({"pheromone":1,"tau_s":0.0001})", R"({"pheromone":"none","tau_s":1})", R"({"tau_s":1})",
        R"({"pheromone":1,"tau_s":1,"maximum":1})"}) {
    EXPECT_EQ(Post("laws", bad), 400) << bad;
  }
  control_.outcome = Error{"pheromone trail diffuses"};
  EXPECT_EQ(Post("laws", R"({"pheromone":1,"tau_s":1})"), 409);
}

TEST_F(FieldApiTest, ShapesThatAreNoneAreRefused) {
  for (const char* shape :
       {"", R"(,"all":false)", R"(,"all":1)", R"(,"points_m":[])", R"(,"points_m":[[1]])",
        R"(,"points_m":[[1,"2"]])", R"(,"points_m":[[1,2e6]])", R"(,"points_m":7)",
        R"(,"area_m":[1,2,3])", R"(,"area_m":[1,2,3,4],"all":true)",
        R"(,"points_m":[[1,1]],"radius_m":-1)"}) {
    const std::string body = R"({"pheromone":1)" + std::string(shape) + "}";
    EXPECT_EQ(Post("erase", body), 400) << body;
    EXPECT_EQ(Post("paint", body), 400) << body;
  }
  EXPECT_EQ(Post("paint", R"({"pheromone":1,"all":true,"units":2.01})"), 400);
  EXPECT_EQ(Post("erase", R"({"pheromone":1,"all":true,"units":1})"), 400);
  EXPECT_TRUE(control_.edits.empty());
}

TEST_F(FieldApiTest, CommandsCarryTheirArgumentsAsOnTheWire) {
  EXPECT_EQ(Post("command", R"({"link":"a","id":7,"command":"speed","arguments":[300]})"), 200);
  EXPECT_EQ(Post("command", R"({"link":"a","id":1,"command":"go-to","arguments":[258,-2]})"), 200);
  EXPECT_EQ(Post("command", R"({"link":"b","id":254,"command":"set","arguments":[5,-2]})"), 200);
  EXPECT_EQ(Post("command", R"({"link":"b","id":2,"command":"halt"})"), 200);
  using Command = testing::FakeControl::Command;
  using protocol::CommandCode;
  EXPECT_EQ(
      control_.commands,
      (std::vector<Command>{{"a", 7, CommandCode::kSpeed, {0x2C, 0x01}},
                            {"a", 1, CommandCode::kGoTo, {0x02, 0x01, 0xFE, 0xFF}},
                            {"b", 254, CommandCode::kSetParameter, {5, 0xFE, 0xFF, 0xFF, 0xFF}},
                            {"b", 2, CommandCode::kHalt, {}}}));
  for (const char* bad :
       {R"("id":0,"command":"halt")", R"("id":255,"command":"halt")", R"("id":1,"command":"jump")",
        R"("id":1,"command":"speed")", R"("id":1,"command":"speed","arguments":[40000])",
        R"("id":1,"command":"speed","arguments":[-300])",
        R"("id":1,"command":"halt","arguments":[1])",
        R"("id":1,"command":"speed","arguments":[1.5])"}) {
    EXPECT_EQ(Post("command", R"({"link":"a",)" + std::string(bad) + "}"), 400) << bad;
  }
  EXPECT_EQ(control_.commands.size(), 4u);
}

TEST_F(FieldApiTest, AGoalIsSetOrCancelled) {
  EXPECT_EQ(Post("goto", R"({"link":"a","id":7,"x_m":1.5,"y_m":-2})"), 200);
  EXPECT_EQ(Post("goto", R"({"link":"b","id":1,"x_m":0,"y_m":0.25,"tolerance_m":0.05})"), 200);
  EXPECT_EQ(Post("goto", R"({"link":"a","id":7,"cancel":true})"), 200);
  using Goal = testing::FakeControl::Goal;
  EXPECT_EQ(control_.goals, (std::vector<Goal>{{"a", 7, {1'500'000, -2'000'000}, 100'000},
                                               {"b", 1, {0, 250'000}, 50'000},
                                               {"a", 7, {}, 0}}));
  for (const char* bad :
       {R"("id":0,"x_m":1,"y_m":1)", R"("id":255,"x_m":1,"y_m":1)", R"("id":1,"x_m":1)",
        R"("id":1,"y_m":1)", R"("id":1,"x_m":2e6,"y_m":1)", R"("id":1,"x_m":"1","y_m":1)",
        R"("id":1,"x_m":1,"y_m":1,"tolerance_m":0.009)",
        R"("id":1,"x_m":1,"y_m":1,"tolerance_m":1001)", R"("id":1,"x_m":1,"y_m":1,"z_m":1)",
        R"("id":1,"cancel":true,"x_m":1)", R"("id":1,"cancel":1)", R"("cancel":true)"}) {
    EXPECT_EQ(Post("goto", R"({"link":"a",)" + std::string(bad) + "}"), 400) << bad;
  }
  EXPECT_EQ(control_.goals.size(), 3u);
}

TEST_F(FieldApiTest, EveryCommandTakesAsManyBytesAsTheProtocolSays) {
  const std::vector<std::pair<std::string, std::string>> commands = {
      {"halt", ""}, {"resume", ""}, {"speed", "0"}, {"go-to", "0,0"}, {"follow", "1"},
      {"pick", ""}, {"drop", ""},   {"set", "0,0"}, {"get", "0"}};
  for (size_t i = 0; i < commands.size(); ++i) {
    const auto& [name, arguments] = commands[i];
    ASSERT_EQ(Post("command", R"({"link":"a","id":1,"command":")" + name + R"(","arguments":[)" +
                                  arguments + "]}"),
              200)
        << name;
    const auto code = static_cast<uint8_t>(i + 1);
    EXPECT_EQ(static_cast<uint8_t>(control_.commands[i].code), code);
    EXPECT_EQ(control_.commands[i].arguments.size(), protocol::CommandArgumentLength(code));
  }
}

TEST_F(FieldApiTest, AHaltIsSentOnLinksThatAreUpAndOnWhichNoOtherServerSends) {
  for (const char* const name : {"a", "b", "c"}) {
    control::LinkView& link = control_.links.emplace_back();
    link.name = name;
    link.up = true;
  }
  control_.links[1].up = false;
  control_.links[1].state = "unplugged";
  control_.links[2].role = "standby";
  control_.links[2].nodes = {"m", "n"};
  control_.links[2].owner = "m";
  const json::value answer = json::parse(Answer("halt", "").body);
  EXPECT_EQ(answer.at("links"), (json::array{"a"}));
  EXPECT_EQ(answer.at("down").at(0), (json::object{{"name", "b"},
                                                   {"state", "unplugged"},
                                                   {"role", "serves"},
                                                   {"nodes", json::array{}},
                                                   {"owner", nullptr}}));
  EXPECT_EQ(answer.at("down").at(1), (json::object{{"name", "c"},
                                                   {"state", ""},
                                                   {"role", "standby"},
                                                   {"nodes", json::array{"m", "n"}},
                                                   {"owner", "m"}}));
}

TEST_F(FieldApiTest, WhatTheServerRefusesIsAConflictWithItsWords) {
  control_.outcome = Error{"no robot 7 has said HELLO on link \"a\""};
  const Response refused =
      testing::AnswerOf(&api_, {.method = "POST",
                                .target = "/api/v1/command",
                                .local = true,
                                .body = R"({"link":"a","id":7,"command":"halt"})"});
  EXPECT_EQ(refused.status, 409);
  EXPECT_NE(refused.body.find("no robot 7 has said HELLO"), std::string::npos);
  EXPECT_EQ(Post("deposit", R"({"pheromone":1,"x_m":1,"y_m":1})"), 409);
  EXPECT_EQ(Post("goto", R"({"link":"a","id":7,"x_m":1,"y_m":1})"), 409);
  EXPECT_EQ(Post("goto", R"({"link":"a","id":7,"cancel":true})"), 409);
  EXPECT_EQ(Post("halt", ""), 409);
  EXPECT_EQ(Post("reload", "{}"), 409);
  EXPECT_EQ(Post("snapshot", "{}"), 409);
  control_.outcome = Ok();
  control_.snapshot.reset();
  EXPECT_EQ(Post("snapshot", "{}"), 501);
}

}  // namespace
}  // namespace pheromone::web
