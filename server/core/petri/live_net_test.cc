#include "server/core/petri/live_net.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "server/base/bytes.h"
#include "server/core/petri/testing/live_gate.h"

namespace pheromone::petri {
namespace {

using ::testing::HasSubstr;

constexpr size_t kN = 0;
constexpr size_t kX = 1;
constexpr size_t kP = 2;
constexpr auto kAccepted = LiveOutcome::kAccepted;
constexpr auto kRefused = LiveOutcome::kRefused;

class LiveNetTest : public ::testing::Test {
 protected:
  // Fires by the rules of net.h beside those of the class.
  LiveOutcome Say(size_t tag, int32_t robot, LiveAction action, uint16_t amount = 0,
                  std::optional<uint8_t> seq = std::nullopt) {
    seq_ = seq.value_or(static_cast<uint8_t>(seq_ + 1));
    const LiveOutcome outcome = net_.Take(tag, {robot, seq_, action, amount}, now_ms_, &fired_);
    Check();
    return outcome;
  }
  void Settle() {
    net_.Settle(now_ms_, &fired_);
    Check();
  }
  void Check() {
    for (; checked_ < fired_.size(); ++checked_) {
      ASSERT_TRUE(IsEnabled(settings_.net, fired_[checked_].transition, marking_));
      marking_ = Fire(settings_.net, fired_[checked_].transition, marking_);
    }
    const std::vector<int32_t> expected(marking_.begin(), marking_.end());
    ASSERT_EQ(net_.marking(), expected);
  }
  std::string Fired() const {
    std::string names;
    for (const Firing& it : fired_) {
      names += settings_.net.transitions[it.transition].id + "/" + std::to_string(it.robot) + " ";
    }
    return names;
  }
  // Robot 7 goes inside.
  void GoInside() {
    ASSERT_EQ(Say(kN, 7, LiveAction::kPresent), kAccepted);
    Settle();
    ASSERT_EQ(Say(kN, 7, LiveAction::kPass), kAccepted);
    Settle();
    fired_.clear();
    checked_ = 0;
  }

