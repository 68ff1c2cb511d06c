#include "server/operators/web/stream/conversation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include <boost/json/array.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/web/stream/services.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;
using std::string_literals::operator""s;

class ConversationTest : public ::testing::Test {
 protected:
  ConversationTest() {
    auto catalogue = std::make_shared<Catalogue>();
    catalogue->session = "17";
    catalogue->ros_distro = "humble";
    catalogue->click_pheromone = "trail";
    catalogue->channels = {{1, "/robots", "protobuf", "foxglove.SceneUpdate", "AA==", "protobuf"},
                           {2, "/status", "json", "pheromone.status", "{}", "jsonschema"}};
    catalogue->parameters = {{"/pheromone/trail/tau_s", 30.0}, {"/pheromone/trail/quantum", 0.25}};
    catalogue_ = catalogue;
    conversation_ = std::make_unique<Conversation>(catalogue_, "");
  }

  Heard Hear(const std::string& text) { return conversation_->Hear(text, false); }
  Heard HearBinary(const std::string& bytes) { return conversation_->Hear(bytes, true); }

  static json::object ObjectOf(const StreamMessage& message) {
    EXPECT_FALSE(message.is_binary);
    return json::parse(message.bytes).as_object();
  }
  // The status that is the only answer.
  static std::string ErrorIn(const Heard& heard) {
    EXPECT_TRUE(heard.changes.empty());
    EXPECT_TRUE(heard.subscribed.empty());
    if (heard.answers.size() != 1) {
      return std::to_string(heard.answers.size()) + " answers";
    }
    const json::object status = ObjectOf(heard.answers[0]);
    EXPECT_EQ(status.at("op"), "status");
    EXPECT_EQ(status.at("level"), 2);
    return std::string(status.at("message").as_string());
  }

  std::shared_ptr<const Catalogue> catalogue_;
  std::unique_ptr<Conversation> conversation_;
};

TEST_F(ConversationTest, GreetsWithInfoChannelsAndServices) {
  const std::vector<StreamMessage> greeting = conversation_->Greet();
  ASSERT_EQ(greeting.size(), 3u);
  EXPECT_EQ(ObjectOf(greeting[0]),
            json::parse(R"({"op": "serverInfo", "name": "pheromoned", "sessionId": "17",
                            "capabilities": ["clientPublish", "parameters", "parametersSubscribe",
                                             "services", "time"],
                            "supportedEncodings": ["json"], "metadata": {"ROS_DISTRO": "humble"}})"));
  const json::object channels = ObjectOf(greeting[1]);
  EXPECT_EQ(channels.at("op"), "advertise");
  EXPECT_EQ(channels.at("channels").as_array()[0],
            json::parse(R"({"id": 1, "topic": "/robots", "encoding": "protobuf", "schema": "AA==",
                            "schemaName": "foxglove.SceneUpdate", "schemaEncoding": "protobuf"})"));
  EXPECT_EQ(ObjectOf(greeting[2]).at("op"), "advertiseServices");
}

// --- Recordings.

class ReplayConversationTest : public ConversationTest {
 protected:
  ReplayConversationTest() {
    auto catalogue = std::make_shared<Catalogue>(*catalogue_);
    catalogue->recording = {"lab.pcapng", 1'700'000'000'250'000'000, 1'700'000'060'000'000'001};
    conversation_ = std::make_unique<Conversation>(catalogue, "read-only");
  }
};

TEST_F(ReplayConversationTest, GreetsWithTheTimesAndWithoutWhatChangesAnything) {
  const std::vector<StreamMessage> greeting = conversation_->Greet();
  ASSERT_EQ(greeting.size(), 2u);
  EXPECT_EQ(ObjectOf(greeting[0]),
            json::parse(R"({"op": "serverInfo", "name": "pheromoned", "sessionId": "17",
                            "capabilities": ["parameters", "parametersSubscribe", "time",
                                             "playbackControl"],
                            "supportedEncodings": ["json"],
                            "dataStartTime": {"sec": 1700000000, "nsec": 250000000},
                            "dataEndTime": {"sec": 1700000060, "nsec": 1},
                            "metadata": {"ROS_DISTRO": "humble", "recording": "lab.pcapng"}})"));
}

