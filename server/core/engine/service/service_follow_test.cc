// A service that follows another one: their events come through one log.

#include <gtest/gtest.h>

#include <cstddef>
#include <span>
#include <variant>
#include <vector>

#include "server/core/engine/testing/service_bench.h"

namespace pheromone::engine {
namespace {

using protocol::Message;
using protocol::Reason;
using testing::Deposit;
using testing::Hello;
using testing::SameMessage;
using testing::ScriptedLog;
using testing::Sense;
using testing::SmallConfig;

// A leader, whose log the follower's events come from.
class FollowTest : public testing::ServiceTest {
 protected:
  FollowTest() : follower_(&follower_log_, [this] { return follower_now_; }) {
    follower_.OnChange([this](const Event& event) {
      if (has_leader_) {
        forwarded_.push_back(event);
      }
      return has_leader_;
    });
    follower_log_.admit = Reason::kBusy;
    CatchUp();
  }

  // What the follower sends for the events that are new.
  std::vector<Outgoing> CatchUp() {
    std::vector<Outgoing> out;
    for (; followed_ < log_.events.size(); ++followed_) {
      const Status followed =
          follower_.Follow(log_.events[followed_].first, log_.events[followed_].second, &out);
      EXPECT_TRUE(followed.ok()) << followed.error();
    }
    return out;
  }

  // A robot's messages to the follower; they come from that connection.
  std::vector<Outgoing> AskFollower(const std::vector<Message>& messages, uint32_t connection = 1) {
    Asker asker;
    asker.asked_ns = 1;
    asker.connection = connection;
    std::vector<Outgoing> out;
    follower_.Handle(0, messages, &out, {&asker, 1});
    return out;
  }

  // The leader gets what the follower forwarded; what it says at once.
  std::vector<Outgoing> Forward() {
    std::vector<Outgoing> out;
    Asker asker;
    asker.is_forwarded = true;
    for (const Event& event : forwarded_) {
      const auto& received = std::get<RequestReceived>(event);
      service_.Handle(received.link, {&received.message, 1}, &out, {&asker, 1});
    }
    forwarded_.clear();
    return out;
  }

