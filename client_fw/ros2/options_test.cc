#include "client_fw/ros2/options.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

#include "server/base/testing/temporary_folder.h"

namespace pheromone::ros2 {
namespace {

BridgeOptions OneRobot() {
  BridgeOptions options;
  options.client.fail_safe_ms = 400;
  options.robots = {ParseRobot("tb1:1:5,3,-15").value()};
  options.servers = {attach::ParseAddress("udp:127.0.0.1:4951", 9600).value()};
  return options;
}

std::string Wrong(const BridgeOptions& options) {
  return CheckOptions(options).ErrorOr("");
}

TEST(RosOptions, RobotHasNamespaceIdAndStart) {
  const RobotEntry robot = ParseRobot("lab/tb7:254:5,3.5,-90").value();
  EXPECT_EQ(robot.name_space, "lab/tb7");
  EXPECT_EQ(robot.id, 254);
  EXPECT_EQ(robot.start->x_m, 5);
  EXPECT_EQ(robot.start->y_m, 3.5);
  EXPECT_DOUBLE_EQ(robot.start->heading_rad, -std::numbers::pi / 2);
  EXPECT_FALSE(ParseRobot("tb1:1").value().start);
}

TEST(RosOptions, EachMistakeInARobotIsNamed) {
  EXPECT_EQ(ParseRobot("/tb1:1").error(),
            "namespace \"/tb1\", expected letters, digits and single '_', such as tb1 or lab/tb1");
  EXPECT_EQ(ParseRobot("tb1").error(), "tb1: robot ID \"\", expected 1 to 254");
  EXPECT_EQ(ParseRobot("tb1:255").error(), "tb1: robot ID \"255\", expected 1 to 254");
  for (const char* text :
       {"tb1:1:5", "tb1:1:5,3", "tb1:1:5,3,x", "tb1:1:nan,3,0", "tb1:1:1e9,3,0"}) {
    EXPECT_NE(ParseRobot(text).error().find("expected X,Y,DEGREES in m"), std::string::npos)
        << text;
  }
}

TEST(RosOptions, OptionWithoutEffectIsAnError) {
  EXPECT_EQ(Wrong(OneRobot()), "");
  EXPECT_NE(Wrong({}).find("nothing to do"), std::string::npos);
  BridgeOptions options = OneRobot();
  options.allowed.goal = true;
  EXPECT_NE(Wrong(options).find("expected --socket"), std::string::npos);
  options.socket = "pheromoned.sock";
  EXPECT_NE(Wrong(options).find("expected --link"), std::string::npos);
  options.link = "udp";
  EXPECT_EQ(Wrong(options), "");
  options = OneRobot();
  options.link = "udp";
  EXPECT_NE(Wrong(options).find("expected --socket"), std::string::npos);
  options = OneRobot();
  options.localisation = Localisation::kTf;
  EXPECT_NE(Wrong(options).find("has a start pose"), std::string::npos);
  options.robots[0].start.reset();
  EXPECT_EQ(Wrong(options), "");
  options.localisation = Localisation::kStart;
  EXPECT_NE(Wrong(options).find("has no start pose"), std::string::npos);
  options = OneRobot();
  options.map_frame = "hall";
  EXPECT_NE(Wrong(options).find("--map-frame"), std::string::npos);
  options.socket = "pheromoned.sock";
  EXPECT_EQ(Wrong(options), "");
}

TEST(RosOptions, OptionForRobotsWithoutARobotIsAnError) {
  BridgeOptions options;
  options.client.fail_safe_ms = 400;
  options.socket = "pheromoned.sock";
  EXPECT_EQ(Wrong(options), "");
  EXPECT_EQ(CheckOptions(options, {"--track"}).error(), "--track is for robots, expected --robot");
  EXPECT_TRUE(CheckOptions(OneRobot(), {"--track", "--stamped"}).ok());
}

TEST(RosOptions, KeysAreTakenForAllRobots) {
  const TemporaryFolder folder;
  BridgeOptions options = OneRobot();
  EXPECT_TRUE(TakeRobotsKeys(options).value().keys.empty());
  options.keys = (folder / "robots.keys").string();
  EXPECT_EQ(TakeRobotsKeys(options).error().find("--keys: "), 0u);
  std::ofstream(options.keys) << "1 000102030405060708090a0b0c0d0e0f\n";
  std::filesystem::permissions(options.keys, std::filesystem::perms::owner_read);
  const keys::RobotsKeys taken = TakeRobotsKeys(options).value();
  EXPECT_EQ(taken.keys.at(1)[15], 15);
  EXPECT_EQ(taken.first_start, 1);
  options.robots.push_back(ParseRobot("tb2:9:0,0,0").value());
  EXPECT_EQ(TakeRobotsKeys(options).error(),
            "--keys: " + options.keys + ": robot 9 has no key, expected a line \"9 KEY\"");
  options.robots.pop_back();
  EXPECT_EQ(TakeRobotsKeys(options).value().first_start, 2);
}

TEST(RosOptions, RobotsDifferInNamespaceAndId) {
  BridgeOptions options = OneRobot();
  options.robots.push_back(ParseRobot("tb1:2:0,0,0").value());
  EXPECT_NE(Wrong(options), "");
  options.robots.back() = ParseRobot("tb2:1:0,0,0").value();
  EXPECT_NE(Wrong(options), "");
  options.robots.back() = ParseRobot("tb2:2:0,0,0").value();
  EXPECT_EQ(Wrong(options), "");
}

}  // namespace
}  // namespace pheromone::ros2