TEST_F(ReplayConversationTest, TakesPlaybackRequests) {
  // Pause, 1.5, seek to 100.5 s, "some-id".
  const Heard sought = HearBinary(
      "\x03\x01\x00\x00\xc0\x3f\x01\x00\x4d\x44\x66\x17\x00\x00\x00"
      "\x07\x00\x00\x00some-id"s);
  ASSERT_TRUE(sought.playback.has_value());
  EXPECT_FALSE(sought.playback->request.play);
  EXPECT_EQ(sought.playback->request.speed, 1.5F);
  EXPECT_EQ(sought.playback->request.seek_ns, 100'500'000'000u);
  EXPECT_EQ(sought.playback->id, "some-id");
  const Heard played = HearBinary("\x03\x00\x00\x00\x00\x40\x00"s + std::string(12, '\0'));
  ASSERT_TRUE(played.playback.has_value());
  EXPECT_TRUE(played.playback->request.play);
  EXPECT_EQ(played.playback->request.speed, 2.0F);
  EXPECT_FALSE(played.playback->request.seek_ns.has_value());
}

TEST_F(ReplayConversationTest, NamesWhatIsWrongWithAPlaybackRequest) {
  const auto request = [](char command, const std::string& speed, const std::string& length) {
    return "\x03"s + command + speed + std::string(9, '\0') + length;
  };
  const std::string one = "\x00\x00\x80\x3f"s;
  EXPECT_EQ(ErrorIn(HearBinary("\x03\x00"s)), "truncated playback request");
  EXPECT_EQ(ErrorIn(HearBinary(request(0, one, "\x01\0\0\0"s))), "truncated playback request");
  EXPECT_EQ(ErrorIn(HearBinary(request(2, one, "\0\0\0\0"s))),
            "playback: found command 2, expected 0 (play) or 1 (pause)");
  for (const std::string& speed : {"\0\0\0\0"s, "\0\0\x80\xbf"s, "\0\0\xc0\x7f"s}) {  // 0, -1, NaN
    EXPECT_NE(ErrorIn(HearBinary(request(0, speed, "\0\0\0\0"s))).find("expected 0.01 to 1000"),
              std::string::npos);
  }
  EXPECT_EQ(ErrorIn(HearBinary(request(0, one, "\x01\x01\0\0"s) + std::string(257, 'x'))),
            "playback: an ID of 257 bytes, expected at most 256");
}

TEST_F(ReplayConversationTest, TellsTheStateAsTheProtocolHasIt) {
  EXPECT_EQ(EncodePlaybackState({playback::State::Phase::kBuffering, 100'500'000'000, 1.5F, true},
                                "some-id"),
            "\x05\x02\x00\x4d\x44\x66\x17\x00\x00\x00\x00\x00\xc0\x3f\x01\x07\x00\x00\x00some-id"s);
}

TEST_F(ConversationTest, TheRunningServerCannotBePlayed) {
  EXPECT_EQ(ErrorIn(HearBinary("\x03\x00\x00\x00\x80\x3f"s + std::string(13, '\0'))),
            "unknown binary message, op 3");
}

// Studio fails with services whose schemas are not objects.
TEST_F(ConversationTest, DescribesEachServiceWithSchemasOfObjects) {
  for (const json::value& service : DescribeServices()) {
    for (const char* key : {"requestSchema", "responseSchema"}) {
      const json::value schema = json::parse(service.at(key).as_string());
      EXPECT_EQ(schema.at("type"), "object");
      EXPECT_TRUE(schema.at("properties").is_object());
    }
    EXPECT_EQ(service.at("request").at("schema"), service.at("requestSchema"));
  }
}

TEST_F(ConversationTest, ChoosesAKnownSubprotocol) {
  EXPECT_EQ(ChooseSubprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(ChooseSubprotocol("x, \tfoxglove.sdk.v1 ,foxglove.websocket.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(ChooseSubprotocol("foxglove.websocket.v1, foxglove.sdk.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(ChooseSubprotocol("chat, foxglove.sdk.v1"), "foxglove.sdk.v1");
  EXPECT_EQ(ChooseSubprotocol("chat,foxglove.sdk.v1 "), "foxglove.sdk.v1");
  EXPECT_EQ(ChooseSubprotocol(""), "");
  EXPECT_EQ(ChooseSubprotocol("foxglove.websocket.v2"), "");
}

TEST_F(ConversationTest, SubscribesEachChannelOnce) {
  const Heard heard = Hear(
      R"({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": 2}, {"id": 6, "channelId": 1}]})");
  EXPECT_TRUE(heard.answers.empty());
  EXPECT_EQ(heard.subscribed, (std::vector<std::pair<uint32_t, uint32_t>>{{5, 2}, {6, 1}}));
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 2}]})")),
            "subscribe: channel 2 is subscribed already");
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": 1}]})")),
            "subscribe: subscription 5 exists already");
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": 9}]})")),
            "subscribe: there is no channel 9");
  EXPECT_EQ(Hear(R"({"op": "unsubscribe", "subscriptionIds": [5]})").unsubscribed,
            std::vector<uint32_t>{5});
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "unsubscribe", "subscriptionIds": [5]})")),
            "unsubscribe: there is no such subscription");
  EXPECT_EQ(Hear(R"({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": 2}]})")
                .subscribed.size(),
            1u);
}

