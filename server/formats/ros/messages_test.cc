#include "server/formats/ros/messages.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace pheromone::ros {
namespace {

using std::string_literals::operator""s;

// By hand from the XCDR1 rules of DDS-XTypes 7.4 and the definitions of the types.
TEST(RosMessagesTest, APoseIsAlignedCdr) {
  const std::string expected =
      "\x00\x01\x00\x00"                    // CDR, little-endian
      "\x02\x00\x00\x00\x03\x00\x00\x00"    // 2 s, 3 ns
      "\x04\x00\x00\x00map\x00"             // with its zero byte
      "\x00\x00\x00\x00\x00\x00\xF8\x3F"    // at 16: x = 1.5
      "\x00\x00\x00\x00\x00\x00\xE0\xBF"    // y = -0.5
      "\x00\x00\x00\x00\x00\x00\x00\x00"    // z
      "\x00\x00\x00\x00\x00\x00\x00\x00"    // of the quaternion x
      "\x00\x00\x00\x00\x00\x00\x00\x00"    // y
      "\x00\x00\x00\x00\x00\x00\x00\x00"    // z
      "\x00\x00\x00\x00\x00\x00\xF0\x3F"s;  // w = 1
  EXPECT_EQ(EncodePose(2'000'000'003, {.x_m = 1.5, .y_m = -0.5}), expected);
}

TEST(RosMessagesTest, TransformsArePaddedWhereTheirNamesEnd) {
  const std::string message = EncodeTransforms(1, {{.child = "abcde", .pose = {}}});
  // Count 4, time 8, "map" 8, the name's length 4, "abcde" and zero 6: 30, padded to 32; 7 doubles.
  EXPECT_EQ(message.size(), 4U + 32 + 56);
  EXPECT_EQ(message.substr(4 + 24, 8), "abcde\0\0\0"s);
  EXPECT_EQ(EncodeTransforms(1, {}), "\x00\x01\x00\x00\x00\x00\x00\x00"s);
}

TEST(RosMessagesTest, AGridHasItsCellsAtTheEnd) {
  const std::string message =
      EncodeGrid(0, {.columns = 2, .cell_m = 0.5, .x_m = 1, .y_m = 2}, "\x01\xFF\x03\x04\x05\x06");
  // Header 16, time 8, f32 4, u32 4 and 4: 36, padded to 40; 56; count 4, cells 6.
  ASSERT_EQ(message.size(), 4U + 40 + 56 + 4 + 6);
  EXPECT_EQ(message.substr(4 + 24, 12), "\x00\x00\x00\x3F\x02\x00\x00\x00\x03\x00\x00\x00"s);
  EXPECT_EQ(message.substr(4 + 96), "\x06\x00\x00\x00\x01\xFF\x03\x04\x05\x06"s);
}

}  // namespace
}  // namespace pheromone::ros
