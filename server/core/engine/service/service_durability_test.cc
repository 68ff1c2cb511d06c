// Answers are sent once their changes are durable, and the number that waits is bounded.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/core/engine/testing/service_bench.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;
using testing::Deposit;
using testing::Hello;
using testing::Sense;
using testing::ServiceTest;

std::vector<uint64_t> SequencesOf(const std::vector<Outgoing>& out) {
  std::vector<uint64_t> sequences;
  for (const Outgoing& it : out) {
    sequences.push_back(it.durable_at);
  }
  return sequences;
}

TEST_F(ServiceTest, AnswersToChangesWaitUntilTheChangeIsDurable) {
  log_.SetDurable(1);
  EXPECT_TRUE(Handle({Hello(1, 1)}).empty());
  EXPECT_EQ(Handle({Sense(1)}).size(), 1u);  // SENSE depends on no change
  EXPECT_TRUE(Handle({Hello(2, 1)}).empty());
  EXPECT_TRUE(Release().empty());
  log_.SetDurable(2);
  auto out = Release();
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].message.opcode, protocol::kHelloAnswer);
  EXPECT_EQ(out[0].message.id, 1);
  log_.SetDurable(3);
  out = Release();
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].message.id, 2);
  EXPECT_TRUE(Release().empty());
}

TEST_F(ServiceTest, AnAckThatTheLogRefusesLeavesTheRobotsWaitingAnswer) {
  std::vector<Outgoing> out;
  Handle({Hello(1, 1)});
  ASSERT_TRUE(service_.Issue({0, 1, protocol::CommandCode::kHalt, {}}, &out).ok());
  ASSERT_EQ(out.size(), 1u);
  const uint64_t durable = service_.Inspect([](const Engine& it) { return it.sequence(); });
  log_.SetDurable(durable);
  Handle({Deposit(1, 1)});
  ASSERT_EQ(service_.held_answers(), 1u);
  log_.admit = Reason::kBusy;
  const auto refused = Handle({testing::MessageOf(
      protocol::CommandAck{1, out[0].message.data[0], protocol::CommandCode::kHalt, 0})});
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(testing::ReasonOf(refused[0].message), Reason::kBusy);
  EXPECT_EQ(service_.held_answers(), 1u);
}

TEST_F(ServiceTest, WaitingAnswersGoOutInTheOrderInWhichTheyWereGiven) {
  log_.SetDurable(1);
  Handle({Hello(1, 1), Hello(2, 1), Hello(3, 1)});
  Handle({Deposit(1, 1), Hello(4, 1)});  // robot 1 abandons its HELLO
  Handle({Deposit(1, 1)});
  EXPECT_EQ(service_.held_answers(), 4u);
  log_.SetDurable(3);
  EXPECT_EQ(SequencesOf(Release()), (std::vector<uint64_t>{3}));
  log_.SetDurable(6);
  EXPECT_EQ(SequencesOf(Release()), (std::vector<uint64_t>{4, 5, 6}));
}

TEST_F(ServiceTest, AnAnswerToAnOlderChangeGoesOutWithWhatWasGivenBeforeIt) {
  log_.SetDurable(1);
  Handle({Hello(1, 1), Deposit(1, 1), Hello(2, 1), Hello(1, 1), Deposit(1, 1)});
  log_.SetDurable(3);
  EXPECT_TRUE(Release().empty());
  log_.SetDurable(4);
  EXPECT_EQ(SequencesOf(Release()), (std::vector<uint64_t>{4, 3}));
}

// The answers given, and those reported as dropped.
class CountingWitness final : public Observer {
 public:
  void OnBatch(const Stamp&, LinkIndex, std::span<const protocol::Message>,
               std::span<const Outcome> outcomes, std::span<const Outgoing> sent) override {
    given += sent.size();
    refused = outcomes.back().refused;
  }
  void OnEvent(uint64_t, const Stamp&, const Event&, std::span<const Outgoing> sent) override {
    given += sent.size();
  }
  void OnDropped(LinkIndex, const protocol::Message&, bool repeated) override {
    ++(repeated ? joined : dropped);
  }

  size_t given = 0;
  size_t joined = 0;
  size_t dropped = 0;
  Reason refused = Reason::kNone;
};

