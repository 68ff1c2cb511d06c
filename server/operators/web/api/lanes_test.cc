// What waits for which lane, and what waits for none.

#include "server/operators/web/lanes.h"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/operators/web/api/api.h"
#include "server/operators/web/testing/api_fixture.h"

namespace pheromone::web {
namespace {

using testing::kToken;

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

}  // namespace
}  // namespace pheromone::web
