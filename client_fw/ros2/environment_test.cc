#include "client_fw/ros2/environment.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace pheromone::ros2 {
namespace {

Result<Discovery> Read(const std::map<std::string, std::string>& variables) {
  return ReadEnvironment([&](const char* name) -> const char* {
    const auto found = variables.find(name);
    return found == variables.end() ? nullptr : found->second.c_str();
  });
}

std::string ConfigOf(const std::map<std::string, std::string>& variables) {
  return Read(variables).value().config;
}

TEST(Environment, WithoutVariablesDomainIsZeroAndCycloneIsLeftAlone) {
  EXPECT_EQ(Read({}).value().domain, 0u);
  EXPECT_EQ(ConfigOf({}), "");
}

TEST(Environment, DomainIsCheckedAndNamed) {
  EXPECT_EQ(Read({{"ROS_DOMAIN_ID", "30"}}).value().domain, 30u);
  for (const char* wrong : {"233", "-1", "3x", "x"}) {
    EXPECT_EQ(Read({{"ROS_DOMAIN_ID", wrong}}).error(),
              std::string("ROS_DOMAIN_ID: \"") + wrong + "\", expected a number from 0 to 232");
  }
}

TEST(Environment, LocalhostOnlyKeepsToTheLoopbackInterface) {
  for (const auto& [name, value] :
       {std::pair{"ROS_LOCALHOST_ONLY", "1"}, {"ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"}}) {
    const std::string config = ConfigOf({{name, value}});
    EXPECT_NE(config.find("<AllowMulticast>false</AllowMulticast>"), std::string::npos);
    EXPECT_NE(config.find("<Peer address=\"127.0.0.1\"/>"), std::string::npos);
  }
  EXPECT_NE(ConfigOf({{"ROS_LOCALHOST_ONLY", "1"}}).find("<NetworkInterface address=\"127.0.0.1\""),
            std::string::npos);
  EXPECT_FALSE(Read({{"ROS_LOCALHOST_ONLY", "yes"}}).ok());
}

TEST(Environment, StaticPeersAreAskedBesidesMulticast) {
  const std::string config = ConfigOf({{"ROS_STATIC_PEERS", "10.0.0.7;robot-2.local"}});
  EXPECT_NE(config.find(R"(<Peer address="10.0.0.7"/><Peer address="robot-2.local"/>)"),
            std::string::npos);
  EXPECT_EQ(config.find("AllowMulticast"), std::string::npos);
  EXPECT_FALSE(Read({{"ROS_STATIC_PEERS", "10.0.0.7\"/><x"}}).ok());
}

TEST(Environment, DiscoveryCanBeOff) {
  const std::string config =
      ConfigOf({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF"}, {"ROS_STATIC_PEERS", "10.0.0.7"}});
  EXPECT_NE(config.find("<Tag>"), std::string::npos);
  EXPECT_EQ(config.find("Peer"), std::string::npos);
  EXPECT_FALSE(Read({{"ROS_AUTOMATIC_DISCOVERY_RANGE", "EVERYWHERE"}}).ok());
}

TEST(Environment, WhatTheUserWroteForCyclonePrevails) {
  EXPECT_EQ(ConfigOf({{"CYCLONEDDS_URI", "file:///etc/cyclone.xml"}}), "file:///etc/cyclone.xml");
  EXPECT_TRUE(ConfigOf({{"ROS_LOCALHOST_ONLY", "1"}, {"CYCLONEDDS_URI", "file:///c.xml"}})
                  .ends_with("</CycloneDDS>,file:///c.xml"));
}

}  // namespace
}  // namespace pheromone::ros2
