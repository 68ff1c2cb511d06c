// The shipped bench, executed: robots that do anything at any time, against a model of the bench
// that knows nothing of nets, and against the rule of firing.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "server/core/petri/live_net.h"
#include "server/core/petri/net.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::nets {
namespace {

using petri::Advice;
using petri::LiveAction;
using petri::LiveNet;
using petri::LiveOutcome;

petri::LiveSettings Settings(std::string_view file, int robots) {
  Result<petri::Net> net =
      LoadSystem(std::filesystem::path(PHEROMONE_SOURCE_DIR) / "deploy/examples/nets" / file,
                 {{"robots", robots}});
  EXPECT_TRUE(net.ok()) << net.error();
  petri::LiveSettings settings{.name = "bench", .net = std::move(net).value()};
  for (const std::string& tag : petri::LiveTagsOf(settings.net)) {
    settings.tags.push_back({tag, tag});
  }
  settings.law = petri::EvaporationLaw::kE3;
  settings.rate_milli = 2'000;
  settings.dead_band_milli = 3'000;
  return settings;
}

// The bench as the README of deploy/examples/nets describes it.
class Bench {
 public:
  Bench(int robots, bool explores) : explores_(explores) { lanes_["N1"] = robots; }

  bool Do(const std::string& tag, int robot, LiveAction action, int amount, uint64_t now_ms) {
    const bool is_entrance =
        tag == "N1" || tag == "N2" || tag == "N3" || tag == "S1" || tag == "S2";
    std::string& area = tag[0] == 'S' ? at_source_ : at_p_;
    switch (action) {
      case LiveAction::kPresent:
        if (!is_entrance || lanes_[tag] == 0 || waits_[tag] != 0) {
          return false;
        }
        --lanes_[tag];
        waits_[tag] = robot;
        return true;
      case LiveAction::kPass:
        if (!is_entrance || waits_[tag] != robot || green_[tag[0]] != tag) {
          return false;
        }
        waits_[tag] = 0;
        green_[tag[0]].clear();
        area = tag;
        return true;
      case LiveAction::kChooseA:
      case LiveAction::kChooseB: {
        const bool is_a = action == LiveAction::kChooseA;
        if (tag != "P" || at_p_ != "N1" ||
            (!explores_ && advice_ == (is_a ? Advice::kB : Advice::kA))) {
          return false;
        }
        at_p_ = is_a ? "N5" : "N6";
        return true;
      }
      case LiveAction::kStoreA:
      case LiveAction::kStoreB: {
        const bool is_a = action == LiveAction::kStoreA;
        if (tag != "P" || at_p_ != (is_a ? "N2" : "N3")) {
          return false;
        }
        at_p_ = "N4";
        Trail& trail = is_a ? a_ : b_;
        trail = {At(trail, now_ms) + 1000 * amount, now_ms};
        return true;
      }
      case LiveAction::kTake:
        if (tag != "Src" || (at_source_ != "S1" && at_source_ != "S2")) {
          return false;
        }
        at_source_ = at_source_ == "S1" ? "S3" : "S4";
        return true;
      case LiveAction::kLeave:
        if (is_entrance || tag == "P" || tag == "Src" || area != tag) {
          return false;
        }
        ++lanes_[std::map<std::string, std::string>{
            {"N4", "N1"}, {"N5", "S1"}, {"N6", "S2"}, {"S3", "N2"}, {"S4", "N3"}}[tag]];
        area.clear();
        return true;
    }
    return false;
  }

  void Settle(uint64_t now_ms) {
    if (at_p_.empty() && green_['N'].empty()) {
      for (const char* const first : {"N2", "N3", "N1"}) {
        if (green_['N'].empty() && waits_[first] != 0) {
          green_['N'] = first;
        }
      }
    }
    if (at_source_.empty() && green_['S'].empty()) {
      const std::string other = turn_ == "S1" ? "S2" : "S1";
      if (waits_[turn_] != 0) {
        green_['S'] = turn_;
        turn_ = other;
      } else if (waits_[other] != 0) {
        green_['S'] = other;
      }
    }
    const int64_t difference = At(a_, now_ms) - At(b_, now_ms);
    advice_ = difference > 3'000 ? Advice::kA : difference < -3'000 ? Advice::kB : Advice::kAny;
  }

  int GreenFor(const std::string& tag) { return green_[tag[0]] == tag ? waits_[tag] : 0; }
  Advice advice() const { return advice_; }

 private:
  struct Trail {
    int64_t stored = 0;
    uint64_t since_ms = 0;
  };
  static int64_t At(const Trail& trail, uint64_t now_ms) {
    return std::max<int64_t>(0, trail.stored - 2 * static_cast<int64_t>(now_ms - trail.since_ms));
  }

