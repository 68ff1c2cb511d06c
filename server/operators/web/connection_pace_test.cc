#include "server/operators/web/connection_pace.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

namespace pheromone::web {
namespace {

using std::chrono::milliseconds;

class ConnectionPaceTest : public ::testing::Test {
 protected:
  // -1: to be closed.
  int64_t Next(const std::string& client = "a") {
    const auto wait = pace_.Next(client, now_);
    return wait ? std::chrono::duration_cast<milliseconds>(*wait).count() : -1;
  }

  ConnectionPace pace_{
      {.interval = milliseconds(10), .burst = 3, .longest_wait = milliseconds(20), .clients = 2}};
  ConnectionPace::Time now_ = ConnectionPace::Time{} + std::chrono::hours(1);
};

TEST_F(ConnectionPaceTest, AfterABurstConnectionsWaitForTheirTurnAndThenAreClosed) {
  for (const int64_t expected : {0, 0, 0, 10, 20, -1, -1}) {
    EXPECT_EQ(Next(), expected);
  }
  now_ += milliseconds(10);
  EXPECT_EQ(Next(), 20) << "what was closed counts for nothing";
  EXPECT_EQ(Next(), -1);
}

TEST_F(ConnectionPaceTest, WhoeverKeepsThePaceNeverWaitsAndAPauseGivesTheBurstBack) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(Next(), 0);
  }
  for (int i = 0; i < 1'000; ++i) {
    now_ += milliseconds(10);
    ASSERT_EQ(Next(), 0);
  }
  EXPECT_EQ(Next(), 10);
  now_ += std::chrono::hours(1);
  for (const int64_t expected : {0, 0, 0, 10}) {
    EXPECT_EQ(Next(), expected) << "and not more than the burst";
  }
}

TEST_F(ConnectionPaceTest, ClientsDoNotWaitForEachOtherUnlessThereAreTooMany) {
  for (const int64_t expected : {0, 0, 0, 10, 20, -1}) {
    EXPECT_EQ(Next("a"), expected);
  }
  EXPECT_EQ(Next("b"), 0);
  for (const int64_t expected : {0, 0, 0, 10}) {
    EXPECT_EQ(Next("c"), expected);
  }
  EXPECT_EQ(Next("d"), 20) << "c and d share one pace";
  now_ += milliseconds(60);
  EXPECT_EQ(Next("d"), 0) << "those who have not come for a while make room";
}

TEST(NetworkOfTest, IsTheAddressOrTheFirstHalfOfAnIpv6AddressThatIsNotANeighbours) {
  EXPECT_EQ(NetworkOf("192.0.2.7"), "192.0.2.7");
  EXPECT_EQ(NetworkOf("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::");
  EXPECT_EQ(NetworkOf("2001:db8:1:2:ffff::9"), "2001:db8:1:2::");
  EXPECT_EQ(NetworkOf("fe80::1"), "fe80::1");
  EXPECT_EQ(NetworkOf("fe80::2%lo"), "fe80::2%lo");
  EXPECT_EQ(NetworkOf("febf:0:0:5::1"), "febf:0:0:5::1");
  EXPECT_EQ(NetworkOf("fec0::1"), "fec0::");
  EXPECT_EQ(NetworkOf("::ffff:192.0.2.7"), "::ffff:192.0.2.7");
  EXPECT_EQ(NetworkOf(""), "");
}

}  // namespace
}  // namespace pheromone::web
