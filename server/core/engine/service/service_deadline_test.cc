// Due work is done on time, without any request.

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/core/engine/testing/service_bench.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;
using testing::Deposit;
using testing::Hello;
using testing::Sense;
using testing::ServiceTest;

TEST_F(ServiceTest, CommandsAreRetriedWhenTheirTimeHasCome) {
  Handle({Hello(1, 1)});
  std::vector<Outgoing> out;
  CommandIssued issued;
  issued.id = 1;
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  EXPECT_EQ(out.size(), 1u);
  EXPECT_EQ(service_.MillisecondsToDeadline(), RobotsPart::kFirstRetryMs);
  service_.AdvanceIfDue(&out);
  EXPECT_EQ(out.size(), 1u);
  now_.boottime_ms += RobotsPart::kFirstRetryMs;
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
  Handle({Deposit(1, 1, 5000, 5000, 2)});  // evaporates in a minute
  EXPECT_EQ(woken, 1);
  EXPECT_EQ(service_.MillisecondsToDeadline(), 60'000u);
  Handle({Deposit(1, 2, 1000, 1000, 3)});  // lasts longer
  EXPECT_EQ(woken, 1);
  std::vector<Outgoing> out;
  CommandIssued issued;
  issued.id = 1;
  ASSERT_TRUE(service_.Issue(issued, &out).ok());
  EXPECT_EQ(woken, 2);
  Handle({Deposit(1, 3, 1000, 1000, 1)});  // still later than the command
  EXPECT_EQ(woken, 2);
  EXPECT_EQ(service_.MillisecondsToDeadline(), RobotsPart::kFirstRetryMs);
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

}  // namespace
}  // namespace pheromone::engine
