#include "server/cluster/group_queue.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::cluster {
namespace {

ReplicaSettings QueueSettings() {
  return {.node = "a", .nodes = {"a"}, .heartbeat_ms = 50, .group_ms = 5, .group_bytes = 10};
}

GroupQueue QueueOfTerm7At(Sequence next) {
  GroupQueue queue(QueueSettings());
  queue.Begin(7, next);
  return queue;
}

TEST(GroupQueue, AppendsTheFirstEventAtOnce) {
  GroupQueue queue = QueueOfTerm7At(11);
  EXPECT_EQ(queue.Due(100), nullptr);
  EXPECT_EQ(queue.Deadline(), kNever);
  queue.Push(11, "one");
  EXPECT_LE(queue.Deadline(), 100u);
  const Group* const group = queue.Due(100);
  ASSERT_NE(group, nullptr);
  EXPECT_EQ(*group, (Group{.first = 11, .count = 1, .term = 7, .records = "one"}));
}

TEST(GroupQueue, HasOneGroupInFlightAndCollectsTheRestMeanwhile) {
  GroupQueue queue = QueueOfTerm7At(11);
  queue.Push(11, "one");
  ASSERT_NE(queue.Due(100), nullptr);
  queue.Push(12, "two");
  queue.Push(13, "three");
  EXPECT_EQ(queue.Deadline(), kNever);
  EXPECT_EQ(queue.Due(200), nullptr);
  EXPECT_EQ(queue.Commit().records, "one");
  const Group* const group = queue.Due(200);
  ASSERT_NE(group, nullptr);
  EXPECT_EQ(*group, (Group{.first = 12, .count = 2, .term = 7, .records = "twothree"}));
  queue.Commit();
  EXPECT_TRUE(queue.empty());
}

TEST(GroupQueue, BeginsGroupsAtLeastGroupMsApart) {
  GroupQueue queue = QueueOfTerm7At(1);
  queue.Push(1, "one");
  ASSERT_NE(queue.Due(100), nullptr);
  queue.Commit();
  queue.Push(2, "two");
  EXPECT_EQ(queue.Deadline(), 105u);
  EXPECT_EQ(queue.Due(104), nullptr);
  EXPECT_NE(queue.Due(105), nullptr);
}

TEST(GroupQueue, FillsAGroupUpToGroupBytes) {
  GroupQueue queue = QueueOfTerm7At(1);
  queue.Push(1, "12345");
  queue.Push(2, "67890");
  queue.Push(3, "x");
  EXPECT_EQ(queue.Due(0)->records, "1234567890");
  queue.Commit();
  EXPECT_EQ(*queue.Due(5), (Group{.first = 3, .count = 1, .term = 7, .records = "x"}));
}

TEST(GroupQueue, GivesALargerEventAGroupOfItsOwn) {
  GroupQueue queue = QueueOfTerm7At(1);
  queue.Push(1, "1");
  queue.Push(2, "larger than ten bytes");
  queue.Push(3, "3");
  EXPECT_EQ(queue.Due(0)->records, "1");
  queue.Commit();
  EXPECT_EQ(queue.Due(5)->records, "larger than ten bytes");
  queue.Commit();
  EXPECT_EQ(queue.Due(10)->records, "3");
}

TEST(GroupQueue, RepeatsTheSameGroupAfterAPause) {
  GroupQueue queue = QueueOfTerm7At(11);
  queue.Push(11, "one");
  const Group group = *queue.Due(100);
  queue.Push(12, "two");
  queue.Repeat(140);
  EXPECT_EQ(queue.Deadline(), 190u);
  EXPECT_EQ(queue.Due(189), nullptr);
  ASSERT_NE(queue.Due(190), nullptr);
  EXPECT_EQ(*queue.in_flight(), group);
  EXPECT_EQ(queue.Due(500), nullptr);
  EXPECT_EQ(queue.Commit(), group);
  EXPECT_EQ(queue.Due(500)->first, 12u);
}

}  // namespace
}  // namespace pheromone::cluster
