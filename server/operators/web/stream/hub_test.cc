#include "server/operators/web/stream/hub.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include "server/formats/foxglove/testing/tiles_viewer.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using testing::FakeControl;

class HubTest : public ::testing::Test {
 protected:
  HubTest()
      : hub_({.session = "1",
              .ros_distro = "",
              .click_pheromone = "",
              .now_us = [this] { return cost_us_ += 1; },
              .between_pieces = [this] { ++pieces_; }}) {
    control_.links.emplace_back().name = "radio-a";
    control_.links.emplace_back().name = "radio-b";
    Step();
  }

  // Makes what is due, 100 ms later.
  std::map<std::string, FramePtr> Step() {
    now_.steady_ms += 100;
    now_.unix_ns += 100'000'000;
    control_.now_ms += 100;
    const Needs needs = hub_.Due(now_.steady_ms);
    std::map<std::string, FramePtr> made;
    if (!needs.any()) {
      return made;
    }
    for (const Update& update : hub_.Make(TakeViews(control_, needs), now_)) {
      made[TopicOf(update.channel)] = update.frame;
    }
    return made;
  }

  std::string TopicOf(uint32_t id) const {
    for (const Channel& channel : hub_.catalogue()->channels) {
      if (channel.id == id) {
        return channel.topic;
      }
    }
    return "none";
  }
  uint32_t IdOf(const std::string& topic) const {
    for (const Channel& channel : hub_.catalogue()->channels) {
      if (channel.topic == topic) {
        return channel.id;
      }
    }
    ADD_FAILURE() << "no channel " << topic;
    return 0;
  }
  void AddRobot() {
    control::ClientView robot;
    robot.link = "radio-a";
    robot.id = 7;
    robot.known = true;
    robot.pose_source = control::PoseSource::kRobot;
    robot.pose = {{2'000'000, 1'500'000}, 0};
    control_.clients.push_back(robot);
  }

  FakeControl control_;
  uint64_t cost_us_ = 0;
  int pieces_ = 0;
  StreamTime now_{1000, 1'700'000'000'000'000'000};
  Hub hub_;
};

TEST_F(HubTest, OffersTheChannelsOfTheConfiguration) {
  std::vector<std::string> topics;
  for (const Channel& channel : hub_.catalogue()->channels) {
    topics.push_back(channel.topic);
  }
  EXPECT_EQ(topics, (std::vector<std::string>{"/pheromone/trail",
                                              "/pheromone_delta/trail",
                                              "/pheromone/path",
                                              "/pheromone_delta/path",
                                              "/robots",
                                              "/trails",
                                              "/obstacles",
                                              "/tags",
                                              "/goals",
                                              "/tf",
                                              "/events",
                                              "/stats/engine",
                                              "/link/radio-a",
                                              "/link/radio-b",
                                              "/clients",
                                              "/nets",
                                              "/tag_changes",
                                              "/status",
                                              "/laws",
                                              "/tag_list",
                                              "/paths"}));
  EXPECT_EQ(hub_.catalogue()->parameters.at("/pheromone/trail/tau_s"), 30.0);
  EXPECT_EQ(hub_.catalogue()->click_pheromone, "trail");
}

// Whether each member of a message is in its schema, with its type; where not, goes to `wrong`.
void CompareWithSchema(const json::value& schema, const json::value& message,
                       const std::string& where, std::vector<std::string>* wrong) {
  const json::string& type = schema.at("type").as_string();
  const bool fits = message.is_null()   ? true
                    : type == "object"  ? message.is_object()
                    : type == "array"   ? message.is_array()
                    : type == "string"  ? message.is_string()
                    : type == "boolean" ? message.is_bool()
                    : type == "integer" ? message.is_int64() || message.is_uint64()
                                        : /* "number" */ type == "number" && message.is_number();
  if (!fits) {
    wrong->push_back(where + ": " + json::serialize(message) + " is no " + std::string(type));
  } else if (message.is_object() && !schema.at("properties").as_object().empty()) {
    for (const auto& [name, member] : message.as_object()) {
      const json::value* const known = schema.at("properties").as_object().if_contains(name);
      if (known != nullptr) {
        CompareWithSchema(*known, member, where + '.' + std::string(name), wrong);
      } else if (!member.is_array() || member.as_array().empty() || !member.at(0).is_array()) {
        // viewers cannot read arrays of arrays
        wrong->push_back(where + '.' + std::string(name) + " is not in the schema");
      }
    }
  } else if (message.is_array()) {
    for (const json::value& it : message.as_array()) {
      CompareWithSchema(schema.at("items"), it, where + "[]", wrong);
    }
  }
}

