#include "client_fw/tracker/settings.h"

#include <gtest/gtest.h>

#include <string>

#include "client_fw/tracker/testing/settings.h"

namespace pheromone::tracker {
namespace {

// SettingsOfTheScene with one text in place of another.
std::string ErrorWith(const std::string& old_text, const std::string& new_text) {
  std::string text = SettingsOfTheScene();
  text.replace(text.find(old_text), old_text.size(), new_text);
  return ParseSettings(text, "c.toml").ErrorOr("");
}

void ExpectError(const std::string& old_text, const std::string& new_text,
                 const std::string& expected) {
  const std::string error = ErrorWith(old_text, new_text);
  EXPECT_NE(error.find(expected), std::string::npos) << error;
}

TEST(SettingsTest, AreRead) {
  const auto settings = ParseSettings(SettingsOfTheScene(), "c.toml");
  ASSERT_TRUE(settings.ok()) << settings.error();
  EXPECT_EQ(ToText(settings.value().server), "127.0.0.1:4960");
  EXPECT_EQ(settings.value().device, "/dev/video0");
  EXPECT_EQ(settings.value().width, 1280);
  EXPECT_EQ(settings.value().lens.k1, -0.15);
  ASSERT_EQ(settings.value().floor.size(), 6u);
  EXPECT_EQ(settings.value().floor[1].tag, 501);
  EXPECT_EQ(settings.value().floor[1].place, Point(0.2, 2.85));
  EXPECT_NEAR(settings.value().floor[1].heading_rad, 0.5, 1e-6);
  ASSERT_EQ(settings.value().robots.size(), 12u);
  EXPECT_EQ(settings.value().robots[6].id, 7);  // that of its tag
}

TEST(SettingsTest, ErrorsSayWhereWhatAndWhatWasExpected) {
  ExpectError("tag = 501", "tag = 500",
              "floor_tag[2].tag: found 500 again, expected each tag once");
  ExpectError("tag = 7\n", "tag = 6\n", "robot[7].tag: found 6 again");
  ExpectError("tag = 7\n", "tag = 400\n", "robot[7].id: ");
  ExpectError("tag = 7\n", "tag = 40\nid = 6\n", "found robot 6 of link \"radio-a\" again");
  ExpectError("tag = 501", "tag = 587", "c.toml:20:7: floor_tag[2].tag: found 587");
  ExpectError("width_px = 1280\n", "", "camera.width_px");
  ExpectError("4960", "0", "expected the port on which the [[tracker]] listens");
  ExpectError("[tags]", "[tag]", "tags");
  ExpectError("radio-a", "radio a", "at most 32 letters");
}

// Sheets are printed before the lens is known.
TEST(SettingsTest, MayLackTheLens) {
  std::string text = SettingsOfTheScene();
  text.erase(text.find("focal_px"), std::string("focal_px = 900\n").size());
  const auto settings = ParseSettings(text, "c.toml");
  ASSERT_TRUE(settings.ok()) << settings.error();
  EXPECT_FALSE(CheckLens(settings.value()).ok());
}

TEST(SettingsTest, NeedThreeFloorTagsAndARobot) {
  const std::string error =
      ParseSettings("[server]\ntracker = \"127.0.0.1:1\"\n", "c.toml").ErrorOr("");
  EXPECT_NE(error.find("floor_tag: found 0, expected at least 3"), std::string::npos) << error;
  EXPECT_NE(error.find("robot: found none"), std::string::npos) << error;
}

}  // namespace
}  // namespace pheromone::tracker
