#include "server/core/engine/service/service.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <new>
#include <thread>
#include <utility>
#include <vector>

#include "server/core/engine/testing/service_bench.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;
using testing::Deposit;
using testing::HashOfReplay;
using testing::Hello;
using testing::ScriptedLog;
using testing::Sense;
using testing::ServiceTest;

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

TEST_F(ServiceTest, EachAnswerOfABatchGoesToTheOneWhoAsked) {
  const std::vector<protocol::Message> messages = {Hello(1, 1), Sense(0), Sense(2), Deposit(2, 1)};
  std::vector<Asker> askers(messages.size());
  for (uint32_t i = 0; i < askers.size(); ++i) {
    askers[i].asked_ns = 1;
    askers[i].connection = 10 + i;
  }
  std::vector<Outgoing> out;
  service_.Handle(0, messages, &out, askers);
  ASSERT_EQ(out.size(), 3u);  // ID 0 is never answered
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
        const protocol::Message batch[] = {
            Deposit(id, static_cast<uint8_t>(i + 1), 5000, 5000, 1, 2), Sense(id)};
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
  EXPECT_EQ(HashOfReplay(log, &replayed), service.StateHash());
}

// Throws in the middle of a change, as if out of memory.
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
