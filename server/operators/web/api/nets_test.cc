#include "server/operators/web/api/nets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/core/petri/testing/live_gate.h"
#include "server/operators/web/testing/fake_control.h"

namespace pheromone::web {
namespace {

using ::testing::HasSubstr;

class NetsApiTest : public ::testing::Test {
 protected:
  NetsApiTest() {
    petri::LiveNet net(petri::MakeLiveRules(petri::LiveGateSettings()).value());
    std::vector<petri::Firing> fired;
    net.Take(0, {15, 1, petri::LiveAction::kPresent, 0}, 1'000, &fired);
    net.Settle(1'000, &fired);
    net.Take(1, {16, 7, petri::LiveAction::kLeave, 0}, 2'000, &fired);
    net.Take(0, {15, 2, petri::LiveAction::kPass, 0}, 3'000, &fired);
    net.Take(2, {15, 3, petri::LiveAction::kStoreA, 20}, 3'000, &fired);
    net.Settle(3'000, &fired);
    control_.nets = {{net, 8'500}};
  }

  std::string Get(const std::string& target) {
    return testing::AnswerOf(&api_, {.method = "GET", .target = target}).body;
  }
  std::string Post(const std::string& body) {
    return testing::AnswerOf(
               &api_, {.method = "POST", .target = "/api/v1/nets", .local = true, .body = body})
        .body;
  }

  testing::FakeControl control_;
  Api api_{&control_, {"0123456789abcdef", {"lab"}}};
};

constexpr char kSummary[] =
    R"({"name":"gate","net":"gate","places":19,"transitions":29,"robot_hash":4660,)"
    R"("period_ms":200,"law":"e3","rate":1,"dead_band":0,"advice":"01",)"
    R"("A":{"concentration":14.5,"stored":20,"since_deposit_s":5.5},)"
    R"("B":{"concentration":0,"stored":0,"since_deposit_s":null},"source":null,)"
    R"("firings":7,"since_firing_s":5.5,"records":4,"repeats":0,"exceptions":1,"deposits":1,)"
    R"("deposited":20,"taken":0,"restored":0,"blocked":0,"robots":2)";

TEST_F(NetsApiTest, NetsAreListed) {
  EXPECT_EQ(Get("/api/v1/nets"), "{\"nets\":[" + std::string(kSummary) + "}]}\n");
}

TEST_F(NetsApiTest, ANetIsToldWithItsTagsMarkingAndExceptions) {
  EXPECT_EQ(
      Get("/api/v1/nets?net=gate"),
      std::string(kSummary) +
          R"(,"tags":[{"tag":"north","in_net":"N","fires":[1],"waiting":null,"green":false,)"
          R"("last":{"robot":15,"seq":2,"outcome":"accepted","amount":0}},)"
          R"({"tag":"exit","in_net":"X","fires":[4],"waiting":null,"green":false,)"
          R"("last":{"robot":16,"seq":7,"outcome":"refused","amount":0}},)"
          R"({"tag":"pheromone","in_net":"P","fires":[2,3,7],"waiting":null,"green":false,)"
          R"("last":{"robot":15,"seq":3,"outcome":"accepted","amount":20}}],)"
          R"("marking":{"lane":1,"vacant":1,"inside":1,"ready":1,"depNone":1,"adv01":1},)"
          R"("last_exceptions":[{"ago_s":6.5,"tag":"exit","robot":16,"seq":7,"action":"leave",)"
          R"("why":"the net does not permit it"}]})"
          "\n");
  EXPECT_THAT(Get("/api/v1/nets?net=get"), HasSubstr("the name of a net"));
}

TEST_F(NetsApiTest, ANetIsReset) {
  EXPECT_EQ(Post(R"({"action":"reset","net":"gate"})"), "{\"done\":true}\n");
  ASSERT_EQ(control_.net_changes.size(), 1u);
  EXPECT_EQ(control_.net_changes[0].net, "gate");
  control_.outcome = Error{"there is no net \"get\""};
  EXPECT_THAT(Post(R"({"action":"reset","net":"get"})"), HasSubstr("there is no net"));
  EXPECT_THAT(Post(R"({"action":"start","net":"gate"})"), HasSubstr("expected"));
  EXPECT_THAT(Post(R"({"action":"reset"})"), HasSubstr("net"));
}

TEST_F(NetsApiTest, NetsAreMeasured) {
  const std::string metrics = Get("/metrics");
  EXPECT_THAT(metrics, HasSubstr("pheromone_net_firings_total{net=\"gate\"} 7\n"));
  EXPECT_THAT(metrics, HasSubstr("pheromone_net_exceptions_total{net=\"gate\"} 1\n"));
  EXPECT_THAT(metrics, HasSubstr("pheromone_net_concentration{net=\"gate\",trail=\"A\"} 14.5\n"));
  EXPECT_THAT(metrics, HasSubstr("pheromone_net_since_firing_seconds{net=\"gate\"} 5.5\n"));
}

}  // namespace
}  // namespace pheromone::web