TEST_F(HubTest, JsonSchemasHaveAllThatMessagesHave) {
  AddRobot();
  control::TagView tag;
  tag.content.number = 1;
  tag.content.name = "door";
  control_.tags = {tag};
  std::map<std::string, json::value> schemas;
  for (const Channel& channel : hub_.catalogue()->channels) {
    if (channel.encoding == "json") {
      schemas[channel.topic] = json::parse(channel.schema);
      hub_.AddSubscriber(channel.id);
    }
  }
  EXPECT_EQ(schemas.size(), 10u);
  std::map<std::string, FramePtr> messages;
  for (int i = 0; i < 20; ++i) {
    for (auto& [topic, frame] : Step()) {
      messages.insert_or_assign(topic, std::move(frame));
    }
  }
  for (const auto& [topic, schema] : schemas) {
    EXPECT_FALSE(schema.at("properties").as_object().empty()) << topic;
    if (topic == "/nets") {
      continue;  // there is none, and so no message
    }
    ASSERT_TRUE(messages.contains(topic)) << topic;
    std::vector<std::string> wrong;
    CompareWithSchema(schema, json::parse(messages[topic]->payload), topic, &wrong);
    EXPECT_EQ(wrong, std::vector<std::string>());
  }
  const json::value& robot = schemas["/clients"].at_pointer("/properties/clients/items/properties");
  EXPECT_EQ(
      robot.at_pointer("/antennas/properties/pheromones/properties/trail/properties/left/type"),
      "number");
  EXPECT_EQ(robot.at_pointer("/state/properties/is/type"), "string");
  EXPECT_EQ(robot.at_pointer("/silent_s/type"), "number");
}

TEST_F(HubTest, LetsItsThreadPauseWhileItDraws) {
  hub_.AddSubscriber(IdOf("/robots"));
  Step();
  EXPECT_EQ(pieces_, 0);
  hub_.AddSubscriber(IdOf("/pheromone_delta/trail"));
  Step();
  EXPECT_GT(pieces_, 0);
}

TEST_F(HubTest, AsksForNothingThatNobodyWants) {
  EXPECT_FALSE(hub_.Due(now_.steady_ms + 1).any());
  const Needs later = hub_.Due(now_.steady_ms + 2000);  // whether the configuration is the same
  EXPECT_TRUE(later.field);
  EXPECT_FALSE(later.clients || later.links || later.status || later.nets || later.tags);
  EXPECT_TRUE(Step().empty());
  hub_.AddSubscriber(IdOf("/status"));
  const Needs needs = hub_.Due(now_.steady_ms + 1);
  EXPECT_TRUE(needs.status);
  EXPECT_FALSE(needs.clients || needs.links || needs.nets || needs.tags);
  hub_.RemoveSubscriber(IdOf("/status"));
  EXPECT_TRUE(Step().empty());
}

TEST_F(HubTest, MakesEachChannelAtItsOwnRate) {
  for (const char* topic : {"/clients", "/status", "/goals"}) {
    hub_.AddSubscriber(IdOf(topic));
  }
  std::map<std::string, int> count;
  for (int i = 0; i < 30; ++i) {
    for (const auto& [topic, frame] : Step()) {
      ++count[topic];
    }
  }
  EXPECT_EQ(count, (std::map<std::string, int>{{"/clients", 30}, {"/goals", 6}, {"/status", 3}}));
}

TEST_F(HubTest, SendsTheLatestToNewSubscribersAtOnce) {
  hub_.AddSubscriber(IdOf("/obstacles"));
  EXPECT_EQ(Step().count("/obstacles"), 1u);
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(Step().empty());  // nothing changed
  }
  hub_.AddSubscriber(IdOf("/obstacles"));
  EXPECT_EQ(Step().count("/obstacles"), 1u);
}

TEST_F(HubTest, ShowsOnTheChannelOfALinkThatLink) {
  control_.links[0].state = "open";
  control_.links[1].state = "unplugged";
  for (const char* topic : {"/link/radio-a", "/link/radio-b"}) {
    hub_.AddSubscriber(IdOf(topic));
  }
  const auto made = Step();
  const json::value first = json::parse(made.at("/link/radio-a")->payload);
  const json::value second = json::parse(made.at("/link/radio-b")->payload);
  EXPECT_EQ(first.at("name"), "radio-a");
  EXPECT_EQ(first.at("state"), "open");
  EXPECT_EQ(second.at("name"), "radio-b");
  EXPECT_EQ(second.at("state"), "unplugged");
}

// After a leap in a replay, viewers have nothing of what was there before.
TEST_F(HubTest, SendsEverythingAnewOnceItHasForgotten) {
  hub_.AddSubscriber(IdOf("/obstacles"));
  hub_.AddSubscriber(IdOf("/laws"));
  Step();
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(Step().empty());
  }
  hub_.Forget();
  const auto made = Step();
  EXPECT_EQ(made.count("/obstacles"), 1u);
  EXPECT_EQ(made.count("/laws"), 1u);
}

TEST_F(HubTest, EncodesTheSameTilesOnceForAll) {
  const uint32_t tiles = IdOf("/pheromone_delta/trail");
  hub_.AddSubscriber(tiles);
  EXPECT_EQ(Step().count("/pheromone_delta/trail"), 1u);
  const Hub::Tiles first = hub_.TilesSince(tiles, 0, 1);
  ASSERT_NE(first.frame, nullptr);
  EXPECT_EQ(hub_.TilesSince(tiles, 0, 2).frame, first.frame);
  EXPECT_EQ(hub_.TilesSince(tiles, first.version, 2).frame, nullptr);
  control_.field.Deposit(1, {1'000'000, 1'000'000}, 2, control_.now_ms);
  Step();
  Step();  // pictures are made five times a second
  const Hub::Tiles next = hub_.TilesSince(tiles, first.version, 3);
  ASSERT_NE(next.frame, nullptr);
  EXPECT_NE(hub_.TilesSince(tiles, 0, 3).frame, next.frame);
}

