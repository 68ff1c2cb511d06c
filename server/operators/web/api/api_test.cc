// Which request goes where, who may ask for it, and what is said when something is wrong with it.

#include "server/operators/web/api/api.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/web/testing/api_fixture.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

using testing::kToken;

class ApiTest : public testing::ApiFixture {};

TEST_F(ApiTest, EveryPathOfTheListAnswersItsMethodAndRefusesOthersWithAllow) {
  const std::vector<std::string> read = {"/healthz",      "/metrics",        "/api/v1/status",
                                         "/api/v1/links", "/api/v1/clients", "/api/v1/config"};
  for (const std::string& path : read) {
    EXPECT_EQ(Get(path).status, 200) << path;
    EXPECT_EQ(testing::AnswerOf(&api_, {.method = "HEAD", .target = path}).status, 200) << path;
    for (const char* method : {"POST", "PUT", "DELETE", "get"}) {
      const Response refused =
          testing::AnswerOf(&api_, {.method = method, .target = path, .local = true});
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
  const Response refused = testing::AnswerOf(&api_, {.method = "PUT", .target = "/api/v1/capture"});
  EXPECT_EQ(refused.status, 405);
  EXPECT_EQ(refused.headers.at(0).second, "GET, HEAD, POST");
  EXPECT_EQ(testing::AnswerOf(&api_, {.method = "POST", .target = "/api/v1/capture"}).status, 401);
}

TEST_F(ApiTest, KeysOfRobotsAreRevoked) {
  EXPECT_EQ(Parsed(Post("revoke", R"({"ids":[8,254]})")),
            json::parse(R"({"done":true,"links":["radio-a","radio-b"],"kept":false})"));
  control_.status.is_kept = true;
  EXPECT_TRUE(Parsed(Post("revoke", R"({"ids":[8,254]})")).at("kept").as_bool());
  EXPECT_EQ(control_.revoked, (std::vector<uint8_t>{8, 254}));
  control_.revoked.clear();
  using Case = std::pair<std::string, std::string>;
  for (const auto& [ids, found] : {Case("[]", "an array of 0"), Case("[0]", "0"),
                                   Case("[255]", "255"), Case("[8,264]", "264")}) {
    EXPECT_EQ(Refusal(Post("revoke", R"({"ids":)" + ids + "}")),
              "400 ids: found " + found + ", expected IDs of robots, whole numbers from 1 to 254");
  }
  EXPECT_EQ(Post("revoke", "{}").status, 400);
  EXPECT_TRUE(control_.revoked.empty());
  control_.outcome = Error{"no link has a key of robot 8"};
  EXPECT_EQ(Refusal(Post("revoke", R"({"ids":[8]})")),
            "409 : no link has a key of robot 8, expected ");
}

TEST_F(ApiTest, WhatAnOperatorHasDoneAndWhatWasRefusedAreEvents) {
  EXPECT_EQ(
      Post("paint", R"({"pheromone":"trail","points_m":[[2,1],[3,1]],"radius_m":0.1})").status,
      200);
  EXPECT_EQ(Post("paint", R"({"pheromone":"no such","points_m":[[2,1],[3,1]]})").status, 400);
  control_.outcome = Error{"no such robot"};
  EXPECT_EQ(Post("goto", R"({"link":"radio-a","id":7,"cancel":true})").status, 409);
  const json::value events = Parsed(Get("/api/v1/events")).at("events");
  ASSERT_EQ(events.as_array().size(), 2u);  // of refusals so soon after each other, one
  EXPECT_EQ(events.at(0).at("topic"), "operator");
  EXPECT_EQ(events.at(0).at("subject"), "control socket");
  EXPECT_EQ(events.at(0).at("text"), "painted \"trail\" at (2, 1)");
  EXPECT_EQ(events.at(1).at("subject"), "control socket");
  EXPECT_EQ(events.at(1).at("text"), "paint: refused, found \"no such\"");
  EXPECT_EQ(events.at(1).at("on"), false);
}

TEST_F(ApiTest, AWrongTokenIsAWarningWithItsAddressAndCounted) {
  const auto unlock = [&](const std::string& authorization, const std::string& client) {
    return testing::AnswerOf(&api_, {.method = "POST",
                                     .target = "/api/v1/unlock",
                                     .authorization = authorization,
                                     .host = "lab:8377",
                                     .client = client})
        .status;
  };
  EXPECT_EQ(unlock("Bearer " + std::string(kToken), "192.0.2.7"), 200);
  EXPECT_EQ(unlock("Bearer not-the-token-1", "192.0.2.8"), 401);
  EXPECT_EQ(unlock("Bearer not-the-token-2", "192.0.2.8"), 401);
  EXPECT_EQ(unlock("", "192.0.2.9"), 401);
  const json::value events = Parsed(Get("/api/v1/events")).at("events");
  ASSERT_EQ(events.as_array().size(), 2u);
  EXPECT_EQ(events.at(0).at("subject"), "web 192.0.2.8");
  EXPECT_EQ(events.at(0).at("text"), "unlock: refused, found an invalid token");
  EXPECT_EQ(events.at(0).at("on"), false);
  EXPECT_EQ(events.at(1).at("subject"), "web 192.0.2.9");
  EXPECT_EQ(events.at(1).at("text"), "unlock: refused, found no token");
  EXPECT_NE(Get("/metrics").body.find("\npheromone_unauthorized_total 3\n"), std::string::npos);
}

TEST_F(ApiTest, ATicketIsMadeWithTheTokenAndLetsAViewerMakeChanges) {
  const std::string ticket(Parsed(Post("ticket", "{}")).at("ticket").as_string());
  const Request viewer{.method = "POST", .target = "viewer"};
  EXPECT_EQ(api_.WhyReadOnly(viewer, ticket), "");
  EXPECT_NE(api_.WhyReadOnly(viewer, "1-0"), "");
  EXPECT_NE(api_.WhyReadOnly(viewer, ""), "");
  EXPECT_EQ(testing::AnswerOf(&api_, {.method = "POST", .target = "/api/v1/ticket"}).status, 401);
  EXPECT_EQ(Get("/api/v1/ticket").headers.at(0).second, "POST");
  EXPECT_EQ(Parsed(Get("/api/v1/events")).at("events").at(0).at("text"),
            "made a ticket for a viewer");
  Api without_token(&control_, {});
  EXPECT_EQ(testing::AnswerOf(&without_token,
                              {.method = "POST", .target = "/api/v1/ticket", .local = true})
                .status,
            409);
}

TEST_F(ApiTest, UnknownPathsAre404AndTargetsThatAreNone400) {
  for (const char* path :
       {"/dashboard", "/api/v1", "/api/v1/status/", "/api/v2/status", "/../etc/passwd"}) {
    EXPECT_EQ(Get(path).status, 404) << path;
  }
  EXPECT_EQ(
      Refusal(Get("*")),
      "400 target: the request's target is not a path, expected a path such as /api/v1/status");
}

TEST_F(ApiTest, OverTheNetworkChangesNeedTheTokenAndNoForeignOrigin) {
  const auto halt = [&](const std::string& authorization, const std::string& origin) {
    return testing::AnswerOf(&api_, {.method = "POST",
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
  // This server's own pages have no other origin, if it is the server that encrypts.
  for (const auto& [origin, status] : {std::pair("https://lab:8377", 200),
                                       std::pair("http://lab:8377", 403), std::pair("", 200)}) {
    EXPECT_EQ(testing::AnswerOf(&api_, {.method = "POST",
                                        .target = "/api/v1/halt",
                                        .encrypted = true,
                                        .authorization = good,
                                        .origin = origin,
                                        .host = "lab:8377"})
                  .status,
              status)
        << origin;
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
    EXPECT_EQ(Refusal(testing::AnswerOf(&api_, request)),
              "421 Host: unknown host name evil.example:8377, expected localhost, an IP address, "
              "or a name in web.hosts of the configuration");
    request.local = true;  // no browser gets there
    EXPECT_NE(testing::AnswerOf(&api_, request).status, 421);
  }
  for (const char* host : {"lab:8377", "localhost:8377", "192.168.7.1", ""}) {
    EXPECT_EQ(
        testing::AnswerOf(&api_, {.method = "GET", .target = "/healthz", .host = host}).status,
        200);
  }
  Request halt{.method = "POST",
               .target = "/api/v1/halt",
               .authorization = "Bearer " + std::string(kToken),
               .origin = "http://evil.example",
               .host = "evil.example"};
  EXPECT_EQ(testing::AnswerOf(&api_, halt).status, 421);
}

// A line of HTML each would be enough to keep the server busy.
TEST_F(ApiTest, WhatIsLongIsNotForPagesOfOthers) {
  Api api(&control_, {.token = "",
                      .hosts = {"lab"},
                      .origins = {"https://app.foxglove.dev"},
                      .web_root = "",
                      .more_metrics = {}});
  struct Page {
    std::string origin, site, dest;
    int status;
  };
  for (const char* target :
       {"/api/v1/field?pheromone=1", "/api/v1/clients", "/metrics", "/api/v1/status?hash=1"}) {
    for (const Page& page : std::initializer_list<Page>{
             {"", "", "", 200},
             {"", "none", "document", 200},
             {"", "same-origin", "empty", 200},
             {"http://lab:8377", "same-origin", "empty", 200},
             {"https://app.foxglove.dev", "cross-site", "empty", 200},
             {"", "cross-site", "document", 200},  // a link that was followed
             {"http://evil.example", "cross-site", "empty", 403},
             {"null", "cross-site", "empty", 403},
             {"", "cross-site", "image", 403},
             {"", "cross-site", "iframe", 403},
             {"", "same-site", "image", 403}}) {
      Request request{.method = "GET",
                      .target = target,
                      .origin = page.origin,
                      .host = "lab:8377",
                      .fetch_site = page.site,
                      .fetch_dest = page.dest};
      EXPECT_EQ(testing::AnswerOf(&api, request).status, page.status)
          << target << ' ' << page.origin << ' ' << page.site << ' ' << page.dest;
      request.local = true;
      EXPECT_EQ(testing::AnswerOf(&api, request).status, 200);
    }
  }
  EXPECT_EQ(testing::AnswerOf(&api, {.method = "GET",
                                     .target = "/api/v1/status",
                                     .origin = "http://evil.example",
                                     .host = "lab"})
                .status,
            200);
}

TEST_F(ApiTest, AStreamIsForThoseWhoMayReadAndForNoPageOfAnotherServer) {
  const auto status = [this](const std::string& host, const std::string& origin, bool local) {
    const auto refused = api_.CheckStream(
        {.method = "GET", .target = "/stream", .local = local, .origin = origin, .host = host});
    return refused ? refused->status : 0;
  };
  EXPECT_EQ(status("127.0.0.1:8377", "", false), 0);
  EXPECT_EQ(status("lab:8377", "http://lab:8377", false), 0);
  EXPECT_EQ(status("lab:8377", "https://lab:8377", false), 0);
  EXPECT_EQ(status("evil.example", "http://evil.example", false), 421);
  EXPECT_EQ(status("127.0.0.1:8377", "http://evil.example", false), 403);
  EXPECT_EQ(status("127.0.0.1:8377", "http://127.0.0.1:80", false), 403);
  EXPECT_EQ(status("127.0.0.1:8377", "null", false), 403);
  EXPECT_EQ(status("evil.example", "http://evil.example", true), 0);
}

TEST_F(ApiTest, WithoutATokenOnlyTheUnixSocketChangesThings) {
  Api api(&control_, {});
  Request request{.method = "POST", .target = "/api/v1/halt", .authorization = "Bearer "};
  EXPECT_EQ(
      Refusal(testing::AnswerOf(&api, request)),
      "403 web.token_file: this server does not accept changes over the network, expected its Unix "
      "socket, or token_file = \"web-token\" in [web], with which it makes a token at its next "
      "start");
  request.local = true;
  EXPECT_EQ(testing::AnswerOf(&api, request).status, 200);
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
            "400 x_m: found twice, expected each parameter once");
  EXPECT_EQ(Refusal(Get("/api/v1/sense?pheromone=1&x_m=nan&y_m=0")),
            "400 x_m: found \"nan\", expected a number from -1000000 to 1000000");
  EXPECT_EQ(Refusal(Get("/api/v1/field?pheromone=1&format=gif")),
            "400 format: found \"gif\", expected one of json, csv, npy, png");
  EXPECT_EQ(Refusal(Get("/api/v1/field?pheromone=1&area_m=1,2,3")),
            "400 area_m: found [1,2,3], expected two opposite corners x, y, x, y in metres, "
            "within 1000 km");
  EXPECT_EQ(Refusal(Get("/api/v1/field?pheromone=1&area_m=8,8,9,9")),
            "400 area_m: the area contains no node of the map, expected an area of the map");
}

TEST_F(ApiTest, AKeyThatComesTwiceIsNamed) {
  EXPECT_EQ(Refusal(Post("deposit", R"({"pheromone":1,"x_m":1,"y_m":1,"x_m":2})")),
            "400 x_m: found twice, expected each key once");
  EXPECT_EQ(Refusal(Post("deposit", R"({"pheromone":1,"a":[{"b":1},{"b":2,"c":{},"b":3}]})")),
            "400 b: found twice, expected each key once");
  // Written in two ways, it is the same key.
  EXPECT_EQ(Refusal(Post("deposit", R"({"x_m":1,"\u0078_m":2})")),
            "400 x_m: found twice, expected each key once");
  EXPECT_EQ(Refusal(Post("deposit", R"({"a":{"b":1},"b":{"a":1}})")),
            "400 pheromone: nothing there, expected one of 1 (trail), 2 (path)");
  EXPECT_TRUE(control_.edits.empty());
}

TEST_F(ApiTest, WhatIsNoTextIsToldAsText) {
  const std::string unknown = "\xEF\xBF\xBD";
  EXPECT_EQ(Refusal(Get("/%FF%C3%A9")),
            "404 target: there is no resource /" + unknown +
                "\xC3\xA9, expected a path such as /api/v1/status; see pheromoned(8)");
  EXPECT_EQ(Refusal(Get("/api/v1/links?%C3=1")),
            "400 " + unknown + ": unknown key, expected no keys");
  EXPECT_EQ(Refusal(Get("/api/v1/field?pheromone=%ED%A0%80")),
            "400 pheromone: found \"" + unknown + unknown + unknown +
                "\", expected one of 1 (trail), 2 (path)");
  EXPECT_EQ(Refusal(testing::AnswerOf(
                        &api_, {.method = "GET", .target = "/healthz", .host = "evil\xFE.example"}))
                .substr(0, 50),
            ("421 Host: unknown host name evil" + unknown + ".example, expected").substr(0, 50));
  // Cut short in the middle of a character.
  const Response cut = Get("/api/v1/field?pheromone=1&format=" + std::string(58, 'a') + "%C3%A9");
  EXPECT_EQ(Refusal(cut), "400 format: found \"" + std::string(58, 'a') + unknown +
                              "..., expected one of json, csv, npy, png");
}

}  // namespace
}  // namespace pheromone::web
