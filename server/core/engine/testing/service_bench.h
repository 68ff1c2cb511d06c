// A service with a scripted log and a clock that the test advances.
//
//   TEST_F(ServiceTest, SaysHello) { EXPECT_EQ(Handle({Hello(1, 1)}).size(), 1u); }
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include "protocol/messages.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/scripted_log.h"

namespace pheromone::engine::testing {

/// Configured as SmallConfig, which is the first event of the log.
class ServiceTest : public ::testing::Test {
 protected:
  ServiceTest() : service_(&log_, [this] { return now_; }) {
    EXPECT_TRUE(service_.Configure(SmallConfig(), 7).ok());
  }

  std::vector<Outgoing> Handle(const std::vector<protocol::Message>& messages) {
    std::vector<Outgoing> out;
    service_.Handle(0, messages, &out);
    return out;
  }

  std::vector<Outgoing> Release() {
    std::vector<Outgoing> out;
    service_.Release(&out);
    return out;
  }

  ScriptedLog log_;
  ClockReading now_{1'000, 1'700'000'000'000};
  Service service_;
};

/// The state hash of a new engine that is given the events of a log, one after the other.
inline uint64_t HashOfReplay(const ScriptedLog& log, Engine* replayed) {
  std::vector<Outgoing> out;
  for (size_t i = 0; i < log.events.size(); ++i) {
    replayed->Apply(i + 1, log.events[i].first, log.events[i].second, &out);
  }
  return replayed->StateHash();
}

}  // namespace pheromone::engine::testing