TEST_F(ConversationTest, AnswersNonsenseWithAnError) {
  EXPECT_NE(ErrorIn(Hear("")).find("unknown op"), std::string::npos);
  EXPECT_NE(ErrorIn(Hear("[1]")).find("expected a JSON object"), std::string::npos);
  EXPECT_NE(ErrorIn(Hear("{\"op\": \"subscr")).find("expected a JSON object"), std::string::npos);
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "dance"})")), "unknown op \"dance\"");
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1}]})")),
            "subscribe: expected {\"id\": number, \"channelId\": number}");
  EXPECT_EQ(ErrorIn(HearBinary("")), "unknown binary message, op 0");
  EXPECT_EQ(ErrorIn(HearBinary("\x01\x01")), "unknown binary message, op 1");
  EXPECT_EQ(ErrorIn(HearBinary("\x02\x01\x00\x00\x00\x01\x00\x00\x00\xff\xff\xff\xff"s)),
            "truncated service call");
}

// Otherwise one message of 64 KiB would be answered with thousands.
TEST_F(ConversationTest, ComplainsAFewTimesAboutOneMessageAndCountsTheRest) {
  std::string list;
  for (int i = 0; i < 10'000; ++i) {
    list += list.empty() ? "1" : ",1";
  }
  for (const auto& [op, key] :
       {std::pair("subscribe", "subscriptions"), std::pair("unsubscribe", "subscriptionIds"),
        std::pair("advertise", "channels"), std::pair("unadvertise", "channelIds"),
        std::pair("setParameters", "parameters")}) {
    const Heard heard = conversation_->Hear(
        R"({"op": ")" + std::string(op) + R"(", ")" + key + R"(": [)" + list + "]}", false);
    ASSERT_GE(heard.answers.size(), Conversation::kMaxComplaints + 1) << op;
    EXPECT_LE(heard.answers.size(), Conversation::kMaxComplaints + 2) << op;
    EXPECT_EQ(ObjectOf(heard.answers.back()).at("message"),
              "9992 more mistakes in the same message")
        << op;
  }
}

