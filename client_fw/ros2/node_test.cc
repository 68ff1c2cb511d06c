#include "client_fw/ros2/node.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <future>
#include <string>
#include <thread>

#include "server/formats/ros/names.h"

namespace pheromone::ros2 {
namespace {

TEST(RosNames, TopicsAreThoseOfRos) {
  EXPECT_EQ(DdsTopic("/tb1/cmd_vel"), "rt/tb1/cmd_vel");
  EXPECT_EQ(std::string(Kind<OccupancyGrid>::descriptor()->m_typename),
            "nav_msgs::msg::dds_::OccupancyGrid_");
}

TEST(RosNames, NamesAreThoseThatRosAllows) {
  for (const char* good : {"tb1", "lab/tb1", "_a", "A9_b"}) {
    EXPECT_TRUE(IsRosName(good)) << good;
  }
  for (const char* bad : {"", "/tb1", "tb1/", "a//b", "1a", "lab/1", "a-b", "a b", "a__b"}) {
    EXPECT_FALSE(IsRosName(bad)) << bad;
  }
  // Whatever a pheromone's name is.
  ros::TopicNames names;
  for (const char* name : {"no-go area", "no go area", "2nd", "a- b", "a_", "a-", "_", "-", "\n"}) {
    EXPECT_TRUE(IsRosName(names.PartOf(name))) << name;
  }
}

// A domain of this process, on the loopback interface.
Discovery OwnDomain() {
  Discovery discovery = ReadEnvironment([](const char* name) {
                          return std::string(name) == "ROS_LOCALHOST_ONLY" ? "1" : nullptr;
                        }).value();
  discovery.domain = 1 + static_cast<uint32_t>(getpid()) % 100;
  return discovery;
}

TEST(Node, LateSubscriptionGetsTheLastMessageOfALatchedTopic) {
  const auto node = std::move(Node::Create(OwnDomain(), Distro::kIron)).value();
  const auto out = node->Advertise<Bool>("/kept", Quality::kLatched);
  out.Publish({false});
  out.Publish({true});
  auto in = node->Subscribe<Bool>("/kept", Quality::kStatic);
  ASSERT_TRUE(node->status().ok());
  int count = 0;
  bool last = false;
  while (count == 0) {
    in.Receive([&](const Bool& message) {
      ++count;
      last = message.data;
    });
    std::this_thread::yield();
  }
  EXPECT_TRUE(last);
  EXPECT_EQ(count, 1);
}

TEST(Node, ATopicThatIsWithdrawnMayComeBackWithAnotherType) {
  const auto node = std::move(Node::Create(OwnDomain(), Distro::kIron)).value();
  node->Withdraw(node->Advertise<Bool>("/again", Quality::kLatched));
  node->Withdraw(node->Subscribe<Bool>("/again", Quality::kMany));
  EXPECT_TRUE(node->Advertise<Empty>("/again", Quality::kLatched).exists());
  EXPECT_TRUE(node->status().ok()) << node->status().ErrorOr("");
}

// What a listener shares with the test that holds it.
struct HeldListener {
  std::promise<void> entered;
  std::promise<void> release;
};

TEST(Node, WhatIsWithdrawnHoldsUpNobodyElse) {
  const auto node = std::move(Node::Create(OwnDomain(), Distro::kIron)).value();
  const auto out = node->Advertise<Bool>("/held", Quality::kOrders);
  const auto in = node->Subscribe<Bool>("/held", Quality::kOrders);
  HeldListener held;
  dds_listener_t* const listener = dds_create_listener(&held);
  dds_lset_data_available(listener, [](dds_entity_t /*reader*/, void* argument) {
    static_cast<HeldListener*>(argument)->entered.set_value();
    static_cast<HeldListener*>(argument)->release.get_future().wait();
  });
  ASSERT_EQ(dds_set_listener(in.entity(), listener), DDS_RETCODE_OK);
  std::thread publishes([&] { out.Publish({true}); });
  held.entered.get_future().wait();
  // DDS ends a reader when its listener has returned.
  std::thread withdraws([&] { node->Withdraw(in); });
  while (dds_get_parent(in.entity()) > 0) {
    std::this_thread::yield();
  }
  std::future<Status> other = std::async(std::launch::async, [&] { return node->status(); });
  EXPECT_EQ(other.wait_for(std::chrono::seconds(10)), std::future_status::ready);
  held.release.set_value();
  publishes.join();
  withdraws.join();
  EXPECT_TRUE(other.get().ok());
  dds_delete_listener(listener);
}

}  // namespace
}  // namespace pheromone::ros2
