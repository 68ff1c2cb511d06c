#include "server/engine/service.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <new>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "server/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;
using testing::Deposit;
using testing::Hello;
using testing::Sense;

// A log whose health and durability the test decides, and which remembers what it was given.
class ScriptedLog final : public OrderedLog {
 public:
  Reason Admit() override { return admit; }
  uint64_t Append(const Stamp& stamp, const Event& event) override {
    events.emplace_back(stamp, event);
    return events.size();
  }
  uint64_t DurableSequence() const override { return durable; }
  bool WhenDurable(uint64_t /*sequence*/, std::function<void()> done) override {
    done();
    return true;
  }
  void Probe(std::function<void()> done) override { done(); }

  bool IsRotationDue() const override { return rotation_due; }
  void Rotate(uint64_t state_hash) override {
    rotated.emplace_back(events.size(), state_hash);
    rotation_due = false;
  }

  Reason admit = Reason::kNone;
  bool rotation_due = false;
  std::vector<std::pair<size_t, uint64_t>> rotated;  // after so many events; the hash
  uint64_t durable = UINT64_MAX;
  std::vector<std::pair<Stamp, Event>> events;
};

// Keeps what it is told.
class Listener final : public Witness {
 public:
  struct Batch {
    Stamp stamp;
    LinkIndex link = 0;
    std::vector<protocol::Message> messages;
    std::vector<Outcome> outcomes;
    std::vector<Outgoing> sent;
  };
  struct Other {
    uint64_t sequence = 0;
    Stamp stamp;
    Event event;
    std::vector<Outgoing> sent;
  };

  void OnBatch(const Stamp& stamp, LinkIndex link, std::span<const protocol::Message> messages,
               std::span<const Outcome> outcomes, std::span<const Outgoing> sent) override {
    batches.push_back({stamp,
                       link,
                       {messages.begin(), messages.end()},
                       {outcomes.begin(), outcomes.end()},
                       {sent.begin(), sent.end()}});
  }
  void OnEvent(uint64_t sequence, const Stamp& stamp, const Event& event,
               std::span<const Outgoing> sent) override {
    events.push_back({sequence, stamp, event, {sent.begin(), sent.end()}});
  }

  std::vector<Batch> batches;
  std::vector<Other> events;
};

class ServiceTest : public ::testing::Test {
 protected:
  ServiceTest() : service_(&log_, [this] { return now_; }) {
    EXPECT_TRUE(service_.Configure(testing::SmallConfig(), 7).ok());
  }

  std::vector<Outgoing> Handle(std::vector<protocol::Message> messages) {
    std::vector<Outgoing> out;
    service_.Handle(0, messages, &out);
    return out;
  }

  std::vector<Outgoing> Release() {
    std::vector<Outgoing> out;
    service_.Release(&out);
    return out;
  }

  static std::vector<uint64_t> SequencesOf(const std::vector<Outgoing>& out) {
    std::vector<uint64_t> sequences;
    for (const Outgoing& it : out) {
      sequences.push_back(it.durable_at);
    }
    return sequences;
  }