TEST_F(HubTest, TellsWhatRobotsSense) {
  AddRobot();
  control_.field.Deposit(1, {2'000'000, 2'000'000}, 4, control_.now_ms);
  hub_.AddSubscriber(IdOf("/clients"));
  const auto made = Step();
  const json::value clients = json::parse(made.at("/clients")->payload);
  EXPECT_EQ(clients.at("field_time_ms"), control_.now_ms);
  const json::value& antennas = clients.at("clients").as_array().at(0).at("antennas");
  // b = 1 m: half a metre to the left of the centre, where one unit lies.
  EXPECT_EQ(antennas.at("left").at("y_m").to_number<double>(), 2.0);
  EXPECT_EQ(antennas.at("pheromones").at("trail").at("left").to_number<double>(), 1.0);
  EXPECT_EQ(antennas.at("pheromones").at("trail").at("right").to_number<double>(), 0.0);
  EXPECT_EQ(antennas.at("pheromones").at("guide").at("left").to_number<double>(), 1.0);
}

TEST_F(HubTest, ShowsAnotherConfiguration) {
  const uint32_t trail = IdOf("/pheromone_delta/trail");
  hub_.AddSubscriber(trail);
  Step();
  const uint64_t version = hub_.TilesSince(trail, 0, 1).version;
  const auto before = hub_.catalogue();
  control_.config.pheromones[0].tau_ms = 60'000;
  control_.config.pheromones.erase(control_.config.pheromones.begin() + 1);
  for (int i = 0; i < 11; ++i) {
    Step();
  }
  EXPECT_NE(hub_.catalogue(), before);
  EXPECT_EQ(hub_.catalogue()->parameters.at("/pheromone/trail/tau_s"), 60.0);
  EXPECT_EQ(IdOf("/pheromone_delta/trail"), trail);
  testing::TilesViewer viewer;
  Step();
  const Hub::Tiles anew = hub_.TilesSince(trail, version, 1);
  ASSERT_NE(anew.frame, nullptr);
  ASSERT_TRUE(viewer.Take(anew.frame->payload));
  EXPECT_TRUE(viewer.full);
}

TEST_F(HubTest, TellsEventsOfTheServerAndOfRobots) {
  AddRobot();
  hub_.AddSubscriber(IdOf("/events"));
  Step();
  hub_.AddNotice({.topic = control::Notice::Topic::kLink,
                  .is_on = false,
                  .subject = "radio-a",
                  .text = "unplugged"},
                 5);
  const auto made = Step();
  ASSERT_EQ(made.count("/events"), 1u);
  EXPECT_NE(made.at("/events")->payload.find("link radio-a is down: unplugged"), std::string::npos);
  control_.clients[0].robot.last_event =
      protocol::EventReport{7, 1, protocol::EventCode::kLoadPicked, 3};
  Step();
  Step();
  control_.clients[0].robot.last_event->seq = 2;
  Step();
  Step();
  ASSERT_EQ(hub_.RecentEvents().size(), 3u);  // of the robot both, the first one too
  EXPECT_NE(hub_.RecentEvents()[1]->payload.find("robot radio-a 7"), std::string::npos);
  for (int i = 0; i < 10; ++i) {  // it is still the robot's last one
    EXPECT_EQ(Step().count("/events"), 0u);
  }
  EXPECT_EQ(hub_.RecentEvents().size(), 3u);
}

TEST_F(HubTest, DoesNotTellWhatRobotsReportedBeforeItLooked) {
  AddRobot();
  control_.clients[0].robot.last_event =
      protocol::EventReport{7, 1, protocol::EventCode::kLoadPicked, 3};
  hub_.AddSubscriber(IdOf("/events"));
  Step();
  Step();
  EXPECT_TRUE(hub_.RecentEvents().empty());
}

TEST_F(HubTest, NamesTheTagsThatChanged) {
  const auto tag = [](uint16_t number, const std::string& name, uint64_t hash) {
    control::TagView view;
    view.content.number = number;
    view.content.name = name;
    view.content.hash = hash;
    return view;
  };
  control_.tags = {tag(1, "door", 10), tag(2, "dock", 20)};
  hub_.AddSubscriber(IdOf("/tag_changes"));
  EXPECT_EQ(json::parse(Step().at("/tag_changes")->payload),
            json::parse(R"({"version": 1, "changed": ["door", "dock"]})"));
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(Step().empty());
  }
  control_.tags[1].content.hash = 21;
  std::map<std::string, FramePtr> made;
  for (int i = 0; i < 6 && made.empty(); ++i) {
    made = Step();
  }
  EXPECT_EQ(json::parse(made.at("/tag_changes")->payload),
            json::parse(R"({"version": 2, "changed": ["dock"]})"));
}

}  // namespace
}  // namespace pheromone::web
