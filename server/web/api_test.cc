// Which request goes where, who may ask for it, and what is said when something is wrong with it.

#include "server/web/api.h"

#include <gtest/gtest.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr char kToken[] = "0123456789abcdef";

class ApiTest : public ::testing::Test {
 protected:
  Response Get(const std::string& target) {
    return api_.Handle({.method = "GET", .target = target});
  }

  Response Post(const std::string& path, const std::string& body) {
    return api_.Handle(
        {.method = "POST", .target = "/api/v1/" + path, .local = true, .body = body});
  }

  static json::value Parsed(const Response& response) {
    EXPECT_EQ(response.content_type, "application/json") << response.body;
    json::error_code error;
    json::value value = json::parse(response.body, error);
    EXPECT_FALSE(error) << response.body;
    return value;
  }

  // The refusal, as "STATUS where: what, expected ...".
  static std::string Refusal(const Response& response) {
    const json::value parsed = Parsed(response);
    if (response.status == 200 || !parsed.as_object().contains("error")) {
      return "none: " + response.body;
    }
    const json::object& error = parsed.as_object().at("error").as_object();
    const auto text = [&](const char* key) { return std::string(error.at(key).as_string()); };
    return std::to_string(response.status) + " " + text("where") + ": " + text("what") +
           ", expected " + text("expected");
  }

  testing::FakeControl control_;
  const Api api_{&control_, {kToken, {"lab"}}};
};

TEST_F(ApiTest, EveryPathOfTheListAnswersItsMethodAndRefusesOthersWithAllow) {
  const std::vector<std::string> read = {"/healthz",      "/metrics",     "/api/v1/status",
                                         "/api/v1/links", "/api/v1/laws", "/api/v1/clients",
                                         "/api/v1/config"};
  for (const std::string& path : read) {
    EXPECT_EQ(Get(path).status, 200) << path;
    EXPECT_EQ(api_.Handle({.method = "HEAD", .target = path}).status, 200) << path;
    for (const char* method : {"POST", "PUT", "DELETE", "get"}) {
      const Response refused = api_.Handle({.method = method, .target = path, .local = true});
      EXPECT_EQ(refused.status, 405) << method << path;
      ASSERT_EQ(refused.headers.size(), 1u);
      EXPECT_EQ(refused.headers[0], std::pair(std::string("Allow"), std::string("GET, HEAD")));
    }
  }
  for (const char* path : {"deposit", "erase", "paint", "command", "halt", "reload", "snapshot"}) {
    const Response refused = Get(std::string("/api/v1/") + path);
    EXPECT_EQ(refused.status, 405) << path;
    EXPECT_EQ(refused.headers.at(0).second, "POST") << path;
  }
  EXPECT_TRUE(control_.edits.empty());
}

TEST_F(ApiTest, ARecordingIsLookedAtStartedAndStoppedAtOnePath) {
  control_.status.capture.folder = "captures";
  control_.status.capture.lost = 3;
  EXPECT_EQ(Parsed(Get("/api/v1/capture")),
            json::parse(R"({"recording":false,"folder":"captures","file":null,"error":null,)"
                        R"("files":0,"bytes":0,"records":0,"lost":3})"));
  const json::value started = Parsed(Post("capture", R"({"action":"start"})"));
  EXPECT_TRUE(started.at("done").as_bool());
  EXPECT_TRUE(started.at("recording").as_bool());
  EXPECT_TRUE(Parsed(Get("/api/v1/status")).at("capture").at("recording").as_bool());
  EXPECT_EQ(Post("capture", R"({"action":"stop"})").status, 200);
  EXPECT_FALSE(control_.status.capture.recording);
  control_.outcome = Error{"there is no recording"};
  EXPECT_EQ(Refusal(Post("capture", R"({"action":"stop"})")),
            "409 : there is no recording, expected ");
  EXPECT_EQ(Refusal(Post("capture", R"({"action":"pause"})")),
            "400 action: found \"pause\", expected one of start, stop");
  EXPECT_EQ(Post("capture", "{}").status, 400);
  const Response refused = api_.Handle({.method = "PUT", .target = "/api/v1/capture"});
  EXPECT_EQ(refused.status, 405);
  EXPECT_EQ(refused.headers.at(0).second, "GET, HEAD, POST");
  EXPECT_EQ(api_.Handle({.method = "POST", .target = "/api/v1/capture"}).status, 401);
}

TEST_F(ApiTest, UnknownPathsAre404AndTargetsThatAreNone400) {
  for (const char* path : {"/", "/api/v1", "/api/v1/status/", "/api/v2/status", "/../etc/passwd"}) {
    EXPECT_EQ(Get(path).status, 404) << path;
  }
  EXPECT_EQ(Refusal(Get("*")),
            "400 target: the request's target is not a path, expected such as /api/v1/status");
}