  ScriptedLog log_;
  ClockReading now_{1'000, 1'700'000'000'000};
  Service service_;
};

TEST_F(ServiceTest, ABatchIsAnsweredInOrderUnderOneStamp) {
  const auto out = Handle({Hello(1, 1), Deposit(1, 1), Sense(1), Deposit(1, 2)});
  ASSERT_EQ(out.size(), 4u);
  EXPECT_EQ(out[0].message.opcode, protocol::kHelloAnswer);
  EXPECT_EQ(out[2].message.opcode, 0x81);
  ASSERT_EQ(log_.events.size(), 4u);  // the configuration and three changes; SENSE is none
  EXPECT_EQ(log_.events[1].first.field_time_ms, log_.events[3].first.field_time_ms);
  EXPECT_EQ(log_.events[1].first.utc_ms, 1'700'000'000'000);
}

TEST_F(ServiceTest, ALogThatTakesNothingRefusesChangesAndLetsSensesPass) {
  Handle({Hello(1, 1)});
  const uint64_t hash = service_.StateHash();
  for (const Reason reason : {Reason::kReadOnly, Reason::kBusy}) {
    log_.admit = reason;
    const auto out = Handle({Deposit(1, 9), Sense(1)});
    ASSERT_EQ(out.size(), 2u);
    protocol::ErrorAnswer error;
    ASSERT_TRUE(protocol::Decode(out[0].message, &error));
    EXPECT_EQ(error.reason, reason);
    EXPECT_EQ(error.seq, 9);
    EXPECT_EQ(out[1].message.opcode, 0x81);
  }
  EXPECT_EQ(service_.StateHash(), hash);
  log_.admit = Reason::kNone;  // these refusals were not stored: the retry succeeds
  EXPECT_EQ(Handle({Deposit(1, 9)})[0].message.opcode, 0xA1);
}

TEST_F(ServiceTest, AnswersToChangesWaitUntilTheChangeIsDurable) {
  log_.durable = 1;
  EXPECT_TRUE(Handle({Hello(1, 1)}).empty());
  EXPECT_EQ(Handle({Sense(1)}).size(), 1u);  // SENSE speaks of no change
  EXPECT_TRUE(Handle({Hello(2, 1)}).empty());
  EXPECT_TRUE(Release().empty());
  log_.durable = 2;
  auto out = Release();
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].message.opcode, protocol::kHelloAnswer);
  EXPECT_EQ(out[0].message.id, 1);
  log_.durable = 3;
  out = Release();
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].message.id, 2);
  EXPECT_TRUE(Release().empty());
}

TEST_F(ServiceTest, WaitingAnswersGoOutInTheOrderInWhichTheyWereGiven) {
  log_.durable = 1;
  Handle({Hello(1, 1), Hello(2, 1), Hello(3, 1)});
  Handle({Deposit(1, 1), Hello(4, 1)});  // robot 1 has its HELLO behind it
  Handle({Deposit(1, 1)});
  EXPECT_EQ(service_.held_answers(), 4u);
  log_.durable = 3;
  EXPECT_EQ(SequencesOf(Release()), (std::vector<uint64_t>{3}));
  log_.durable = 6;
  EXPECT_EQ(SequencesOf(Release()), (std::vector<uint64_t>{4, 5, 6}));
}

TEST_F(ServiceTest, AnAnswerToAnOlderChangeGoesOutWithWhatWasGivenBeforeIt) {
  log_.durable = 1;
  Handle({Hello(1, 1), Deposit(1, 1), Hello(2, 1), Hello(1, 1), Deposit(1, 1)});
  log_.durable = 3;
  EXPECT_TRUE(Release().empty());
  log_.durable = 4;
  EXPECT_EQ(SequencesOf(Release()), (std::vector<uint64_t>{4, 3}));
}

// What was given, and what of it was said to go nowhere.
class CountingWitness final : public Witness {
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
  CountingWitness witness;
  for (uint8_t id = 1; id <= kRobots; ++id) {
    Handle({Hello(id, 1)});
  }
  service_.Attach(&witness, [](const Engine&) {});
  log_.durable = log_.events.size();
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
  log_.durable = log_.events.size();
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
  EXPECT_EQ(witness.given, kRobots + kRepeats);
  EXPECT_EQ(witness.joined, kRepeats);
  EXPECT_EQ(witness.dropped, 0u);
}

TEST_F(ServiceTest, EachAnswerOfABatchGoesToTheOneWhoAsked) {
  const std::vector<protocol::Message> messages = {Hello(1, 1), Sense(0), Sense(2), Deposit(2, 1)};
  std::vector<Asker> askers(messages.size());
  for (uint32_t i = 0; i < askers.size(); ++i) {
    askers[i].asked_ns = 1;
    askers[i].connection = 10 + i;
  }
  std::vector<Outgoing> out;
  service_.Handle(0, messages, &out, askers);
  ASSERT_EQ(out.size(), 3u);  // nobody asks as robot 0
  EXPECT_EQ(out[0].asker.connection, 10u);
  EXPECT_EQ(out[1].asker.connection, 12u);
  EXPECT_EQ(out[2].asker.connection, 13u);
  out.clear();
  CommandIssued issued;
  issued.id = 1;
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  ASSERT_EQ(out.size(), 1u);
  EXPECT_FALSE(out[0].asker.known());
}

