// Which request goes where, who may ask for it, and what is said when something is wrong with it.

#include "server/operators/web/api/api.h"

#include <gtest/gtest.h>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

namespace json = boost::json;

constexpr char kToken[] = "0123456789abcdef";

class ApiTest : public ::testing::Test {
 protected:
  Response Get(const std::string& target) {
    return testing::AnswerOf(&api_, {.method = "GET", .target = target});
  }

  Response Post(const std::string& path, const std::string& body) {
    return testing::AnswerOf(
        &api_, {.method = "POST", .target = "/api/v1/" + path, .local = true, .body = body});
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
  Api api_{&control_, {kToken, {"lab"}}};
};

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

// Lanes that keep what they are given until the test runs it, and take no more than they should.
struct HeldLane {
  size_t room = 100;
  std::vector<Work> held;

  Lane lane() {
    return [this](Work work) {
      if (held.size() >= room) {
        return false;
      }
      held.push_back(std::move(work));
      return true;
    };
  }
  void RunOne() {
    const Work work = std::move(held.front());
    held.erase(held.begin());
    work();
  }
};

class LanesTest : public ::testing::Test {
 protected:
  // The statuses that come appear in `statuses_`, by the name of the request.
  void Ask(const std::string& name, const std::string& method, const std::string& target,
           const std::string& body = "") {
    api_.Handle({.method = method, .target = target, .local = true, .body = body},
                [this, name](const Response& response) {
                  EXPECT_EQ(statuses_.count(name), 0u) << name << " answered twice";
                  statuses_[name] = response.status;
                  bodies_[name] = response.body;
                });
  }
  void Get(const std::string& name, const std::string& target) { Ask(name, "GET", target); }

  testing::FakeControl control_;
  HeldLane long_work_;
  HeldLane pictures_;
  HeldLane requests_;
  Api api_{
      &control_,
      {},
      {.long_work = long_work_.lane(), .pictures = pictures_.lane(), .requests = requests_.lane()}};
  std::map<std::string, int> statuses_;
  std::map<std::string, std::string> bodies_;
};

TEST_F(LanesTest, AHaltACommandAndHealthWaitForNoLane) {
  long_work_.room = 0;
  pictures_.room = 0;
  Ask("halt", "POST", "/api/v1/halt");
  Ask("command", "POST", "/api/v1/command", R"({"link":"a","id":1,"command":"halt"})");
  Get("health", "/healthz");
  Get("status", "/api/v1/status");
  Get("metrics", "/metrics");
  Get("hash", "/api/v1/status?hash=1");
  Ask("paint", "POST", "/api/v1/paint", R"({"pheromone":1,"all":true})");
  Get("picture", "/api/v1/field?pheromone=1");
  EXPECT_EQ(statuses_, (std::map<std::string, int>{{"halt", 200},
                                                   {"command", 200},
                                                   {"health", 200},
                                                   {"status", 200},
                                                   {"metrics", 503},
                                                   {"hash", 503},
                                                   {"paint", 503},
                                                   {"picture", 503}}));
}

TEST_F(LanesTest, WhatIsUrgentIsKnownByItsPathAlone) {
  for (const char* target :
       {"/healthz", "/healthz?x=1", "/api/v1/halt", "/api/v1/unlock", "/api/v1/command"}) {
    EXPECT_TRUE(IsUrgent({.method = "GET", .target = target})) << target;
  }
  for (const char* target : {"", "/", "/healthz/", "/metrics", "/api/v1/field?/healthz"}) {
    EXPECT_FALSE(IsUrgent({.method = "GET", .target = target})) << target;
  }
}

TEST_F(LanesTest, AWrongTokenIsRefusedAtOnceHoweverBusyTheServerIs) {
  long_work_.room = 0;
  pictures_.room = 0;
  requests_.room = 0;
  Api api(
      &control_, {.token = kToken},
      {.long_work = long_work_.lane(), .pictures = pictures_.lane(), .requests = requests_.lane()});
  for (const auto& [token, status] :
       {std::pair(std::string("not the token"), 401), std::pair(std::string(kToken), 200)}) {
    int answered = 0;  // before Handle has returned
    api.Handle({.method = "POST",
                .target = "/api/v1/unlock",
                .authorization = "Bearer " + token,
                .body = "{}"},
               [&answered](const Response& response) { answered = response.status; });
    EXPECT_EQ(answered, status);
  }
}

TEST_F(LanesTest, ALongBodyIsReadElsewhere) {
  Ask("halt", "POST", "/api/v1/halt", R"({"x":")" + std::string(5000, 'a') + "\"}");
  EXPECT_TRUE(statuses_.empty());
  ASSERT_EQ(long_work_.held.size(), 1u);
  long_work_.RunOne();
  EXPECT_EQ(statuses_["halt"], 400);
}