TEST_F(ServiceTest, ManyWhoRepeatARequestAgainstAStuckLogShareOneAnswerARobot) {
  constexpr uint8_t kRobots = 200;
  constexpr uint32_t kRepeats = 100'000;
  CountingWitness observer;
  for (uint8_t id = 1; id <= kRobots; ++id) {
    Handle({Hello(id, 1)});
  }
  service_.Attach(&observer, [](const Engine&) {});
  log_.GetStuck();
  std::array<uint32_t, kRobots + 1> last{};
  std::vector<Outgoing> out;
  for (uint32_t i = 0; i < kRobots + kRepeats; ++i) {
    const auto id = static_cast<uint8_t>(1 + i % kRobots);
    const protocol::Message message = Deposit(id, 9);
    Asker asker;
    asker.asked_ns = 1'000 + i;
    asker.connection = last[id] = i + 1;
    service_.Handle(0, {&message, 1}, &out, {&asker, 1});
    ASSERT_LE(service_.held_answers(), kRobots);
  }
  EXPECT_TRUE(out.empty());
  EXPECT_EQ(log_.events.size(), 1u + 2u * kRobots);
  log_.Heal();
  out = Release();
  ASSERT_EQ(out.size(), kRobots);
  std::array<int, kRobots + 1> answers{};
  for (const Outgoing& it : out) {
    ++answers[it.message.id];
    EXPECT_EQ(it.asker.connection, last[it.message.id]);
    EXPECT_EQ(it.asker.asked_ns, 999 + it.asker.connection);
  }
  EXPECT_TRUE(std::all_of(answers.begin() + 1, answers.end(), [](int n) { return n == 1; }));
  EXPECT_TRUE(Release().empty());
  EXPECT_EQ(service_.held_answers(), 0u);
  EXPECT_EQ(observer.given, kRobots + kRepeats);
  EXPECT_EQ(observer.joined, kRepeats);
  EXPECT_EQ(observer.dropped, 0u);
}

// Busy: the robot repeats it byte for byte. "Read-only" would mean that nothing was changed.
TEST_F(ServiceTest, ARepeatOfWhatIsNotDurableIsBusyWhileTheLogTakesNothing) {
  CountingWitness observer;
  service_.Attach(&observer, [](const Engine&) {});
  Handle({Hello(1, 1)});
  log_.GetStuck();
  EXPECT_TRUE(Handle({Deposit(1, 9)}).empty());
  for (const Reason reason : {Reason::kReadOnly, Reason::kBusy}) {
    log_.admit = reason;
    const auto out = Handle({Deposit(1, 9)});
    ASSERT_EQ(out.size(), 1u);
    EXPECT_EQ(testing::ReasonOf(out[0].message), Reason::kBusy);
    EXPECT_EQ(observer.refused, Reason::kBusy);
    EXPECT_EQ(service_.held_answers(), 0u) << "it has been answered";
  }
  EXPECT_EQ(observer.dropped, 1u);
  EXPECT_EQ(service_.counters().errors[static_cast<size_t>(Reason::kBusy)], 2u);
  log_.Heal();
  EXPECT_TRUE(Release().empty());
  EXPECT_EQ(Handle({Deposit(1, 9)})[0].message.opcode, 0xA1) << "durable: the log is not needed";
  EXPECT_EQ(log_.events.size(), 3u) << "it happened once";
}

TEST_F(ServiceTest, ARequestThatIsAnsweredAtOnceEndsTheWaitForTheOneBefore) {
  Handle({Hello(1, 1)});
  log_.GetStuck();
  Handle({Deposit(1, 9)});
  log_.admit = Reason::kReadOnly;
  EXPECT_EQ(Handle({Deposit(1, 10)}).size(), 1u);
  EXPECT_EQ(service_.held_answers(), 0u);
  Handle({Sense(1)});
  log_.admit = Reason::kNone;
  Handle({Deposit(1, 10)});
  EXPECT_EQ(Handle({Sense(1)}).size(), 1u);
  EXPECT_EQ(service_.held_answers(), 1u) << "one that changes nothing leaves it";
}

TEST_F(ServiceTest, CommandsThatWaitForAStuckLogAreBounded) {
  log_.GetStuck();
  CommandIssued halt;
  halt.id = protocol::kBroadcastId;
  std::vector<Outgoing> out;
  size_t issued = 0;
  while (service_.Issue(halt, &out).ok()) {
    ASSERT_LE(++issued, Service::kMaxHeldCommands);
  }
  EXPECT_EQ(issued, Service::kMaxHeldCommands);
  EXPECT_EQ(service_.Issue(halt, &out).error(), "1024 commands are waiting for the log");
  log_.Heal();
  EXPECT_EQ(Release().size(), issued);
  EXPECT_TRUE(service_.Issue(halt, &out).ok());
}

}  // namespace
}  // namespace pheromone::engine