// Busy: the robot repeats it byte for byte. Of "read-only" it would gather that nothing happened.
TEST_F(ServiceTest, ARepeatOfWhatIsNotDurableIsBusyWhileTheLogTakesNothing) {
  CountingWitness witness;
  service_.Attach(&witness, [](const Engine&) {});
  Handle({Hello(1, 1)});
  log_.durable = log_.events.size();
  EXPECT_TRUE(Handle({Deposit(1, 9)}).empty());
  for (const Reason reason : {Reason::kReadOnly, Reason::kBusy}) {
    log_.admit = reason;
    const auto out = Handle({Deposit(1, 9)});
    ASSERT_EQ(out.size(), 1u);
    EXPECT_EQ(testing::ReasonOf(out[0].message), Reason::kBusy);
    EXPECT_EQ(witness.refused, Reason::kBusy);
    EXPECT_EQ(service_.held_answers(), 0u) << "it has been answered";
  }
  EXPECT_EQ(witness.dropped, 1u);
  EXPECT_EQ(service_.counters().errors[static_cast<size_t>(Reason::kBusy)], 2u);
  log_.durable = UINT64_MAX;
  EXPECT_TRUE(Release().empty());
  EXPECT_EQ(Handle({Deposit(1, 9)})[0].message.opcode, 0xA1) << "durable: the log is not needed";
  EXPECT_EQ(log_.events.size(), 3u) << "it happened once";
}

TEST_F(ServiceTest, ARequestThatIsAnsweredAtOnceEndsTheWaitForTheOneBefore) {
  Handle({Hello(1, 1)});
  log_.durable = log_.events.size();
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
  log_.durable = log_.events.size();
  CommandIssued halt;
  halt.id = protocol::kBroadcastId;
  std::vector<Outgoing> out;
  size_t issued = 0;
  while (service_.Issue(halt, &out).ok()) {
    ASSERT_LE(++issued, Service::kMostHeldCommands);
  }
  EXPECT_EQ(issued, Service::kMostHeldCommands);
  EXPECT_EQ(service_.Issue(halt, &out).error(), "1024 commands wait for the log to become durable");
  log_.durable = UINT64_MAX;
  EXPECT_EQ(Release().size(), issued);
  EXPECT_TRUE(service_.Issue(halt, &out).ok());
}

TEST_F(ServiceTest, ALostStateBeginsAnEpochThoughTheConfigurationIsTheSame) {
  Handle({Hello(1, 1)});
  EXPECT_TRUE(service_.Configure(testing::SmallConfig(), 9, true).ok());
  const auto out = Handle({Deposit(1, 1)});
  protocol::ErrorAnswer error;
  ASSERT_TRUE(protocol::Decode(out[0].message, &error));
  EXPECT_EQ(error.reason, Reason::kSayHello);
  EXPECT_EQ(service_.Inspect([](const Engine& engine) { return engine.epoch(); }), 9);
}

