#include "client_fw/core/steering/settings.h"

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
    {7, 0, 1000, [](const Settings& s) { return int{s.speed_mm_s}; }},
    {8, 0, 2000, [](const Settings& s) { return int{s.period_ms}; }},
    {9, 100, 2000, [](const Settings& s) { return int{s.fail_safe_ms}; }},
    {10, 0, 30000, [](const Settings& s) { return int{s.lost_after_ms}; }},
    {11, 100, 30000, [](const Settings& s) { return int{s.drive_scale}; }},
    {12, 0, 1, [](const Settings& s) { return int{s.start_released}; }},
    {13, 0, 1, [](const Settings& s) { return int{s.bumpers}; }},
    {14, 0, 1, [](const Settings& s) { return int{s.sonar}; }},
    {15, 0, 255, [](const Settings& s) { return int{s.low_battery_100mv}; }},
    {16, 0, 500, [](const Settings& s) { return int{s.ptt_lead_ms}; }},
    {17, 0, 500, [](const Settings& s) { return int{s.ptt_tail_ms}; }},
};

// Settings with which every value of every row fits.
Settings Slow() {
  Settings settings;
  settings.speed_mm_s = 100;
  settings.period_ms = 0;
  settings.fail_safe_ms = 1000;
  return settings;
}

TEST(SettingsTest, EachIdWritesAndReadsItsOwnFieldAndNoOther) {
  for (const Row& row : kRows) {
    for (const int value : {row.least, row.most}) {
      Settings settings = Slow();
      settings.fail_safe_ms = row.id == 8 ? 2000 : 1000;
      if (row.id == 8 && value == 2000) {
        continue;  // the fail-safe time has to be longer
      }
      const Settings before = settings;
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
  for (const uint8_t id : {uint8_t{0}, uint8_t{18}, uint8_t{127}, uint8_t{255}}) {
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

TEST(SettingsTest, ARobotIsHaltedAtStartUnlessItsSettingsSayOtherwise) {
  EXPECT_FALSE(Settings().start_released);
}

TEST(SettingsTest, ThePeriodIsShorterThanTheFailSafeTime) {
  Settings settings;
  settings.fail_safe_ms = 480;
  EXPECT_FALSE(WriteSetting(kPeriodSetting, 480, &settings));
  EXPECT_EQ(200, settings.period_ms);
  EXPECT_TRUE(WriteSetting(kPeriodSetting, 479, &settings));
  EXPECT_FALSE(WriteSetting(kFailSafeSetting, 479, &settings));
  EXPECT_EQ(480, settings.fail_safe_ms);
  EXPECT_TRUE(WriteSetting(kFailSafeSetting, 2000, &settings));
}

TEST(SettingsTest, ARobotThatHearsNothingDrivesAMetreAtMost) {
  Settings settings;
  settings.speed_mm_s = 500;
  settings.fail_safe_ms = 2000;
  EXPECT_FALSE(WriteSetting(kSpeedSetting, 501, &settings));
  EXPECT_EQ(500, settings.speed_mm_s);
  EXPECT_TRUE(WriteSetting(kFailSafeSetting, 1000, &settings));
  EXPECT_TRUE(WriteSetting(kSpeedSetting, 1000, &settings));
  EXPECT_FALSE(WriteSetting(kFailSafeSetting, 1001, &settings));
  EXPECT_EQ(1000, settings.fail_safe_ms);
}

TEST(SettingsTest, StoredTheyAreTwoBytesEachInTheOrderOfTheIds) {
  Settings settings;
  for (const Row& row : kRows) {
    if (row.id != 8 && row.id != 9 && row.id != 7) {
      ASSERT_TRUE(WriteSetting(row.id, static_cast<uint32_t>(row.most), &settings));
    }
  }
  uint8_t bytes[kSettingsSize];
  PackSettings(settings, bytes);
  ASSERT_EQ(2 * (sizeof(kRows) / sizeof(kRows[0])), sizeof(bytes));
  for (const Row& row : kRows) {
    EXPECT_EQ(row.get(settings), bytes[2 * row.id - 2] + 256 * bytes[2 * row.id - 1]);
  }
  Settings found;
  ASSERT_TRUE(UnpackSettings(bytes, &found));
  for (const Row& row : kRows) {
    EXPECT_EQ(row.get(settings), row.get(found)) << int{row.id};
  }
}

TEST(SettingsTest, StoredValuesThatARobotMustNotHaveAreRefused) {
  for (const Row& row : kRows) {
    uint8_t bytes[kSettingsSize];
    PackSettings(Slow(), bytes);
    bytes[2 * row.id - 1] = 0xFF;
    Settings found = Slow();
    EXPECT_FALSE(UnpackSettings(bytes, &found)) << int{row.id};
    for (const Row& other : kRows) {
      EXPECT_EQ(other.get(found), other.get(Slow())) << int{row.id} << ' ' << int{other.id};
    }
  }
  Settings blind;
  blind.speed_mm_s = 1000;
  blind.fail_safe_ms = 2000;
  uint8_t bytes[kSettingsSize];
  PackSettings(blind, bytes);
  EXPECT_FALSE(UnpackSettings(bytes, &blind));
}

}  // namespace
}  // namespace client
}  // namespace pheromone
