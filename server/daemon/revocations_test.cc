// Which keys are revoked when an operator names a robot, and what is left of them.

#include "server/daemon/revocations.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "server/daemon/testing/live_control_bench.h"
#include "server/robots/signing/fingerprint.h"

namespace pheromone::daemon {
namespace {

using engine::RevokedKey;
using signing::FingerprintOf;
using signing::Key;
using testing::LiveControlTest;
using testing::Outcome;
using Names = std::vector<std::string>;
using Robots = std::vector<uint8_t>;

constexpr Key kOne{1};
constexpr Key kTwo{2};
constexpr Key kThree{3};

RevokedKey Named(uint8_t robot, const Key& key) {
  return {robot, FingerprintOf(key)};
}

// Two links share a file; on a third one, robot 8 is another robot.
const LinkKeys kKeys = {
    {"a", {{7, kOne}, {8, kTwo}}}, {"b", {{7, kOne}, {8, kTwo}}}, {"c", {{8, kThree}}}};

TEST(FindKeys, FindsAllKeysOfARobotOnceEach) {
  const auto seven = FindKeys(kKeys, Robots{7});
  ASSERT_TRUE(seven.ok());
  EXPECT_EQ(seven.value().keys, (std::vector{Named(7, kOne)}));
  EXPECT_EQ(seven.value().links, (Names{"a", "b"}));
  const auto all = FindKeys(kKeys, Robots{8, 7, 8});
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all.value().keys.size(), 3u);
  EXPECT_EQ(all.value().links, (Names{"a", "b", "c"}));
}

TEST(FindKeys, ARobotWithoutAKeyIsAnErrorThatNamesThoseWithOne) {
  EXPECT_EQ(FindKeys(kKeys, Robots{7, 9}).ErrorOr(""),
            "no link has a key of robot 9, expected one of 7, 8; a key in a file only: "
            "pheromonectl keys revoke 9 --file FILE");
  EXPECT_EQ(FindKeys({{"a", {}}}, Robots{9}).ErrorOr(""),
            "no link has a key of robot 9, and no link has keys, expected security = \"require\" "
            "in [[link]]; a key in a file only: pheromonectl keys revoke 9 --file FILE");
}

TEST(Sift, TakesOutTheKeyThatIsRevokedAndNoOtherOfItsRobot) {
  engine::RevokedKeys revoked;
  revoked.Add({Named(7, kOne), Named(8, kThree), Named(9, kTwo)});
  const SiftedKeys a = Sift(kKeys.at("a"), revoked);
  EXPECT_EQ(a.valid, (signing::Keys{{8, kTwo}}));
  EXPECT_EQ(a.revoked, Robots{7});
  const SiftedKeys c = Sift(kKeys.at("c"), revoked);
  EXPECT_EQ(c.valid, signing::Keys());
  EXPECT_EQ(c.revoked, Robots{8});
  const SiftedKeys rotated = Sift({{7, kTwo}}, revoked);
  EXPECT_EQ(rotated.valid, (signing::Keys{{7, kTwo}}));
  EXPECT_EQ(rotated.revoked, Robots());
}

class RevokeKeysTest : public LiveControlTest {
 protected:
  RevokeKeysTest() { keys_ = {{"radio-a", {{7, kOne}, {8, kTwo}}}, {"radio-b", {{8, kThree}}}}; }

  std::vector<RevokedKey> Revoked() const {
    return service_.Inspect([](const engine::Engine& it) { return it.revoked_keys().keys(); });
  }
};

TEST_F(RevokeKeysTest, IsAChangeInTheLogThatTheLinksAreToldOf) {
  Outcome<Names> revoked;
  control_.RevokeKeys(Robots{7}, revoked.Taker());
  ASSERT_TRUE(revoked.Get().ok());
  EXPECT_EQ(revoked.Get().value(), Names{"radio-a"});
  EXPECT_EQ(Revoked(), (std::vector{Named(7, kOne)}));
  EXPECT_EQ(drops_, 1);
  const auto views = control_.GetLinks();
  EXPECT_EQ(views[0].revoked, Robots{7});
  EXPECT_EQ(views[1].revoked, Robots());
}

TEST_F(RevokeKeysTest, ChangesNothingForARobotWithoutAKey) {
  Outcome<Names> revoked;
  control_.RevokeKeys(Robots{7, 9}, revoked.Taker());
  EXPECT_FALSE(revoked.Get().ok());
  EXPECT_TRUE(Revoked().empty());
  EXPECT_EQ(drops_, 0);
}

TEST_F(RevokeKeysTest, ALogThatRefusesChangesRevokesNothing) {
  log_.admit = protocol::Reason::kReadOnly;
  Outcome<Names> revoked;
  control_.RevokeKeys(Robots{7}, revoked.Taker());
  EXPECT_FALSE(revoked.Get().ok());
  EXPECT_TRUE(Revoked().empty());
  EXPECT_EQ(drops_, 0);
}

// Another server of a cluster has been asked: its links' names do not matter here.
TEST_F(RevokeKeysTest, AFingerprintFromAnotherServerIsRevokedAsItIs) {
  std::vector<cluster::OperatorResult> results;
  control_.Accept({3, engine::KeysRevoked{{Named(200, kThree)}}},
                  [&](cluster::OperatorResult result) { results.push_back(std::move(result)); });
  ASSERT_EQ(results.size(), 1u);
  EXPECT_TRUE(results[0].ok);
  EXPECT_EQ(results[0].number, 3u);
  EXPECT_EQ(Revoked(), (std::vector{Named(200, kThree)}));
  EXPECT_EQ(drops_, 1);
}

TEST_F(RevokeKeysTest, WhereAnotherServerOrdersTheChangesItGetsTheFingerprint) {
  LiveParts parts = Parts(std::chrono::hours(1));
  std::vector<cluster::OperatorChange> forwarded;
  parts.cluster.emplace();
  parts.cluster->forward = [&](cluster::OperatorChange change,
                               const std::function<void(cluster::OperatorResult)>& done) {
    forwarded.push_back(std::move(change));
    done({.ok = true});
    return true;
  };
  LiveControl follower(parts);
  Outcome<Names> revoked;
  follower.RevokeKeys(Robots{8}, revoked.Taker());
  ASSERT_TRUE(revoked.Get().ok());
  EXPECT_EQ(revoked.Get().value(), (Names{"radio-a", "radio-b"}));
  ASSERT_EQ(forwarded.size(), 1u);
  auto keys = std::get<engine::KeysRevoked>(forwarded[0].change).keys;
  std::sort(keys.begin(), keys.end());
  std::vector expected{Named(8, kTwo), Named(8, kThree)};
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(keys, expected);
  EXPECT_TRUE(Revoked().empty()) << "it follows";
}

}  // namespace
}  // namespace pheromone::daemon