TEST_F(ServiceTest, AServiceGoesOnFromAnEngine) {
  Handle({Hello(1, 1), Deposit(1, 1)});
  ByteWriter writer;
  service_.Inspect([&writer](const Engine& engine) { engine.Save(&writer); });
  ByteReader reader(writer.bytes());
  Service again(
      &log_, [this] { return now_; }, 5'000, Engine::Restore(&reader).value());
  EXPECT_TRUE(again.Configure(testing::SmallConfig(), 8).ok());
  EXPECT_EQ(log_.events.size(), 3u) << "the same configuration is no event";
  EXPECT_EQ(again.StateHash(), service_.StateHash());
  std::vector<Outgoing> out;
  const std::vector<protocol::Message> repeat = {Deposit(1, 1)};
  again.Handle(0, repeat, &out);
  ASSERT_EQ(out.size(), 1u);
  EXPECT_EQ(out[0].message.opcode, 0xA1);
  EXPECT_EQ(log_.events.size(), 3u) << "it happened once";
}

TEST_F(ServiceTest, ALogThatRotatesIsToldTheHashOfTheStateBeforeTheNextEvent) {
  const uint64_t hash = service_.StateHash();
  log_.rotation_due = true;
  Handle({Hello(1, 1), Hello(2, 1)});
  EXPECT_EQ(log_.rotated, (std::vector<std::pair<size_t, uint64_t>>{{1, hash}}));
}

TEST_F(ServiceTest, TheSameConfigurationIsNoEvent) {
  EXPECT_TRUE(service_.Configure(testing::SmallConfig(), 8).ok());
  EXPECT_EQ(log_.events.size(), 1u);
  EngineConfig other = testing::SmallConfig();
  other.field.pheromones[0].tau_ms = 5;
  EXPECT_TRUE(service_.Configure(other, 8).ok());
  EXPECT_EQ(log_.events.size(), 2u);
}

TEST_F(ServiceTest, ARefusedConfigurationChangesNothing) {
  const uint64_t hash = service_.StateHash();
  EngineConfig other = testing::SmallConfig();
  other.field.map.cell_um = 50'000;
  EXPECT_FALSE(service_.Configure(other, 8).ok());
  EXPECT_EQ(service_.StateHash(), hash);
  EXPECT_EQ(log_.events.size(), 1u);
}

TEST_F(ServiceTest, CommandsAreRetriedWhenTheirTimeHasCome) {
  Handle({Hello(1, 1)});
  std::vector<Outgoing> out;
  CommandIssued issued;
  issued.id = 1;
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  EXPECT_EQ(out.size(), 1u);
  EXPECT_EQ(service_.MillisecondsToDeadline(), Engine::kFirstRetryMs);
  service_.AdvanceIfDue(&out);
  EXPECT_EQ(out.size(), 1u);
  now_.boottime_ms += Engine::kFirstRetryMs;
  EXPECT_EQ(service_.MillisecondsToDeadline(), 0u);
  service_.AdvanceIfDue(&out);
  EXPECT_EQ(out.size(), 2u);
  issued.id = 99;
  EXPECT_FALSE(service_.Issue(issued, &out).ok());
}

TEST_F(ServiceTest, ATimerIsWokenByWhatIsDueSoonerAndByNothingElse) {
  Handle({Hello(1, 1)});
  int woken = 0;
  service_.OnEarlierDeadline([&woken] { ++woken; });
  EXPECT_FALSE(service_.MillisecondsToDeadline().has_value());
  Handle({Sense(1)});
  EXPECT_EQ(woken, 0);
  Handle({Deposit(1, 1, 5000, 5000, 2)});  // dies in a minute
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(service_.MillisecondsToDeadline(), 60'000u);
  Handle({Deposit(1, 2, 1000, 1000, 3)});  // lives longer
  EXPECT_EQ(woken, 1);
  std::vector<Outgoing> out;
  CommandIssued issued;
  issued.id = 1;
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  EXPECT_EQ(woken, 2);
  Handle({Deposit(1, 3, 1000, 1000, 1)});  // still later than the command
  EXPECT_EQ(woken, 2);
  EXPECT_EQ(service_.MillisecondsToDeadline(), Engine::kFirstRetryMs);
}

TEST_F(ServiceTest, WhatEvaporatesIsSweptAtItsTimeWithoutAnyRequest) {
  Handle({Hello(1, 1), Deposit(1, 1, 5000, 5000, 2)});
  const auto nodes = [this] {
    return service_.Inspect([](const Engine& engine) { return engine.field().node_count(); });
  };
  std::vector<Outgoing> out;
  now_.boottime_ms += *service_.MillisecondsToDeadline() - 1;
  service_.AdvanceIfDue(&out);
  EXPECT_EQ(nodes(), 1u);
  for (int i = 0; i < 3 && service_.MillisecondsToDeadline(); ++i) {
    now_.boottime_ms += *service_.MillisecondsToDeadline();
    service_.AdvanceIfDue(&out);
  }
  EXPECT_EQ(nodes(), 0u);
  EXPECT_FALSE(service_.MillisecondsToDeadline().has_value());
}

TEST_F(ServiceTest, WhileTheLogTakesNothingTheDeadlineIsPutOffInsteadOfAskedAgainAtOnce) {
  Handle({Hello(1, 1), Deposit(1, 1)});
  int woken = 0;
  service_.OnEarlierDeadline([&woken] { ++woken; });
  now_.boottime_ms += *service_.MillisecondsToDeadline();
  log_.admit = Reason::kReadOnly;
  const size_t events = log_.events.size();
  const uint64_t hash = service_.StateHash();
  std::vector<Outgoing> out;
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(service_.MillisecondsToDeadline(), 0u);
    service_.AdvanceIfDue(&out);
    EXPECT_EQ(service_.MillisecondsToDeadline(), Service::kPutOffMs);
    service_.AdvanceIfDue(&out);  // too early
    now_.boottime_ms += Service::kPutOffMs;
  }
  EXPECT_EQ(log_.events.size(), events);
  EXPECT_EQ(service_.StateHash(), hash);
  EXPECT_EQ(woken, 0);
  service_.AdvanceIfDue(&out);
  ASSERT_EQ(service_.MillisecondsToDeadline(), Service::kPutOffMs);
  log_.admit = Reason::kNone;
  Handle({Deposit(1, 2)});  // the log is back: no reason to wait any longer
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(service_.MillisecondsToDeadline(), 0u);
}

TEST_F(ServiceTest, AnEditIsLoggedUnlessItIsClearThatItCannotBeDone) {
  field::FieldEdit edit;
  edit.level = 64;
  edit.points = {{0, 0}, {500'000, 0}};
  ASSERT_TRUE(service_.Edit(edit).ok());
  EXPECT_EQ(log_.events.size(), 2u);
  EXPECT_EQ(std::get<FieldEdited>(log_.events[1].second).edit, edit);
  const uint64_t hash = service_.StateHash();
  field::FieldEdit wrong = edit;
  wrong.type = 7;
  EXPECT_NE(service_.Edit(wrong).error().find("not configured"), std::string::npos);
  log_.admit = Reason::kReadOnly;
  EXPECT_NE(service_.Edit(edit).error().find("log"), std::string::npos);
  EXPECT_EQ(log_.events.size(), 2u);
  EXPECT_EQ(service_.StateHash(), hash);
}

// Whether there is memory shows when it is tried: the event is in the log, and a replay finds the
// same lack.
TEST_F(ServiceTest, AnEditWithoutMemoryIsAnErrorHereAndInEveryReplay) {
  EngineConfig config = testing::SmallConfig();
  config.field.memory_bytes = 40'000;
  ASSERT_TRUE(service_.Configure(config, 7).ok());
  field::FieldEdit edit;
  edit.level = 64;
  edit.shape = field::FieldEdit::Shape::kAll;
  EXPECT_NE(service_.Edit(edit).error().find("memory"), std::string::npos);
  EXPECT_EQ(log_.events.size(), 3u);
  Engine replayed;
  std::vector<Outgoing> out;
  for (size_t i = 0; i < log_.events.size(); ++i) {
    replayed.Apply(i + 1, log_.events[i].first, log_.events[i].second, &out);
  }
  EXPECT_EQ(replayed.StateHash(), service_.StateHash());
  ASSERT_EQ(replayed.finished().size(), 1u);
  EXPECT_FALSE(replayed.finished()[0].outcome.ok());
}

// A map of 101 x 101 nodes: three portions.
TEST_F(ServiceTest, RobotsAreAnsweredBetweenThePortionsOfAnEdit) {
  Handle({Hello(1, 1)});
  int portions = 0;
  uint8_t seq = 0;
  size_t nodes = field::Field::kNodesOfPortion;  // the first one is made with the edit itself
  service_.OnPortion([&](std::span<const Outgoing> /*out*/) {
    ++portions;
    const auto answers = Handle({Deposit(1, ++seq)});
    ASSERT_EQ(answers.size(), 1u);
    EXPECT_EQ(testing::ReasonOf(answers[0].message), Reason::kNone);
    const size_t now = service_.Inspect([](const Engine& it) { return it.field().node_count(); });
    EXPECT_LE(now - nodes, size_t{field::Field::kNodesOfPortion} + 1);
    nodes = now;
  });
  field::FieldEdit edit;
  edit.level = 64;
  edit.shape = field::FieldEdit::Shape::kAll;
  const auto made = service_.Edit(edit);
  ASSERT_TRUE(made.ok());
  EXPECT_EQ(made.value().nodes, 101 * 101);
  EXPECT_EQ(made.value().sequence, log_.events.size());
  EXPECT_EQ(portions, 101 * 101 / field::Field::kNodesOfPortion);
  Engine replayed;
  std::vector<Outgoing> out;
  for (size_t i = 0; i < log_.events.size(); ++i) {
    replayed.Apply(i + 1, log_.events[i].first, log_.events[i].second, &out);
  }
  EXPECT_EQ(replayed.StateHash(), service_.StateHash());
}

TEST_F(ServiceTest, AConfigurationWaitsForTheEditBeforeIt) {
  bool reconfigured = false;
  service_.OnPortion([&](std::span<const Outgoing> /*out*/) {
    if (!std::exchange(reconfigured, true)) {
      EngineConfig next = testing::SmallConfig();
      next.field.pheromones[0].tau_ms += 1'000;
      EXPECT_TRUE(service_.Configure(next, 7).ok());
      service_.Inspect([](const Engine& it) { EXPECT_EQ(it.field().node_count(), 101u * 101u); });
    }
  });
  field::FieldEdit edit;
  edit.level = 64;
  edit.shape = field::FieldEdit::Shape::kAll;
  EXPECT_TRUE(service_.Edit(edit).ok());
  EXPECT_TRUE(reconfigured);
}

TEST_F(ServiceTest, OnlyPosesOfKnownRobotsAreLogged) {
  Handle({Hello(1, 1)});
  const PoseObserved known{0, 1, {{1, 2}, 3}, 100};
  const PoseObserved seen[] = {known, {0, 2, {}, 100}, {1, 1, {}, 100}, {9, 1, {}, 100}};
  EXPECT_EQ(service_.Observe(seen), 1u);
  ASSERT_EQ(log_.events.size(), 3u);
  EXPECT_EQ(std::get<PoseObserved>(log_.events[2].second).pose.position, known.pose.position);
  log_.admit = Reason::kBusy;
  EXPECT_EQ(service_.Observe({&known, 1}), 0u);
  EXPECT_EQ(log_.events.size(), 3u);
  EXPECT_EQ(service_.counters().observations, 1u);
  EXPECT_EQ(service_.counters().observations_refused, 4u);
}

TEST_F(ServiceTest, FindsLinksByName) {
  EXPECT_EQ(service_.FindLink("radio-b"), LinkIndex{1});
  EXPECT_FALSE(service_.FindLink("radio-c").has_value());
  EXPECT_FALSE(service_.FindLink("").has_value());
}

TEST_F(ServiceTest, CountsWhatItDid) {
  Handle({Hello(1, 1), Deposit(1, 1), Deposit(1, 1), Deposit(2, 1), Sense(0)});
  const ServiceCounters counters = service_.counters();
  EXPECT_EQ(counters.requests, 5u);
  EXPECT_EQ(counters.answers, 3u);
  EXPECT_EQ(counters.repeats, 1u);
  EXPECT_EQ(counters.ignored, 1u);
  EXPECT_EQ(counters.changes, 3u);  // with the configuration
  EXPECT_EQ(counters.errors[static_cast<size_t>(Reason::kSayHello)], 1u);
}

TEST_F(ServiceTest, AnObserverIsToldWhatBecameOfEachMessage) {
  Listener listener;
  service_.Attach(&listener, [](const Engine&) {});
  using Outcomes = std::vector<std::pair<uint64_t, Reason>>;
  const auto outcomes = [&listener] {
    Outcomes all;
    for (const Witness::Outcome& it : listener.batches.back().outcomes) {
      all.emplace_back(it.sequence, it.refused);
    }
    return all;
  };
  log_.durable = 1;  // answers wait, but the observer has them at once
  const std::vector<protocol::Message> batch = {
      Hello(1, 1), Sense(1), Deposit(1, 1), Deposit(1, 1), Deposit(2, 1), Sense(0), Deposit(1, 2)};
  Handle(batch);
  ASSERT_EQ(listener.batches.size(), 1u);
  EXPECT_EQ(outcomes(), (Outcomes{{2, Reason::kNone},  // HELLO, after the configuration
                                  {0, Reason::kNone},  // SENSE changes nothing
                                  {3, Reason::kNone},
                                  {0, Reason::kNone},  // a repeat
                                  {0, Reason::kNone},  // has not said HELLO
                                  {0, Reason::kNone},  // invalid robot ID
                                  {4, Reason::kNone}}));
  const Listener::Batch& told = listener.batches[0];
  EXPECT_EQ(told.link, 0);
  EXPECT_EQ(told.stamp.field_time_ms, log_.events[1].first.field_time_ms);
  EXPECT_EQ(told.stamp.utc_ms, 1'700'000'000'000);
  ASSERT_EQ(told.messages.size(), batch.size());
  std::vector<uint64_t> sent;
  for (const Outgoing& it : told.sent) {
    sent.push_back(it.durable_at);
  }
  EXPECT_EQ(sent, (std::vector<uint64_t>{2, 0, 3, 3, 0, 4}));

  for (const Reason reason : {Reason::kReadOnly, Reason::kBusy}) {
    log_.admit = reason;
    Handle({Sense(1), Deposit(1, 3)});
    EXPECT_EQ(outcomes(), (Outcomes{{0, Reason::kNone}, {0, reason}}));
    ASSERT_EQ(listener.batches.back().sent.size(), 2u);
    EXPECT_EQ(testing::ReasonOf(listener.batches.back().sent[1].message), reason);
  }
  log_.admit = Reason::kNone;
  std::vector<Outgoing> out(3);  // of others
  const protocol::Message deposit = Deposit(1, 3);
  service_.Handle(0, {&deposit, 1}, &out);
  EXPECT_EQ(outcomes(), (Outcomes{{5, Reason::kNone}}));
  EXPECT_EQ(listener.batches.back().sent.size(), 1u);
  EXPECT_TRUE(listener.events.empty());
  service_.Attach(nullptr, [](const Engine&) {});
  Handle({Deposit(1, 4)});
  EXPECT_EQ(listener.batches.size(), 4u);
}

TEST_F(ServiceTest, AnObserverIsToldOfEventsThatNoMessageIs) {
  Handle({Hello(1, 1)});
  Listener listener;
  service_.Attach(&listener, [](const Engine&) {});
  std::vector<Outgoing> out;
  CommandIssued issued;
  issued.id = 1;
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  field::FieldEdit edit;
  edit.level = 64;
  edit.points = {{0, 0}, {500'000, 0}};
  ASSERT_TRUE(service_.Edit(edit).ok());
  const PoseObserved seen{0, 1, {{1, 2}, 3}, 100};
  EXPECT_EQ(service_.Observe({&seen, 1}), 1u);
  now_.boottime_ms += Engine::kFirstRetryMs;
  service_.AdvanceIfDue(&out);
  EngineConfig config = testing::SmallConfig();
  config.field.pheromones[0].tau_ms = 5;
  ASSERT_TRUE(service_.Configure(config, 8).ok());
  log_.admit = Reason::kBusy;
  EXPECT_FALSE(service_.Issue(issued, &out).ok());  // is no event
  ASSERT_EQ(listener.events.size(), 5u);
  for (size_t i = 0; i < listener.events.size(); ++i) {
    const Listener::Other& told = listener.events[i];
    EXPECT_EQ(told.sequence, 3 + i);
    EXPECT_EQ(told.stamp.field_time_ms, log_.events[2 + i].first.field_time_ms);
    EXPECT_EQ(told.event.index(), log_.events[2 + i].second.index());
    EXPECT_EQ(told.sent.size(), i == 0 || i == 3 ? 1u : 0u);  // the command, and again
  }
  EXPECT_EQ(std::get<FieldEdited>(listener.events[1].event).edit, edit);
  EXPECT_TRUE(listener.batches.empty());
}

// Several links at once: nothing is lost, and the log replays to the same state.
TEST(ServiceThreads, ConcurrentLinksLoseNothing) {
  ScriptedLog log;
  std::atomic<uint64_t> clock{0};
  Service service(&log, [&clock] { return ClockReading{++clock, 0}; });
  EngineConfig config = testing::SmallConfig();
  config.field.pheromones[1].max_count = 60'000;
  ASSERT_TRUE(service.Configure(config, 7).ok());
  constexpr int kEach = 2'000;
  std::atomic<int> answers{0};
  std::vector<std::thread> threads;
  for (uint8_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      const auto link = static_cast<LinkIndex>(t % 2);
      const auto id = static_cast<uint8_t>(1 + t);
      std::vector<Outgoing> out;
      const protocol::Message hello = Hello(id, 1);
      service.Handle(link, {&hello, 1}, &out);
      for (int i = 0; i < kEach; ++i) {
        const protocol::Message batch[] = {Deposit(id, static_cast<uint8_t>(i), 5000, 5000, 1, 2),
                                           Sense(id)};
        service.Handle(link, batch, &out);
      }
      answers += static_cast<int>(out.size());
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(answers, 4 * (2 * kEach + 1));
  uint64_t quanta = 0;
  service.Inspect([&](const Engine& engine) {
    engine.field().ForEach([&](uint8_t, field::NodeIndex, field::NodeState state) {
      quanta += state.level / field::kLevelsPerQuantum;
    });
    return 0;
  });
  EXPECT_EQ(quanta, 4u * kEach);
  Engine replayed;
  std::vector<Outgoing> out;
  for (size_t i = 0; i < log.events.size(); ++i) {
    replayed.Apply(i + 1, log.events[i].first, log.events[i].second, &out);
  }
  EXPECT_EQ(replayed.StateHash(), service.StateHash());
}

// Fails in the middle of a change, as for want of memory.
class FailingLog final : public OrderedLog {
 public:
  Reason Admit() override { return Reason::kNone; }
  uint64_t Append(const Stamp& /*stamp*/, const Event& /*event*/) override {
    if (++sequence_ > 1) {
      throw std::bad_alloc();
    }
    return sequence_;
  }
  uint64_t DurableSequence() const override { return sequence_; }
  bool WhenDurable(uint64_t /*sequence*/, std::function<void()> /*done*/) override { return false; }
  void Probe(std::function<void()> done) override { done(); }

 private:
  uint64_t sequence_ = 0;
};

TEST(ServiceDeathTest, AnExceptionBetweenLogAndStateEndsTheProcess) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto change = [] {
    FailingLog log;
    Service service(&log, [] { return ClockReading{}; });
    if (service.Configure(testing::SmallConfig(), 7).ok()) {
      std::vector<Outgoing> out;
      const protocol::Message hello[] = {Hello(1, 1)};
      service.Handle(0, hello, &out);
    }
  };
  EXPECT_DEATH(change(), "");
}

}  // namespace
}  // namespace pheromone::engine