  ScriptedLog follower_log_;
  ClockReading follower_now_{77'000, 1'600'000'000'000};  // another machine
  Service follower_;
  bool has_leader_ = true;
  std::vector<Event> forwarded_;
  size_t followed_ = 0;
};

TEST_F(FollowTest, TheSameEventsMakeTheSameState) {
  Handle({Hello(1, 1), Deposit(1, 1)});
  now_.boottime_ms += 5'000;
  Handle({Deposit(1, 2)});
  EXPECT_TRUE(CatchUp().empty()) << "no robot waits at the follower";
  EXPECT_EQ(follower_.StateHash(), service_.StateHash());
  ASSERT_EQ(follower_log_.events.size(), log_.events.size()) << "it keeps them in its journal";
  EXPECT_EQ(follower_log_.events.back().first.field_time_ms,
            log_.events.back().first.field_time_ms);
  EXPECT_TRUE(SameMessage(AskFollower({Sense(1)}).at(0).message, Handle({Sense(1)}).at(0).message));
}

TEST_F(FollowTest, AnEventThatIsNotPossibleHereIsAnErrorAndChangesNothing) {
  const uint64_t hash = follower_.StateHash();
  CommandIssued unknown;
  unknown.id = 9;
  std::vector<Outgoing> out;
  EXPECT_FALSE(follower_.Follow({1'000, 0}, unknown, &out).ok());
  field::FieldEdit edit;
  edit.type = 7;
  EXPECT_FALSE(follower_.Follow({1'000, 0}, FieldEdited{edit}, &out).ok());
  EXPECT_EQ(follower_.StateHash(), hash);
  EXPECT_EQ(follower_log_.events.size(), 1u) << "nor is it in the journal";
}

TEST_F(FollowTest, AChangeIsAnsweredByTheFollowerWhenItsEventComes) {
  EXPECT_TRUE(AskFollower({Hello(1, 1)}, 5).empty());
  EXPECT_EQ(follower_.counters().forwarded, 1u);
  const std::vector<Outgoing> at_leader = Forward();
  ASSERT_EQ(at_leader.size(), 1u);
  EXPECT_TRUE(at_leader[0].asker.is_forwarded);
  const std::vector<Outgoing> out = CatchUp();
  ASSERT_EQ(out.size(), 1u);
  EXPECT_TRUE(SameMessage(out[0].message, at_leader[0].message));
  EXPECT_EQ(out[0].asker.connection, 5u);
  AskFollower({Deposit(1, 1)});
  Forward();
  EXPECT_EQ(CatchUp().size(), 1u);
  const std::vector<Outgoing> again = AskFollower({Deposit(1, 1)});  // that answer was lost
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].message.opcode, 0xA1);
  EXPECT_TRUE(forwarded_.empty());
}

TEST_F(FollowTest, AQueryIsAnsweredWhileAChangeWaits) {
  AskFollower({Hello(1, 1)});
  Forward();
  CatchUp();
  const std::vector<Outgoing> out = AskFollower({Deposit(1, 1), Sense(1)});
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].message.opcode, 0x81);
}

TEST_F(FollowTest, TheLastSourceOfARepeatedChangeGetsItsAnswer) {
  AskFollower({Hello(1, 1)}, 5);
  AskFollower({Hello(1, 1)}, 6);
  Forward();
  const std::vector<Outgoing> out = CatchUp();
  ASSERT_EQ(out.size(), 1u) << "the leader has made it once";
  EXPECT_EQ(out[0].asker.connection, 6u);
}

TEST_F(FollowTest, ARefusalOfTheLeaderIsSentOnceToTheRobotThatWaits) {
  AskFollower({Hello(1, 1)}, 5);
  log_.admit = Reason::kReadOnly;
  const std::vector<Outgoing> refusal = Forward();
  ASSERT_EQ(refusal.size(), 1u);
  std::vector<Outgoing> out;
  follower_.AnswerForwarded(0, refusal[0].message, &out);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].asker.connection, 5u);
  follower_.AnswerForwarded(0, refusal[0].message, &out);
  EXPECT_EQ(out.size(), 1u);
}

TEST_F(FollowTest, WhatIsUnknownOnlyBecauseTheFollowerIsBehindIsForwarded) {
  Handle({Hello(1, 1), Deposit(1, 1)});  // the robot was at the leader a moment ago
  EXPECT_TRUE(AskFollower({Deposit(1, 2)}).empty());
  const std::vector<Outgoing> answers = Forward();
  ASSERT_EQ(answers.size(), 1u);
  EXPECT_EQ(answers[0].message.opcode, 0xA1);
  EXPECT_EQ(CatchUp().size(), 1u);
}

TEST_F(FollowTest, WithoutALeaderAChangeIsRefusedAndAQueryAnswered) {
  Handle({Hello(1, 1)});
  CatchUp();
  has_leader_ = false;
  const std::vector<Outgoing> out = AskFollower({Deposit(1, 1), Sense(1)});
  ASSERT_EQ(out.size(), 2u);
  protocol::ErrorAnswer error;
  ASSERT_TRUE(protocol::Decode(out[0].message, &error));
  EXPECT_EQ(error.reason, Reason::kBusy);
}

TEST_F(FollowTest, AnEditOfTheMapIsFollowedWithAllItsPortions) {
  field::FieldEdit edit;
  edit.type = 1;
  edit.shape = field::FieldEdit::Shape::kAll;
  edit.level = 5 * 64;
  const auto made = service_.Edit(edit);
  ASSERT_TRUE(made.ok()) << made.error();
  CatchUp();
  EXPECT_EQ(follower_.StateHash(), service_.StateHash());
  ASSERT_TRUE(service_.Reverse(false).ok());
  CatchUp();
  EXPECT_EQ(follower_.StateHash(), service_.StateHash());
}

TEST_F(FollowTest, AConfigurationThatWasFollowedIsTold) {
  int told = 0;
  follower_.OnConfigured([&] { ++told; });
  Handle({Hello(1, 1)});
  CatchUp();
  EXPECT_EQ(told, 0);
  EngineConfig config = SmallConfig();
  config.field.pheromones[0].tau_ms += 1'000;
  ASSERT_TRUE(service_.Configure(config, 7).ok());
  CatchUp();
  EXPECT_EQ(told, 1);
}

TEST_F(FollowTest, KeysThatAreRevokedAreToldWhereTheyAreOrderedAndWhereTheyAreFollowed) {
  int told = 0;
  int told_follower = 0;
  service_.OnRevoked([&] { ++told; });
  follower_.OnRevoked([&] { ++told_follower; });
  Handle({Hello(1, 1)});
  std::vector<Outgoing> out;
  ASSERT_TRUE(service_.Submit(KeysRevoked{{{1, {2}}}}, &out).ok());
  EXPECT_EQ(told, 1);
  EXPECT_EQ(told_follower, 0);
  CatchUp();
  EXPECT_EQ(told, 1);
  EXPECT_EQ(told_follower, 1);
  EXPECT_EQ(follower_.StateHash(), service_.StateHash());
}

TEST_F(FollowTest, AnArrivalThatTheFollowerSeesIsForwarded) {
  Handle({Hello(3, 1)});
  Handle({Sense(3, 1'000, 5'000)});
  ASSERT_TRUE(service_.SetGoal(0, 3, {5'000'000, 5'000'000}, 100'000).ok());
  CatchUp();
  int arrivals = 0;
  follower_.OnArrival([&](const GoalEnded&) { ++arrivals; });
  AskFollower({Sense(3, 5'000, 5'000)});
  ASSERT_EQ(forwarded_.size(), 1u);
  ASSERT_TRUE(std::holds_alternative<GoalEnded>(forwarded_[0]));
  EXPECT_EQ(arrivals, 0) << "it is not decided yet";
  std::vector<Outgoing> out;
  ASSERT_TRUE(service_.Submit(forwarded_[0], &out).ok());
  EXPECT_FALSE(service_.Submit(forwarded_[0], &out).ok()) << "seen twice";
  const std::vector<Outgoing> halts = CatchUp();
  EXPECT_EQ(arrivals, 1);
  ASSERT_EQ(halts.size(), 1u) << "the robot was heard at the follower, so it is halted from there";
  EXPECT_EQ(halts[0].message.opcode, protocol::kCommand);
}

TEST_F(FollowTest, APoseThatTheFollowerHeardIsKnownToTheLeader) {
  AskFollower({Hello(3, 1)});
  Forward();
  CatchUp();
  follower_now_.boottime_ms += 10;
  AskFollower({Sense(3, 1'000, 5'000)});
  EXPECT_FALSE(service_.SetGoal(0, 3, {5'000'000, 5'000'000}, 100'000).ok());
  service_.NotePoses(follower_.PosesSince(0));
  EXPECT_TRUE(service_.PosesSince(0).empty()) << "it was not heard there";
  EXPECT_TRUE(service_.SetGoal(0, 3, {5'000'000, 5'000'000}, 100'000).ok());
}

TEST_F(FollowTest, ACommandIsSentFromWhereTheRobotWasHeardLast) {
  CommandIssued issued;
  issued.id = 3;
  AskFollower({Hello(3, 1)});
  Forward();
  CatchUp();
  std::vector<Outgoing> out;
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  EXPECT_EQ(CatchUp().size(), 1u);
  Handle({Sense(3)});  // it has gone to the leader, which tells the follower
  follower_now_.boottime_ms += 10;
  follower_.NotePoses(std::vector<HeardPose>{{0, 3, {}, 77'000}});
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  EXPECT_TRUE(CatchUp().empty());
}

// Two observers, of leader and follower, must be able to make the same recording.
class Recorder final : public Observer {
 public:
  void OnBatch(const Stamp& /*stamp*/, LinkIndex /*link*/, std::span<const Message> messages,
               std::span<const Outcome> outcomes, std::span<const Outgoing> /*sent*/) override {
    EXPECT_EQ(messages.size(), outcomes.size());
    for (size_t i = 0; i < messages.size(); ++i) {
      if (outcomes[i].sequence != 0) {
        sequences.push_back(outcomes[i].sequence);
      } else {
        ++others;
      }
    }
  }
  void OnEvent(uint64_t sequence, const Stamp& /*stamp*/, const Event& /*event*/,
               std::span<const Outgoing> /*sent*/) override {
    sequences.push_back(sequence);
  }

  std::vector<uint64_t> sequences;
  int others = 0;
};

TEST_F(FollowTest, AnObserverOfTheFollowerSeesEachEventOnceInOrder) {
  Recorder recorder;
  follower_.Attach(&recorder, [](const Engine&) {});
  AskFollower({Hello(1, 1), Sense(1)});
  Forward();
  CatchUp();
  AskFollower({Deposit(1, 1)});
  CommandIssued issued;
  issued.id = 1;
  std::vector<Outgoing> out;
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  Forward();
  CatchUp();
  EXPECT_EQ(recorder.sequences, (std::vector<uint64_t>{2, 3, 4}));
  EXPECT_EQ(recorder.others, 1) << "the query";
  follower_.Detach(&recorder);
}

TEST_F(FollowTest, ItsFieldTimeIsTheLeadersAndGoesOnWhenItLeads) {
  now_.boottime_ms += 60'000;
  Handle({Hello(1, 1)});
  CatchUp();
  const uint64_t last_ms = log_.events.back().first.field_time_ms;
  follower_now_.boottime_ms += 250;
  follower_log_.admit = Reason::kNone;
  has_leader_ = false;  // it leads itself
  EXPECT_EQ(AskFollower({Deposit(1, 1)}).size(), 1u);
  EXPECT_EQ(follower_log_.events.back().first.field_time_ms, last_ms + 250);
}

}  // namespace
}  // namespace pheromone::engine
