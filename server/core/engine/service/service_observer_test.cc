// Observers are notified of everything, in order, at once; each independently.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <new>
#include <span>
#include <utility>
#include <vector>

#include "server/core/engine/testing/service_bench.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;
using testing::Deposit;
using testing::Hello;
using testing::Sense;
using testing::ServiceTest;

// Keeps its notifications.
class Listener final : public Observer {
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

TEST_F(ServiceTest, AnObserverIsToldWhatBecameOfEachMessage) {
  Listener listener;
  service_.Attach(&listener, [](const Engine&) {});
  using Outcomes = std::vector<std::pair<uint64_t, Reason>>;
  const auto outcomes = [&listener] {
    Outcomes all;
    for (const Observer::Outcome& it : listener.batches.back().outcomes) {
      all.emplace_back(it.sequence, it.refused);
    }
    return all;
  };
  log_.SetDurable(1);  // answers wait, but the observer has them at once
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
  service_.Detach(&listener);
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
  now_.boottime_ms += RobotsPart::kFirstRetryMs;
  service_.AdvanceIfDue(&out);
  EngineConfig config = testing::SmallConfig();
  config.field.pheromones[0].tau_ms = 5;
  ASSERT_TRUE(service_.Configure(config, 8).ok());
  log_.admit = Reason::kBusy;
  EXPECT_FALSE(service_.Issue(issued, &out).ok());  // is not an event
  ASSERT_EQ(listener.events.size(), 5u);
  for (size_t i = 0; i < listener.events.size(); ++i) {
    const Listener::Other& told = listener.events[i];
    EXPECT_EQ(told.sequence, 3 + i);
    EXPECT_EQ(told.stamp.field_time_ms, log_.events[2 + i].first.field_time_ms);
    EXPECT_EQ(told.event.index(), log_.events[2 + i].second.index());
    EXPECT_EQ(told.sent.size(), i == 0 || i == 3 ? 1u : 0u);  // the command and its retry
  }
  EXPECT_EQ(std::get<FieldEdited>(listener.events[1].event).edit, edit);
  EXPECT_TRUE(listener.batches.empty());
}

// An observer's notifications, in order: the size and the last change of each batch, the number of
// each event.
class Order final : public Observer {
 public:
  using Heard = std::vector<std::pair<char, uint64_t>>;

  void OnBatch(const Stamp& /*stamp*/, LinkIndex /*link*/,
               std::span<const protocol::Message> messages, std::span<const Outcome> outcomes,
               std::span<const Outgoing> /*sent*/) override {
    ASSERT_EQ(messages.size(), outcomes.size());
    heard.emplace_back('b', outcomes.back().sequence);
  }
  void OnEvent(uint64_t sequence, const Stamp& /*stamp*/, const Event& /*event*/,
               std::span<const Outgoing> /*sent*/) override {
    if (sequence == fails_at) {
      throw std::bad_alloc();
    }
    heard.emplace_back('e', sequence);
  }
  void OnDropped(LinkIndex /*link*/, const protocol::Message& message, bool /*repeated*/) override {
    heard.emplace_back('d', message.id);
  }
  void OnFailure() noexcept override { ++failures; }

  Heard heard;
  uint64_t fails_at = 0;
  int failures = 0;
};

class ObserversTest : public ServiceTest {
 protected:
  void Issue() {
    CommandIssued issued;
    issued.id = 1;
    std::vector<Outgoing> out;
    ASSERT_TRUE(service_.Issue(issued, &out).ok());
  }

  uint64_t AttachAndLook(Observer* observer) {
    uint64_t sequence = 0;
    service_.Attach(observer, [&](const Engine& engine) { sequence = engine.sequence(); });
    return sequence;
  }
};

TEST_F(ObserversTest, EachHearsAllInOrderFromWhereItBeganToWhereItEnded) {
  Order first;
  Order second;
  Order third;
  EXPECT_EQ(AttachAndLook(&first), 1u);  // the configuration
  Handle({Hello(1, 1)});                 // 2
  Issue();                               // 3
  EXPECT_EQ(AttachAndLook(&second), 3u);
  EXPECT_EQ(AttachAndLook(&third), 3u);
  log_.SetDurable(3);
  Handle({Deposit(1, 1)});  // 4, and its answer waits
  Issue();                  // 5
  uint64_t end = 0;
  service_.Detach(&second, [&](const Engine& engine) { end = engine.sequence(); });
  EXPECT_EQ(end, 5u);
  Handle({Deposit(1, 2)});  // 6: it replaces the answer before it
  Issue();                  // 7
  Order::Heard all = {{'b', 2}, {'e', 3}, {'b', 4}, {'e', 5}, {'b', 6}, {'d', 1}, {'e', 7}};
  EXPECT_EQ(first.heard, all);
  EXPECT_EQ(second.heard, (Order::Heard{{'b', 4}, {'e', 5}}));
  EXPECT_EQ(third.heard, Order::Heard(all.begin() + 2, all.end()));
  service_.Detach(&first);
  service_.Detach(&third);
  Issue();
  EXPECT_EQ(first.heard, all);
}

TEST_F(ObserversTest, OneThatIsAttachedTwiceHearsOnceAndOneThatIsNotMayBeDetached) {
  Order twice;
  Order never;
  EXPECT_EQ(AttachAndLook(&twice), 1u);
  Handle({Hello(1, 1)});
  EXPECT_EQ(AttachAndLook(&twice), 2u);
  service_.Detach(&never);
  Issue();
  EXPECT_EQ(twice.heard, (Order::Heard{{'b', 2}, {'e', 3}}));
  service_.Detach(&twice);
  Issue();
  EXPECT_EQ(twice.heard.size(), 2u);
}

TEST_F(ObserversTest, OneThatFailsIsLeftBehindAndNobodyElseNotices) {
  Handle({Hello(1, 1)});
  Order before;
  Order failing;
  Order after;
  failing.fails_at = 4;
  for (Order* const it : {&before, &failing, &after}) {
    AttachAndLook(it);
  }
  log_.SetDurable(2);
  Issue();
  CommandIssued issued;
  issued.id = 1;
  std::vector<Outgoing> out;
  EXPECT_TRUE(service_.Issue(issued, &out).ok());
  EXPECT_TRUE(out.empty());  // it waits for its event to become durable, as ever
  Issue();
  EXPECT_EQ(failing.heard, (Order::Heard{{'e', 3}}));
  EXPECT_EQ(failing.failures, 1);
  for (const Order* const it : {&before, &after}) {
    EXPECT_EQ(it->heard, (Order::Heard{{'e', 3}, {'e', 4}, {'e', 5}}));
    EXPECT_EQ(it->failures, 0);
  }
  log_.SetDurable(5);
  EXPECT_EQ(Release().size(), 3u);
}

}  // namespace
}  // namespace pheromone::engine