TEST_F(LanesTest, APictureIsDrawnOnceForAllThatWaitForIt) {
  control_.field.Deposit(1, {500'000, 0}, 3, 0);
  Get("a", "/api/v1/field?pheromone=1");
  Get("b", "/api/v1/field?pheromone=1");
  Get("other", "/api/v1/field?pheromone=2");
  ASSERT_EQ(pictures_.held.size(), 2u);
  pictures_.RunOne();
  Get("late", "/api/v1/field?pheromone=1");  // what it shows must not be older than the request
  EXPECT_EQ(pictures_.held.size(), 2u);
  EXPECT_TRUE(statuses_.empty());
  requests_.RunOne();
  EXPECT_EQ(statuses_, (std::map<std::string, int>{{"a", 200}, {"b", 200}}));
  EXPECT_EQ(bodies_["a"], bodies_["b"]);
  while (!pictures_.held.empty()) {
    pictures_.RunOne();
    requests_.RunOne();
  }
  EXPECT_EQ(statuses_.size(), 4u);
  EXPECT_EQ(bodies_["late"], bodies_["a"]);
  EXPECT_NE(bodies_["other"], bodies_["a"]);
}

TEST_F(LanesTest, APictureIsDrawnAgainIfTheLawsChangeMeanwhileAndGivenUpIfTheyKeepChanging) {
  Get("a", "/api/v1/field?pheromone=1");
  for (int looks = 1; looks <= 5; ++looks) {
    ASSERT_EQ(pictures_.held.size(), 1u) << looks;
    EXPECT_TRUE(statuses_.empty());
    pictures_.RunOne();
    control_.config.pheromones[0].tau_ms += 1000;
    requests_.RunOne();
  }
  EXPECT_EQ(statuses_["a"], 503);
  Get("b", "/api/v1/field?pheromone=1");
  pictures_.RunOne();
  control_.config.pheromones[0].tau_ms += 1000;
  requests_.RunOne();
  pictures_.RunOne();
  requests_.RunOne();
  EXPECT_EQ(statuses_["b"], 200);
}

TEST_F(LanesTest, APictureWithAMistakeIsRefusedAtOnceAndHoldsUpNoLaterOne) {
  Get("bad", "/api/v1/field?pheromone=9");
  EXPECT_EQ(statuses_["bad"], 400);
  Get("again", "/api/v1/field?pheromone=9");
  EXPECT_EQ(statuses_["again"], 400);
  pictures_.room = 0;
  Get("full", "/api/v1/field?pheromone=1");
  EXPECT_EQ(statuses_["full"], 503);
  pictures_.room = 1;
  Get("room", "/api/v1/field?pheromone=1");
  pictures_.RunOne();
  requests_.RunOne();
  EXPECT_EQ(statuses_["room"], 200);
}

TEST_F(ApiTest, HealthIs503WithTheReasonWhileNoChangesAreTaken) {
  control_.outcome = Error{"the disk is full"};
  EXPECT_EQ(Refusal(Get("/healthz")),
            "503 : the disk is full, expected a log that accepts changes and a disk that responds");
}

TEST_F(ApiTest, StatusHasTheHashOnlyIfAskedFor) {
  control_.status.sequence = 12;
  EXPECT_TRUE(Parsed(Get("/api/v1/status")).at("state_hash").is_null());
  const json::value status = Parsed(Get("/api/v1/status?hash=1"));
  EXPECT_EQ(status.at("state_hash").as_string(), "0123456789abcdef");
  EXPECT_EQ(status.at("sequence").to_number<int>(), 12);
}

TEST_F(ApiTest, StatusWarnsOfWhatMakesTheServerUnhealthy) {
  EXPECT_TRUE(Parsed(Get("/api/v1/status")).at("warning").is_null());
  control_.status.warning = "no response from the disk for 2.1 s";
  EXPECT_EQ(Parsed(Get("/api/v1/status")).at("warning").as_string(),
            "no response from the disk for 2.1 s");
}

TEST_F(ApiTest, ConfigurationsAreLines) {
  EXPECT_EQ(Get("/api/v1/config").body,
            "{\"lines\":[\"a \\\"map\\\"\",\"two\\nlines\"],\"file\":\"/lab.toml\","
            "\"journal\":null}\n");
}

TEST_F(ApiTest, TrackersTellWhatTheyRefuseAndWhy) {
  control_.trackers = {{.name = "ceiling",
                        .address = "127.0.0.1:4960",
                        .up = true,
                        .state = "udp 127.0.0.1:4960",
                        .datagrams = 9,
                        .poses = 5,
                        .refusals = {{"unknown link", 4}},
                        .last_refusal = "unknown link: \"pose x 1 0 0 0\""},
                       {}};
  const json::value view = Parsed(Get("/api/v1/trackers"));
  EXPECT_EQ(view.at("trackers").at(0),
            (json::object{{"name", "ceiling"},
                          {"address", "127.0.0.1:4960"},
                          {"up", true},
                          {"state", "udp 127.0.0.1:4960"},
                          {"datagrams", 9},
                          {"poses", 5},
                          {"refusals", json::array{{{"reason", "unknown link"}, {"count", 4}}}},
                          {"last_refusal", "unknown link: \"pose x 1 0 0 0\""}}));
  EXPECT_TRUE(view.at("trackers").at(1).at("last_refusal").is_null());
}

TEST_F(ApiTest, LinksTellUtilisationOnlyWhereTheLineHasALimit) {
  control::LinkView serial;
  serial.name = "radio-a";
  serial.up = true;
  serial.byte_rate = 960;
  serial.bytes_per_s = 240;
  serial.counters = {{"rounds", "", 7, false, false},
                     {"stray_bytes", "", 90, true, false},
                     {"crc_errors", "", 3, true, true},
                     {"breaks", "", 0, true, true},
                     {"too_many", "", 4, true, true}};
  control_.links = {serial, {}};
  const json::value view = Parsed(Get("/api/v1/links"));
  const json::array& links = view.at("links").as_array();
  ASSERT_EQ(links.size(), 2u);
  EXPECT_EQ(links[0].at("utilisation").to_number<double>(), 0.25);
  EXPECT_EQ(
      links[0].at("counters"),
      (json::object{
          {"rounds", 7}, {"stray_bytes", 90}, {"crc_errors", 3}, {"breaks", 0}, {"too_many", 4}}));
  EXPECT_EQ(links[0].at("losses"),
            (json::object{{"stray_bytes", 90}, {"crc_errors", 3}, {"too_many", 4}}));
  EXPECT_EQ(links[0].at("errors"), 7);
  EXPECT_TRUE(links[0].at("terminal").is_null());
  EXPECT_TRUE(links[1].at("utilisation").is_null());
}

TEST_F(ApiTest, LinksTellWhyTheyAreDownAndWhatIsTriedOrHowLongTheyAreSilent) {
  control::LinkView down;
  down.state = "no such port";
  down.last_error = "no such port";
  down.failed_attempts = 4;
  down.next_attempt_s = 2.5;
  control::LinkView quiet;
  quiet.up = true;
  quiet.silent = true;
  quiet.silent_s = 61.5;
  down.terminal = "/dev/ttyUSB0";
  control_.links = {down, quiet};
  const json::value view = Parsed(Get("/api/v1/links"));
  const json::value& first = view.at("links").as_array()[0];
  EXPECT_EQ(first.at("last_error").as_string(), "no such port");
  EXPECT_EQ(first.at("terminal").as_string(), "/dev/ttyUSB0");
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

TEST_F(ApiTest, PathsAreTheCurvesThatWereConfigured) {
  control_.config.paths = {{.type = 1, .closed = true, .points = {{0, 0}, {1'500'000, -250'000}}},
                           {.type = 14, .points = {{7, 7}}}};
  const json::value view = Parsed(Get("/api/v1/paths"));
  ASSERT_EQ(view.at("paths").as_array().size(), 2u);
  const json::value& first = view.at("paths").as_array()[0];
  EXPECT_EQ(first.at("pheromone").as_string(), control_.config.FindLaw(1)->name);
  EXPECT_TRUE(first.at("closed").as_bool());
  EXPECT_EQ(first.at("points_m").as_array()[1].as_array()[0].to_number<double>(), 1.5);
  EXPECT_EQ(first.at("points_m").as_array()[1].as_array()[1].to_number<double>(), -0.25);
  EXPECT_TRUE(view.at("paths").as_array()[1].at("pheromone").is_null());  // there is no type 14
}

TEST_F(ApiTest, ClientsTellWhatIsKnownOfThem) {
  control::ClientView client;
  client.link = "radio-a";
  client.id = 7;
  client.known = true;
  client.silent_ms = 2500;
  client.pose_source = control::PoseSource::kTracker;
  client.pose = {{1'500'000, -250'000}, 16384};
  client.follows = "path";
  client.robot.hello.nonce = 9;
  client.robot.hello.round_period = 10;
  client.robot.last_event = protocol::EventReport{7, 1, protocol::EventCode::kObstacle, -3};
  client.robot.command.outcome = engine::CommandOutcome::kRefused;
  client.robot.command.command.code = protocol::CommandCode::kSpeed;
  client.robot.command.result = 11;
  control_.clients = {client, {}};
  const json::value view = Parsed(Get("/api/v1/clients"));
  const json::value& first = view.at("clients").as_array()[0];
  EXPECT_EQ(first.at("silent_s").to_number<double>(), 2.5);
  EXPECT_EQ(first.at("follows").as_string(), "path");
  EXPECT_TRUE(view.at("clients").as_array()[1].at("follows").is_null());
  EXPECT_EQ(first.at("pose").at("x_m").to_number<double>(), 1.5);
  EXPECT_EQ(first.at("pose").at("heading_deg").to_number<double>(), 90);
  EXPECT_EQ(first.at("pose").at("source").as_string(), "tracker");
  EXPECT_EQ(first.at("round_period_ms").as_int64(), 200);
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