  LiveSettings settings_ = LiveGateSettings();
  LiveNet net_{MakeLiveRules(settings_).value()};
  Marking marking_ = InitialMarking(settings_.net);
  std::vector<Firing> fired_;
  size_t checked_ = 0;
  uint8_t seq_ = 0;
  uint64_t now_ms_ = 100;
};

TEST_F(LiveNetTest, ARobotPresentsItselfWaitsForItsGreenAndPasses) {
  EXPECT_EQ(Say(kN, 7, LiveAction::kPresent), kAccepted);
  EXPECT_EQ(net_.SignsAt(kN), (LiveSigns{.ack = {7, 1, kAccepted, 0}}));
  Settle();
  EXPECT_EQ(Fired(), "arrive/7 present/7 WriteGreen/0 ") << "the silent arrival comes first";
  EXPECT_EQ(net_.SignsAt(kN), (LiveSigns{.green = true, .ack = {7, 1, kAccepted, 0}}));
  EXPECT_EQ(Say(kN, 7, LiveAction::kPass), kAccepted);
  EXPECT_EQ(net_.SignsAt(kN), (LiveSigns{.ack = {7, 2, kAccepted, 0}}));
  EXPECT_EQ(Say(kX, 7, LiveAction::kLeave), kAccepted);
  Settle();
  EXPECT_EQ(net_.counts().exceptions, 0u);
  EXPECT_EQ(net_.counts().firings, 6u);
  EXPECT_EQ(net_.last_firing_ms(), 100u);
}

TEST_F(LiveNetTest, OnlyTheRobotThatWaitsMayPass) {
  Say(kN, 7, LiveAction::kPresent);
  Settle();
  const std::vector<int32_t> before = net_.marking();
  EXPECT_EQ(Say(kN, 8, LiveAction::kPass), kRefused);
  EXPECT_EQ(net_.marking(), before);
  EXPECT_EQ(net_.exceptions().back().why, Refusal::kNoTicket);
  EXPECT_EQ(net_.SignsAt(kN), (LiveSigns{.green = true, .ack = {7, 1, kAccepted, 0}}))
      << "green is for the one that waits";
  EXPECT_EQ(Say(kN, 7, LiveAction::kPass), kAccepted);
}

TEST_F(LiveNetTest, WhatIsNotEnabledChangesNothingAndIsTold) {
  Say(kN, 7, LiveAction::kPresent);
  fired_.clear();
  checked_ = 0;
  const std::vector<int32_t> before = net_.marking();
  EXPECT_EQ(Say(kN, 8, LiveAction::kPresent), kRefused) << "the tag is not vacant";
  EXPECT_EQ(Say(kX, 9, LiveAction::kLeave), kRefused) << "nobody is inside";
  EXPECT_EQ(Say(kN, 9, LiveAction::kTake), kRefused) << "not at this tag";
  EXPECT_EQ(net_.marking(), before);
  EXPECT_EQ(Fired(), "");
  EXPECT_EQ(net_.counts().exceptions, 3u);
  EXPECT_EQ(net_.SignsAt(kX), (LiveSigns{.ack = {9, 3, kRefused, 0}}));
  EXPECT_EQ(net_.exceptions()[1],
            (LiveException{100, kX, 9, 3, static_cast<uint8_t>(LiveAction::kLeave),
                           Refusal::kNotEnabled}));
}

TEST_F(LiveNetTest, ASilentTransitionIsTakenBackIfItDoesNotHelp) {
  settings_.net.transitions[TransitionOf(settings_.net, "present")].takes.push_back(
      {static_cast<uint32_t>(PlaceOf(settings_.net, "inside"))});
  net_ = LiveNet(MakeLiveRules(settings_).value());
  EXPECT_EQ(Say(kN, 7, LiveAction::kPresent), kRefused);
  EXPECT_EQ(Fired(), "");
  EXPECT_EQ(net_.counts().firings, 0u);
}

TEST_F(LiveNetTest, ARecordThatIsRepeatedIsAnsweredAgainAndFiresNothing) {
  GoInside();
  EXPECT_EQ(Say(kP, 7, LiveAction::kTake, 9, 40), kAccepted);
  const std::vector<int32_t> before = net_.marking();
  EXPECT_EQ(Say(kP, 7, LiveAction::kTake, 9, 40), kAccepted);
  EXPECT_EQ(net_.marking(), before);
  EXPECT_EQ(net_.counts().taken, 9u);
  EXPECT_EQ(net_.counts().repeats, 1u);
  EXPECT_EQ(net_.SignsAt(kP).ack, (LiveAck{7, 40, kAccepted, 9}));
}

TEST_F(LiveNetTest, ARecordIsToldAgainAsItWasAndThoseBeforeItAreOutOfDate) {
  EXPECT_EQ(Say(kX, 7, LiveAction::kLeave, 0, 90), kRefused);
  EXPECT_EQ(Say(kX, 7, LiveAction::kLeave, 0, 90), kRefused);
  EXPECT_EQ(net_.counts().exceptions, 1u);
  GoInside();
  EXPECT_EQ(Say(kX, 7, LiveAction::kLeave, 0, 92), kAccepted) << "as the last record, its pass";
  for (const uint8_t seq : {uint8_t{91}, uint8_t{84}}) {
    const LiveAck before = net_.SignsAt(kX).ack;
    EXPECT_EQ(Say(kX, 7, LiveAction::kLeave, 0, seq), LiveOutcome::kNone);
    EXPECT_EQ(net_.SignsAt(kX).ack, before) << "nothing is told of it";
  }
  EXPECT_EQ(Fired(), "");
  EXPECT_EQ(Say(kX, 7, LiveAction::kLeave, 0, 93), kAccepted);
  EXPECT_EQ(net_.counts().repeats, 4u);
}

TEST_F(LiveNetTest, TheSourceGivesWhatItHas) {
  settings_.has_source = true;
  settings_.source = 25;
  net_ = LiveNet(MakeLiveRules(settings_).value());
  GoInside();
  const auto take = [&] {
    EXPECT_EQ(Say(kP, 7, LiveAction::kTake, 10), kAccepted);
    const LiveSigns signs = net_.SignsAt(kP);
    return std::pair(signs.ack.amount, signs.left);
  };
  EXPECT_EQ(take(), std::pair(uint16_t{10}, uint16_t{15}));
  EXPECT_EQ(take(), std::pair(uint16_t{10}, uint16_t{5}));
  EXPECT_EQ(take(), std::pair(uint16_t{5}, uint16_t{0}));
  EXPECT_EQ(take(), std::pair(uint16_t{0}, uint16_t{0}));
  EXPECT_EQ(net_.counts().taken, 25u);
}

TEST_F(LiveNetTest, ADepositCountsAndIsAdvisedUntilItHasEvaporated) {
  settings_.dead_band_milli = 2'000;
  net_ = LiveNet(MakeLiveRules(settings_).value());
  GoInside();
  EXPECT_EQ(Say(kP, 7, LiveAction::kStoreA, 10), kAccepted);
  EXPECT_EQ(net_.Advised(), Advice::kAny) << "the reader has not yet seen it";
  EXPECT_EQ(Say(kP, 7, LiveAction::kStoreB, 10), kRefused) << "nor must another one replace it";
  Settle();
  EXPECT_EQ(net_.trails().a, (Trail{10'000, 100}));
  EXPECT_EQ(net_.Advised(), Advice::kA);
  EXPECT_EQ(net_.SignsAt(kP).advice, Advice::kA);
  EXPECT_EQ(net_.SignsAt(kN).advice, Advice::kAny) << "only its tag tells it";
  EXPECT_EQ(Say(kP, 7, LiveAction::kChooseB), kRefused);
  EXPECT_EQ(Say(kP, 7, LiveAction::kChooseA), kAccepted);
  // 10 - t <= 2 after 8 s.
  EXPECT_EQ(net_.NextChange(now_ms_), 8'100u);
  now_ms_ = 8'099;
  Settle();
  EXPECT_EQ(net_.Advised(), Advice::kA);
  now_ms_ = 8'100;
  Settle();
  EXPECT_EQ(net_.Advised(), Advice::kAny);
  EXPECT_THAT(Fired(), HasSubstr("reads_A/0 deposit_adv00_01/0 read_A/7 timer_adv01_00/0 "));
  EXPECT_EQ(net_.NextChange(now_ms_), std::nullopt);
  EXPECT_EQ(net_.counts().deposits, 1u);
  EXPECT_EQ(net_.counts().deposited, 10u);
}

TEST_F(LiveNetTest, OtherRulesGoOnWithWhatThereIs) {
  GoInside();
  Say(kP, 7, LiveAction::kStoreA, 10);
  Settle();
  now_ms_ = 4'100;  // 6 are left
  settings_.law = EvaporationLaw::kE1;
  ASSERT_TRUE(net_.rules().settings.SameNet(settings_));
  const std::vector<int32_t> before = net_.marking();
  net_.Adopt(MakeLiveRules(settings_).value(), now_ms_);
  EXPECT_EQ(net_.trails().a, (Trail{6'000, 4'100}));
  EXPECT_EQ(net_.marking(), before);
  EXPECT_EQ(net_.Computed(4'100 + 18'000 - 1), Advice::kA) << "6^2 / 2 = 18 s";
  EXPECT_EQ(net_.Computed(4'100 + 18'000), Advice::kAny);
  settings_.net.places[0].tokens = 3;
  EXPECT_FALSE(net_.rules().settings.SameNet(settings_));
}

TEST_F(LiveNetTest, ItIsSavedAndRestored) {
  GoInside();
  Say(kP, 7, LiveAction::kStoreA, 10);
  Say(kX, 9, LiveAction::kTake);
  ByteWriter writer;
  net_.Save(&writer);
  ByteReader reader(writer.bytes());
  LiveNet restored(MakeLiveRules(settings_).value());
  EXPECT_NE(restored.Hash(), net_.Hash());
  restored.Restore(&reader);
  reader.ExpectEnd();
  ASSERT_TRUE(reader.ok()) << reader.error();
  EXPECT_EQ(restored.Hash(), net_.Hash());
  EXPECT_EQ(restored.SignsAt(kX), net_.SignsAt(kX));
  Settle();
  std::vector<Firing> its;
  restored.Settle(now_ms_, &its);
  EXPECT_EQ(restored.Hash(), net_.Hash());
}

TEST_F(LiveNetTest, BytesOfAnotherNetOrOfNoneAreRefused) {
  ByteWriter writer;
  net_.Save(&writer);
  settings_.net.places.push_back({.id = "more"});
  LiveNet other(MakeLiveRules(settings_).value());
  ByteReader reader(writer.bytes());
  other.Restore(&reader);
  EXPECT_EQ(reader.error(), "net \"gate\": not a state of this net");
  std::string bytes = writer.bytes();
  bytes[4] = '\xFF';
  bytes[7] = '\xFF';  // tokens of the first place
  ByteReader negative(bytes);
  LiveNet same(MakeLiveRules(LiveGateSettings()).value());
  same.Restore(&negative);
  EXPECT_FALSE(negative.ok());
}

TEST_F(LiveNetTest, ANetThatDoesNotComeToRestIsLeftAtTheBound) {
  settings_.net.transitions.push_back({.id = "spins", .owner = "environment"});
  net_ = LiveNet(MakeLiveRules(settings_).value());
  Settle();
  EXPECT_EQ(net_.counts().firings, static_cast<uint64_t>(LiveNet::kMaxFirings));
}

class LiveRulesTest : public ::testing::Test {
 protected:
  std::string ErrorOf() const {
    const auto rules = MakeLiveRules(settings_);
    return rules.ErrorOr("");
  }
  Transition& At(std::string_view id) {
    return settings_.net.transitions[TransitionOf(settings_.net, id)];
  }
  LiveSettings settings_ = LiveGateSettings();
};

TEST_F(LiveRulesTest, WhatCannotBeExecutedIsNamed) {
  At("present").owner = "";
  EXPECT_EQ(ErrorOf(),
            "net \"gate\": transition \"present\": owner: found \"\", expected robot or "
            "environment");
  settings_ = LiveGateSettings();
  At("present").does = "wave";
  EXPECT_EQ(ErrorOf(),
            "net \"gate\": transition \"present\": does: found \"wave\", expected present, pass, "
            "leave, choose A, choose B, store A, store B or take, as a robot does");
  settings_ = LiveGateSettings();
  At("release").does = "present";
  EXPECT_EQ(ErrorOf(),
            "net \"gate\": transition \"release\": does: found \"present\", expected add A, add B, "
            "or advise 00, 01 or 10 with or without anew, as the environment does");
  settings_ = LiveGateSettings();
  At("present").tag = "";
  EXPECT_EQ(ErrorOf(), "net \"gate\": transition \"present\": expected a tag");
  At("present").tag = "Q";
  EXPECT_EQ(ErrorOf(), "net \"gate\": transition \"present\": tag \"Q\" is not bound");
  settings_ = LiveGateSettings();
  settings_.net.places[0].does = "blue";
  EXPECT_EQ(ErrorOf(),
            "net \"gate\": place \"lane\": does: found \"blue\", expected green, advice 01 or "
            "advice 10");
  settings_ = LiveGateSettings();
  settings_.net.places[0].does = "green";
  settings_.net.places[0].tag = "N";
  EXPECT_EQ(ErrorOf(), "net \"gate\": place \"Green\": place \"lane\" already is \"green\"");
  settings_ = LiveGateSettings();
  settings_.tags[1].tag = "north";
  EXPECT_EQ(ErrorOf(), "net \"gate\": tag \"X\" or \"north\" is bound twice");
  settings_ = LiveGateSettings();
  for (Transition& it : settings_.net.transitions) {
    it.does = it.owner == "robot" ? "" : it.does;
  }
  EXPECT_EQ(ErrorOf(),
            "net \"gate\": no transition of a robot does anything, expected present, take or "
            "another one");
  settings_ = LiveGateSettings();
  settings_.net.places[1].id = "lane";
  EXPECT_EQ(ErrorOf(), "net \"gate\": net \"gate\": the ID \"lane\" is given twice");
  settings_ = LiveGateSettings();
  settings_.tags[0].candidates = {4, 3};
  EXPECT_EQ(ErrorOf(), "net \"gate\": tag \"N\": expected transitions in rising order, from 1 on");
}

TEST_F(LiveRulesTest, ItsTagsAreThoseThatRobotsUse) {
  EXPECT_EQ(LiveTagsOf(settings_.net), (std::vector<std::string>{"N", "X", "P"}));
}

}  // namespace
}  // namespace pheromone::petri
