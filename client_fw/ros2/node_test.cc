#include "client_fw/ros2/node.h"

#include <gtest/gtest.h>
#include <unistd.h>

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

TEST(Node, DistroDecidesTheSizeOfGids) {
  const auto node = std::move(Node::Create(OwnDomain(), Distro::kHumble)).value();
  EXPECT_EQ(node->gid_size(), 24u);
}

TEST(Node, WithoutAnotherNodeTheSizeOfGidsIsNotKnown) {
  const auto node = std::move(Node::Create(OwnDomain(), Distro::kAuto)).value();
  node->Step();
  EXPECT_EQ(node->gid_size(), 0u);
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

}  // namespace
}  // namespace pheromone::ros2