TEST_F(ApiTest, OverTheNetworkChangesNeedTheTokenAndNoForeignOrigin) {
  const auto halt = [&](const std::string& authorization, const std::string& origin) {
    return api_
        .Handle({.method = "POST",
                 .target = "/api/v1/halt",
                 .authorization = authorization,
                 .origin = origin,
                 .host = "lab:8377"})
        .status;
  };
  const std::string good = "Bearer " + std::string(kToken);
  EXPECT_EQ(halt(good, ""), 200);
  EXPECT_EQ(halt(good, "http://lab:8377"), 200);
  EXPECT_EQ(halt(good, "https://lab:8377"), 200);
  for (const char* origin : {"http://evil.example", "http://lab", "null", "http://lab:8377.evil"}) {
    EXPECT_EQ(halt(good, origin), 403) << origin;
  }
  for (const std::string& bad :
       {std::string(), std::string("Bearer "), std::string(kToken), good + "0",
        good.substr(0, good.size() - 1), "Basic " + std::string(kToken)}) {
    EXPECT_EQ(halt(bad, ""), 401) << bad;
  }
}

TEST_F(ApiTest, WhoAsksOverTheNetworkForAnotherServerLearnsNothing) {
  for (const char* target : {"/api/v1/status", "/metrics", "/healthz", "/none"}) {
    Request request{.method = "GET", .target = target, .host = "evil.example:8377"};
    EXPECT_EQ(Refusal(api_.Handle(request)),
              "421 Host: this server is not known as evil.example:8377, expected localhost, an "
              "address, or a name from web.hosts in the configuration");
    request.local = true;  // no browser gets there
    EXPECT_NE(api_.Handle(request).status, 421);
  }
  for (const char* host : {"lab:8377", "localhost:8377", "192.168.7.1", ""}) {
    EXPECT_EQ(api_.Handle({.method = "GET", .target = "/healthz", .host = host}).status, 200);
  }
  Request halt{.method = "POST",
               .target = "/api/v1/halt",
               .authorization = "Bearer " + std::string(kToken),
               .origin = "http://evil.example",
               .host = "evil.example"};
  EXPECT_EQ(api_.Handle(halt).status, 421);
}

TEST_F(ApiTest, WithoutATokenOnlyTheUnixSocketChangesThings) {
  const Api api(&control_, {});
  Request request{.method = "POST", .target = "/api/v1/halt", .authorization = "Bearer "};
  EXPECT_EQ(Refusal(api.Handle(request)),
            "403 web.token_file: this server takes no changes over the network, expected the Unix "
            "socket, or a token in the configuration");
  request.local = true;
  EXPECT_EQ(api.Handle(request).status, 200);
}

