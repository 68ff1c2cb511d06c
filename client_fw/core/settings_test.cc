#include "client_fw/core/settings.h"

#include <gtest/gtest.h>

namespace pheromone {
namespace client {
namespace {

// The specification again, by hand: id, least and greatest value, and where it is.
struct Row {
  uint8_t id;
  int least;
  int most;
  int (*get)(const Settings&);
};

const Row kRows[] = {
    {1, 1, 15, [](const Settings& s) { return int{s.type}; }},
    {2, 0, 3, [](const Settings& s) { return static_cast<int>(s.law); }},
    {3, 0, 1, [](const Settings& s) { return static_cast<int>(s.lay_trail); }},
    {4, 0, 3, [](const Settings& s) { return static_cast<int>(s.lost_trail); }},
    {5, 0, 29, [](const Settings& s) { return int{s.gain_8ths}; }},
    {6, 0, 255, [](const Settings& s) { return int{s.faintest}; }},
    {7, 0, 2200, [](const Settings& s) { return int{s.speed_mm_s}; }},
    {8, 0, 30000, [](const Settings& s) { return int{s.period_ms}; }},
    {9, 100, 30000, [](const Settings& s) { return int{s.fail_safe_ms}; }},
    {10, 0, 30000, [](const Settings& s) { return int{s.lost_after_ms}; }},
    {11, 100, 30000, [](const Settings& s) { return int{s.drive_scale}; }},
};

TEST(SettingsTest, EachIdWritesAndReadsItsOwnFieldAndNoOther) {
  for (const Row& row : kRows) {
    for (const int value : {row.least, row.most}) {
      Settings settings;
      const Settings before;
      ASSERT_TRUE(WriteSetting(row.id, static_cast<uint32_t>(value), &settings));
      for (const Row& other : kRows) {
        EXPECT_EQ(other.id == row.id ? value : other.get(before), other.get(settings))
            << int{row.id} << ' ' << int{other.id};
      }
      int16_t read = -1;
      ASSERT_TRUE(ReadSetting(row.id, settings, &read));
      EXPECT_EQ(value, read);
    }
  }
}

TEST(SettingsTest, ValueOutOfRangeIsRefusedAndChangesNothing) {
  for (const Row& row : kRows) {
    for (const uint32_t value :
         {static_cast<uint32_t>(row.least - 1), static_cast<uint32_t>(row.most + 1), 0x10001u,
          0xFFFFFFFFu, 0x80000000u}) {
      Settings settings;
      EXPECT_FALSE(WriteSetting(row.id, value, &settings)) << int{row.id} << ' ' << value;
      EXPECT_EQ(row.get(Settings()), row.get(settings));
    }
  }
}

TEST(SettingsTest, UnknownIdIsRefused) {
  for (const uint8_t id : {uint8_t{0}, uint8_t{12}, uint8_t{127}, uint8_t{255}}) {
    Settings settings;
    int16_t value = 77;
    EXPECT_FALSE(WriteSetting(id, 1, &settings));
    EXPECT_FALSE(ReadSetting(id, settings, &value));
    EXPECT_EQ(77, value);
  }
}

TEST(SettingsTest, DefaultsAreInRange) {
  for (const Row& row : kRows) {
    EXPECT_GE(row.get(Settings()), row.least) << int{row.id};
    EXPECT_LE(row.get(Settings()), row.most) << int{row.id};
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