TEST_F(ConversationTest, ChangesAFewThingsByOneMessageAndNothingBeyond) {
  const auto change = [&](size_t count) {
    std::string list;
    for (size_t i = 0; i < count; ++i) {
      list += std::string(i == 0 ? "" : ",") + R"({"name": "/pheromone/trail/tau_s", "value": 30})";
    }
    return conversation_->Hear(R"({"op": "setParameters", "parameters": [)" + list + "]}", false);
  };
  EXPECT_EQ(change(Conversation::kMaxChanges).changes.size(), Conversation::kMaxChanges);
  const Heard heard = change(Conversation::kMaxChanges + 1);
  EXPECT_TRUE(heard.changes.empty());
  EXPECT_EQ(ObjectOf(heard.answers.back()).at("message"),
            "found 17 changes in one message, expected at most 16: none of them is made");
}

TEST_F(ConversationTest, TellsAndKeepsParameters) {
  EXPECT_EQ(ObjectOf(Hear(R"({"op": "getParameters", "id": "a", "parameterNames":
                              ["/pheromone/trail/tau_s", "nothing"]})")
                         .answers.at(0)),
            json::parse(R"({"op": "parameterValues", "id": "a", "parameters":
                [{"name": "/pheromone/trail/tau_s", "value": 30, "type": "float64"}]})"));
  EXPECT_EQ(ObjectOf(Hear(R"({"op": "getParameters", "parameterNames": []})").answers.at(0))
                .at("parameters")
                .as_array()
                .size(),
            3u);
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "setParameters", "parameters":
                            [{"name": "/pheromone/trail/quantum", "value": 1}]})")),
            "parameter /pheromone/trail/quantum is read-only: change it in the file of the "
            "configuration, and reload");
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "setParameters", "parameters":
                            [{"name": "/pheromone/none/tau_s", "value": 1}]})")),
            "there is no parameter \"/pheromone/none/tau_s\"");
  EXPECT_EQ(ErrorIn(Hear(R"({"op": "setParameters", "parameters":
                            [{"name": "stream.grid_hz", "value": 50}]})")),
            "parameter stream.grid_hz: expected a number from 0.1 to 5");
  EXPECT_TRUE(Hear(R"({"op": "setParameters", "parameters":
                       [{"name": "stream.grid_hz", "value": 2}]})")
                  .answers.empty());
  EXPECT_EQ(conversation_->grid_hz(), 2);
}

TEST_F(ConversationTest, ChangesEvaporationByTheApiAndReportsTheValueThatItHas) {
  const auto set = [this](const std::string& more) {
    return Hear(R"({"op": "setParameters")" + more + R"(, "parameters":
                    [{"name": "/pheromone/trail/tau_s", "value": 12.5}]})");
  };
  const Heard heard = set(R"(, "id": "a")");
  EXPECT_TRUE(heard.answers.empty());  // until it is done
  ASSERT_EQ(heard.changes.size(), 1u);
  const StreamChange& change = heard.changes[0];
  EXPECT_EQ(change.target, "/api/v1/laws");
  EXPECT_EQ(json::parse(change.body), json::parse(R"({"pheromone": "trail", "tau_s": 12.5})"));
  const Response done{.body = R"({"done": true, "tau_s": 12.5, "note": "until"})"};
  ASSERT_TRUE(Conversation::NeedsAnswer(change, done));
  EXPECT_EQ(ObjectOf(conversation_->Answer(change, done)),
            json::parse(R"({"op": "parameterValues", "id": "a", "parameters":
                [{"name": "/pheromone/trail/tau_s", "value": 12.5, "type": "float64"}]})"));
  EXPECT_EQ(ObjectOf(conversation_->Answer(set("").changes.at(0), done)),
            json::parse(R"({"op": "status", "level": 0, "message":
                "parameter /pheromone/trail/tau_s is changed until"})"));
  const json::object refused =
      ObjectOf(conversation_->Answer(change, Refuse(400, {"found \"x\"", "tau_s", "a number"})));
  EXPECT_EQ(refused.at("level"), 2);
  EXPECT_NE(
      std::string(refused.at("message").as_string()).find("parameter /pheromone/trail/tau_s: "),
      std::string::npos);
  Conversation reader(catalogue_, "no token");
  const Heard not_permitted = reader.Hear(
      R"({"op": "setParameters", "parameters": [{"name": "/pheromone/trail/tau_s", "value": 1}]})",
      false);
  EXPECT_TRUE(not_permitted.changes.empty());
  EXPECT_EQ(ErrorIn(not_permitted), "parameter /pheromone/trail/tau_s: no token");
}

