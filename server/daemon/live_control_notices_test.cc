// Whoever has subscribed is told what becomes of links, recording, log and configuration: once
// each.

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "server/base/testing/temporary_folder.h"
#include "server/daemon/testing/live_control_bench.h"

namespace pheromone::daemon {
namespace {

using control::Notice;
using testing::LiveControlTest;
using testing::Outcome;

class LiveNoticesTest : public LiveControlTest {
 protected:
  // "topic on subject: text" of each that has come.
  std::vector<std::string> Told() {
    std::vector<std::string> told;
    const control::Subscription::Taken taken = listener_->Take();
    EXPECT_EQ(taken.dropped, 0u);
    for (const Notice& it : taken.notices) {
      const char* const topics[] = {"configuration", "capture", "link", "health", "arrival"};
      told.push_back(std::string(topics[static_cast<size_t>(it.topic)]) +
                     (it.is_on ? " on " : " off ") + it.subject + ": " + it.text);
    }
    return told;
  }

  using All = std::vector<std::string>;

  std::unique_ptr<control::Subscription> listener_ = control_.Subscribe({});
};

TEST_F(LiveNoticesTest, ARobotAtItsGoalIsToldWithLinkAndPlace) {
  const engine::GoalEnded arrival{1, 3, true, {2'500'000, -1'250'000}};
  EXPECT_EQ(control_.TellArrival(arrival), "robot 3 on link radio-b arrived at (2.5, -1.25) m");
  EXPECT_EQ(Told(), All{"arrival on radio-b 3: arrived at (2.5, -1.25) m"});
}

TEST_F(LiveNoticesTest, LinksTellWhenTheyComeUpGoDownAndFailAgain) {
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{});  // they have not been up
  ASSERT_TRUE(fakes_[0]->Start().ok());
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{"link on radio-a: somewhere"});
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{});
  fakes_[0]->Stop();
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{"link off radio-a: unplugged"});
  fakes_[0]->Fail(std::chrono::seconds(5));
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{"link off radio-a: not there"});
  ASSERT_TRUE(fakes_[1]->Start().ok());
  ASSERT_TRUE(fakes_[0]->Start().ok());
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), (All{"link on radio-a: somewhere", "link on radio-b: somewhere"}));
  fakes_[1]->Stop();  // and up again, before anybody looks
  ASSERT_TRUE(fakes_[1]->Start().ok());
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{"link on radio-b: somewhere"});
}

TEST_F(LiveNoticesTest, LinksThatAreUpAtTheFirstLookAreTold) {
  ASSERT_TRUE(fakes_[1]->Start().ok());
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{"link on radio-b: somewhere"});
}

TEST_F(LiveNoticesTest, TheLogTellsOfTroubleAndOfItsEnd) {
  log_.trouble = "the disk does not answer";
  control_.TellWhatChanged();
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{"health off : the disk does not answer"});
  log_.trouble = "the disk is full";
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{"health off : the disk is full"});
  log_.trouble.clear();
  control_.TellWhatChanged();
  control_.TellWhatChanged();
  EXPECT_EQ(Told(), All{"health on : "});
}

TEST_F(LiveNoticesTest, AConfigurationThatIsInEffectIsTold) {
  control_.TellConfigured();
  EXPECT_EQ(Told(), All{"configuration on : "});
}

TEST_F(LiveNoticesTest, ARecordingIsToldWhenItBeginsAndEndsHoweverThatCame) {
  const TemporaryFolder folder;
  config_.capture.folder = folder.string();
  {
    Captures captures(&service_, config_);
    LiveParts parts = Parts(std::chrono::hours(1));
    parts.captures = &captures;
    LiveControl control(parts);
    listener_ = control.Subscribe({});
    Outcome<> started;
    control.StartCapture(started.Taker());
    EXPECT_EQ(Told(), All{"capture on : "});  // at once
    EXPECT_TRUE(started.Get().ok());
    Outcome<> again;
    control.StartCapture(again.Taker());
    EXPECT_FALSE(again.Get().ok());
    control.TellWhatChanged();
    EXPECT_EQ(Told(), All{});
    ASSERT_TRUE(captures.Stop().ok());  // not by this control
    control.TellWhatChanged();
    EXPECT_EQ(Told(), All{"capture off : "});
  }
}

}  // namespace
}  // namespace pheromone::daemon