  bool explores_;
  std::map<std::string, int> lanes_;   // by the tag at their end
  std::map<std::string, int> waits_;   // which robot
  std::map<char, std::string> green_;  // by area: at which entrance
  std::string at_p_;                   // the tag by which the robot inside came, or will leave
  std::string at_source_;
  std::string turn_ = "S1";
  Advice advice_ = Advice::kAny;
  Trail a_;
  Trail b_;
};

void RunAnything(std::string_view file, bool explores, uint64_t seed) {
  constexpr int kRobots = 4;
  std::mt19937_64 random(seed);
  const petri::LiveSettings settings = Settings(file, kRobots);
  auto rules = petri::MakeLiveRules(settings);
  ASSERT_TRUE(rules.ok()) << rules.error();
  LiveNet net(rules.value());
  Bench bench(kRobots, explores);
  petri::Marking marking = petri::InitialMarking(settings.net);
  const auto tokens = [&](std::string_view id) {
    const size_t place = petri::PlaceOf(settings.net, id);
    EXPECT_LT(place, settings.net.places.size()) << id;
    return marking[static_cast<Eigen::Index>(place)];
  };
  std::vector<petri::Firing> fired;
  const auto check = [&] {
    for (const petri::Firing& it : fired) {
      ASSERT_TRUE(petri::IsEnabled(settings.net, it.transition, marking));
      marking = petri::Fire(settings.net, it.transition, marking);
      ASSERT_LE(tokens("leaves") + tokens("to_A") + tokens("to_B") + tokens("returns_A") +
                    tokens("returns_B") + tokens("to_nest"),
                1);
      ASSERT_LE(tokens("Src.before_A") + tokens("Src.after_A") + tokens("Src.before_B") +
                    tokens("Src.after_B"),
                1);
      ASSERT_EQ(tokens("adv00") + tokens("adv01") + tokens("adv10"), 1);
    }
    ASSERT_EQ(net.marking(), std::vector<int32_t>(marking.begin(), marking.end()));
    fired.clear();
  };
  std::map<LiveAction, int> accepted;
  uint64_t now_ms = 0;
  std::map<int32_t, uint8_t> seqs;
  for (int step = 0; step < 200'000; ++step) {
    now_ms += 1 + random() % 400;
    const size_t tag = random() % settings.tags.size();
    const auto robot = static_cast<int32_t>(1 + random() % kRobots);
    const petri::RobotSays says{
        .robot = robot,
        .seq = ++seqs[robot],
        .action = static_cast<LiveAction>(1 + random() % static_cast<int>(petri::kLastLiveAction)),
        .amount = static_cast<uint16_t>(1 + random() % 20)};
    const bool expected =
        bench.Do(settings.tags[tag].in_net, says.robot, says.action, says.amount, now_ms);
    ASSERT_EQ(net.Take(tag, says, now_ms, &fired) == LiveOutcome::kAccepted, expected)
        << settings.tags[tag].in_net << " " << petri::NameOf(says.action);
    accepted[says.action] += expected;
    check();
    net.Settle(now_ms, &fired);
    bench.Settle(now_ms);
    check();
    for (size_t i = 0; i < settings.tags.size(); ++i) {
      const std::string& name = settings.tags[i].in_net;
      const petri::LiveSigns signs = net.SignsAt(i);
      ASSERT_EQ(signs.green ? signs.ack.robot : 0, bench.GreenFor(name)) << name;
      ASSERT_EQ(signs.advice, name == "P" ? bench.advice() : Advice::kAny);
    }
    const auto next = net.NextChange(now_ms);
    ASSERT_TRUE(!next || *next > now_ms);
  }
  for (int action = 1; action <= static_cast<int>(petri::kLastLiveAction); ++action) {
    EXPECT_GT(accepted[static_cast<LiveAction>(action)], 30) << action;
  }
  EXPECT_EQ(net.counts().records, 200'000u);
}

TEST(LiveBench, DoesWhatTheModelDoesWhateverRobotsDo) {
  RunAnything("pheromone.toml", false, 1);
  RunAnything("pheromone.toml", false, 2);
}

TEST(LiveBench, LetsRobotsExplore) {
  RunAnything("pheromone_exploring.toml", true, 3);
}

TEST(LiveBench, TheBenchWithoutPheromoneIsExecutedToo) {
  const petri::LiveSettings settings = Settings("motion.toml", 2);
  EXPECT_TRUE(petri::MakeLiveRules(settings).ok());
  EXPECT_EQ(settings.tags.size(), 12u);
}

}  // namespace
}  // namespace pheromone::nets