TEST_F(ApiTest, BadBodiesAreToldWhatIsWrongWhere) {
  EXPECT_EQ(Refusal(Post("deposit", "{\"x_m\":")),
            "400 body: not JSON: incomplete JSON, expected a JSON object");
  EXPECT_EQ(Refusal(Post("deposit", "[1]")), "400 body: found [1], expected a JSON object");
  EXPECT_EQ(Refusal(Post("deposit", "")),
            "400 pheromone: nothing there, expected one of 1 (trail), 2 (path)");
  EXPECT_EQ(Refusal(Post("deposit", R"({"pheromone":"guide","x_m":1,"y_m":1})")),
            "400 pheromone: found \"guide\", expected one of 1 (trail), 2 (path)");
  EXPECT_EQ(Refusal(Post("deposit", R"({"pheromone":1,"x_m":"far","y_m":1})")),
            "400 x_m: found \"far\", expected a number from -1000000 to 1000000");
  EXPECT_EQ(Refusal(Post("deposit", R"({"pheromone":1,"x_m":1,"y_m":1,"quanta":9})")),
            "400 quanta: found 9, expected a whole number from 1 to 8");
  EXPECT_EQ(Refusal(Post("deposit", R"({"pheromone":1,"x_m":1,"y_m":1,"z":0})")),
            "400 z: unknown key, expected one of pheromone, x_m, y_m, quanta");
  EXPECT_EQ(Refusal(Post("halt", R"({"now":true})")), "400 now: unknown key, expected no keys");
  EXPECT_EQ(Post("deposit", std::string(100'000, '[')).status, 400);
  EXPECT_TRUE(control_.edits.empty());
}

TEST_F(ApiTest, BadQueriesAreToldWhatIsWrongWhere) {
  EXPECT_EQ(Refusal(Get("/api/v1/status?hash=2")),
            "400 hash: found 2, expected a whole number from 0 to 1");
  EXPECT_EQ(Refusal(Get("/api/v1/links?x=1")), "400 x: unknown key, expected no keys");
  EXPECT_EQ(Refusal(Get("/api/v1/sense?x_m=1&x_m=2")),
            "400 x_m: found it twice, expected each parameter once");
  EXPECT_EQ(Refusal(Get("/api/v1/sense?pheromone=1&x_m=nan&y_m=0")),
            "400 x_m: found \"nan\", expected a number from -1000000 to 1000000");
  EXPECT_EQ(Refusal(Get("/api/v1/field?pheromone=1&format=gif")),
            "400 format: found \"gif\", expected one of json, csv, png");
  EXPECT_EQ(Refusal(Get("/api/v1/field?pheromone=1&area_m=1,2,3")),
            "400 area_m: found [1,2,3], expected two opposite corners x, y, x, y in metres, "
            "within 1000 km");
  EXPECT_EQ(Refusal(Get("/api/v1/field?pheromone=1&area_m=8,8,9,9")),
            "400 area_m: no node of the map lies there, expected an area of the map");
}

TEST_F(ApiTest, HealthIs503WithTheReasonWhileNoChangesAreTaken) {
  control_.outcome = Error{"the disk is full"};
  EXPECT_EQ(Refusal(Get("/healthz")), "503 : the disk is full, expected a log that takes changes");
}

TEST_F(ApiTest, StatusHasTheHashOnlyIfAskedFor) {
  control_.status.sequence = 12;
  EXPECT_TRUE(Parsed(Get("/api/v1/status")).at("state_hash").is_null());
  const json::value status = Parsed(Get("/api/v1/status?hash=1"));
  EXPECT_EQ(status.at("state_hash").as_string(), "0123456789abcdef");
  EXPECT_EQ(status.at("sequence").to_number<int>(), 12);
}

TEST_F(ApiTest, ConfigurationsAreLines) {
  EXPECT_EQ(Get("/api/v1/config").body, "{\"lines\":[\"a \\\"map\\\"\",\"two\\nlines\"]}\n");
}

TEST_F(ApiTest, LinksTellUtilisationOnlyWhereTheLineHasALimit) {
  engine::LinkView serial;
  serial.name = "radio-a";
  serial.up = true;
  serial.byte_rate = 960;
  serial.bytes_per_s = 240;
  serial.counters = {{"crc_errors", "", 3}};
  control_.links = {serial, {}};
  const json::value view = Parsed(Get("/api/v1/links"));
  const json::array& links = view.at("links").as_array();
  ASSERT_EQ(links.size(), 2u);
  EXPECT_EQ(links[0].at("utilisation").to_number<double>(), 0.25);
  EXPECT_EQ(links[0].at("counters").at("crc_errors").to_number<int>(), 3);
  EXPECT_TRUE(links[1].at("utilisation").is_null());
}

TEST_F(ApiTest, LinksTellWhyTheyAreDownAndWhatIsTriedOrHowLongTheyAreSilent) {
  engine::LinkView down;
  down.state = "no such port";
  down.last_error = "no such port";
  down.failed_attempts = 4;
  down.next_attempt_s = 2.5;
  engine::LinkView quiet;
  quiet.up = true;
  quiet.silent = true;
  quiet.silent_s = 61.5;
  control_.links = {down, quiet};
  const json::value view = Parsed(Get("/api/v1/links"));
  const json::value& first = view.at("links").as_array()[0];
  EXPECT_EQ(first.at("last_error").as_string(), "no such port");
  EXPECT_EQ(first.at("failed_attempts").to_number<int>(), 4);
  EXPECT_EQ(first.at("next_attempt_s").to_number<double>(), 2.5);
  EXPECT_TRUE(first.at("silent_s").is_null());
  EXPECT_FALSE(first.at("silent").as_bool());
  const json::value& second = view.at("links").as_array()[1];
  EXPECT_EQ(second.at("failed_attempts").to_number<int>(), 0);
  EXPECT_TRUE(second.at("next_attempt_s").is_null());
  EXPECT_EQ(second.at("silent_s").to_number<double>(), 61.5);
  EXPECT_TRUE(second.at("silent").as_bool());
}

TEST_F(ApiTest, ClientsTellWhatIsKnownOfThem) {
  engine::ClientView client;
  client.link = "radio-a";
  client.id = 7;
  client.known = true;
  client.silent_ms = 2500;
  client.pose_source = engine::PoseSource::kTracker;
  client.pose = {{1'500'000, -250'000}, 16384};
  client.robot.nonce = 9;
  client.robot.last_event = protocol::EventReport{7, 1, protocol::EventCode::kObstacle, -3};
  client.robot.command.outcome = engine::CommandOutcome::kRefused;
  client.robot.command.command.code = protocol::CommandCode::kSpeed;
  client.robot.command.result = 11;
  control_.clients = {client, {}};
  const json::value view = Parsed(Get("/api/v1/clients"));
  const json::value& first = view.at("clients").as_array()[0];
  EXPECT_EQ(first.at("silent_s").to_number<double>(), 2.5);
  EXPECT_EQ(first.at("pose").at("x_m").to_number<double>(), 1.5);
  EXPECT_EQ(first.at("pose").at("heading_deg").to_number<double>(), 90);
  EXPECT_EQ(first.at("pose").at("source").as_string(), "tracker");
  EXPECT_EQ(first.at("last_event").at("event").as_string(), "obstacle");
  EXPECT_EQ(first.at("last_command").at("command").as_string(), "speed");
  EXPECT_EQ(first.at("last_command").at("reason").as_string(), "bad value");
  const json::value& second = view.at("clients").as_array()[1];
  EXPECT_TRUE(second.at("silent_s").is_null());
  EXPECT_TRUE(second.at("pose").is_null());
  EXPECT_TRUE(second.at("last_command").is_null());
}

}  // namespace
}  // namespace pheromone::web