TEST_F(ConversationTest, TellsThoseWhoWatchAParameterThatItChanged) {
  Hear(R"({"op": "subscribeParameterUpdates", "parameterNames": ["/pheromone/trail/tau_s"]})");
  auto next = std::make_shared<Catalogue>(*catalogue_);
  next->parameters["/pheromone/trail/tau_s"] = 60.0;
  const Heard heard = conversation_->Change(next);
  ASSERT_EQ(heard.answers.size(), 1u);
  EXPECT_EQ(ObjectOf(heard.answers[0]).at("parameters").as_array()[0].at("value"), 60);
}

TEST_F(ConversationTest, WatchesEveryParameterThatItWasAskedTo) {
  const std::string first = "/pheromone/trail/tau_s";
  const std::string second = "/pheromone/trail/quantum";
  const auto watch = [this](const std::string& op, const std::string& name) {
    EXPECT_TRUE(
        Hear(R"({"op": ")" + op + R"(", "parameterNames": [")" + name + "\"]}").answers.empty());
  };
  const auto changed = [this](const std::string& name, double value) {
    auto next = std::make_shared<Catalogue>(*catalogue_);
    next->parameters[name] = value;
    catalogue_ = next;
    return conversation_->Change(next).answers.size();
  };
  watch("subscribeParameterUpdates", first);
  watch("subscribeParameterUpdates", second);
  EXPECT_EQ(changed(first, 61), 1u);
  EXPECT_EQ(changed(second, 0.5), 1u);
  watch("unsubscribeParameterUpdates", first);
  EXPECT_EQ(changed(first, 62), 0u);
  EXPECT_EQ(changed(second, 0.6), 1u);
}

TEST_F(ConversationTest, EndsSubscriptionsOfChannelsThatAreGone) {
  Hear(R"({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": 2}]})");
  auto next = std::make_shared<Catalogue>(*catalogue_);
  next->channels[1] = {3, "/nets", "json", "pheromone.nets", "{}", "jsonschema"};
  const Heard heard = conversation_->Change(next);
  EXPECT_EQ(heard.unsubscribed, std::vector<uint32_t>{5});
  ASSERT_EQ(heard.answers.size(), 2u);
  EXPECT_EQ(ObjectOf(heard.answers[0]), json::parse(R"({"op": "unadvertise", "channelIds": [2]})"));
  EXPECT_EQ(ObjectOf(heard.answers[1]).at("channels").as_array()[0].at("topic"), "/nets");
}

std::string CallOf(uint8_t service, const std::string& body) {
  return "\x02"s + static_cast<char>(service) + "\0\0\0\x09\0\0\0\x04\0\0\0json"s + body;
}

TEST_F(ConversationTest, MakesRequestsOfServiceCalls) {
  const Heard heard = HearBinary(CallOf(3, R"({"pheromone": "trail", "all": true})"));
  ASSERT_EQ(heard.changes.size(), 1u);
  const StreamChange& change = heard.changes[0];
  EXPECT_EQ(change.target, "/api/v1/erase");
  EXPECT_EQ(change.body, R"({"pheromone": "trail", "all": true})");
  const StreamMessage done = conversation_->Answer(change, {.body = "{\"done\":true}\n"});
  EXPECT_TRUE(done.is_binary);
  EXPECT_EQ(done.bytes, "\x03\x03\0\0\0\x09\0\0\0\x04\0\0\0json{\"done\":true}\n"s);
  const json::object failed =
      ObjectOf(conversation_->Answer(change, Refuse(400, {"found 7", "all", "true"})));
  EXPECT_EQ(failed, json::parse(R"({"op": "serviceCallFailure", "serviceId": 3, "callId": 9,
                                    "message": "found 7 (all); expected true"})"));
  EXPECT_EQ(ObjectOf(HearBinary(CallOf(99, "{}")).answers.at(0)).at("message"),
            "there is no service 99");
}

TEST_F(ConversationTest, MakesRequestsOfWhatIsPublished) {
  const auto publish = [this](const std::string& topic, const std::string& payload) {
    Hear(R"({"op": "advertise", "channels": [{"id": 4, "topic": ")" + topic +
         R"(", "encoding": "json", "schemaName": ""}]})");
    return HearBinary("\x01\x04\0\0\0"s + payload);
  };
  Heard heard = publish("/brush", R"({"pheromone": "trail", "x_m": 1, "y_m": 2, "radius_m": 0.5,
                                      "units": 2})");
  ASSERT_EQ(heard.changes.size(), 1u);
  EXPECT_EQ(heard.changes[0].target, "/api/v1/paint");
  EXPECT_EQ(json::parse(heard.changes[0].body),
            json::parse(R"({"pheromone": "trail", "points_m": [[1, 2]], "radius_m": 0.5,
                            "units": 2})"));
  heard = publish("/brush", R"({"pheromone": "trail", "x_m": 1, "y_m": 2, "units": 2,
                                "erase": true})");
  ASSERT_EQ(heard.changes.size(), 1u);
  EXPECT_EQ(heard.changes[0].target, "/api/v1/erase");
  EXPECT_EQ(json::parse(heard.changes[0].body),
            json::parse(R"({"pheromone": "trail", "points_m": [[1, 2]]})"));
  heard = publish("/clicked_point", R"({"header": {}, "point": {"x": 1.5, "y": -2, "z": 0}})");
  ASSERT_EQ(heard.changes.size(), 1u);
  EXPECT_EQ(heard.changes[0].target, "/api/v1/deposit");
  EXPECT_EQ(json::parse(heard.changes[0].body),
            json::parse(R"({"pheromone": "trail", "x_m": 1.5, "y_m": -2})"));
  EXPECT_EQ(ErrorIn(publish("/brush", R"({"x_m": 1})")),
            "/brush: x_m, y_m: the position in metres");
  EXPECT_EQ(ErrorIn(publish("/cmd_vel", "{}")), "/cmd_vel: expected /brush or /clicked_point");
  EXPECT_EQ(ErrorIn(HearBinary("\x01\x08\0\0\0{}"s)),
            "published on channel 8, which is not advertised");
}

TEST_F(ConversationTest, RefusesEveryChangeWithoutTheRight) {
  Conversation reader(catalogue_, "changes need the server's token");
  for (const StreamService& service : StreamServices()) {
    const Heard heard = reader.Hear(CallOf(static_cast<uint8_t>(service.id), "{}"), true);
    EXPECT_TRUE(heard.changes.empty()) << service.name;
    EXPECT_EQ(ObjectOf(heard.answers.at(0)).at("message"), "changes need the server's token");
  }
  reader.Hear(R"({"op": "advertise", "channels": [{"id": 4, "topic": "/brush", "encoding": "json"},
                 {"id": 5, "topic": "/clicked_point", "encoding": "json"}]})",
              false);
  EXPECT_EQ(ErrorIn(reader.Hear("\x01\x04\0\0\0{\"x_m\":1,\"y_m\":1}"s, true)),
            "/brush: changes need the server's token");
  EXPECT_EQ(ErrorIn(reader.Hear("\x01\x05\0\0\0{}"s, true)),
            "/clicked_point: changes need the server's token");
}

TEST_F(ConversationTest, KeepsBoundedListsForAViewer) {
  for (int i = 0; i < 40; ++i) {
    Hear(R"({"op": "advertise", "channels": [{"id": )" + std::to_string(i) +
         R"(, "topic": "/brush", "encoding": "json"}]})");
  }
  EXPECT_EQ(ErrorIn(HearBinary("\x01\x27\0\0\0{}"s)),
            "published on channel 39, which is not advertised");
}

}  // namespace
}  // namespace pheromone::web
