#include "server/cluster/etcd_format.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace pheromone::cluster {
namespace {

using namespace std::string_view_literals;

// Made by Python's struct and a CRC-32C written from its definition.
constexpr std::string_view kInline =
    "\x01\x03\x00\x00\x00\x07\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00\x47\x78\x84\x6e"
    "\x00\xff"
    "abc"sv;
const Group kInlineGroup{0x1a2b, 3, 7,
                         std::string("\x00\xff"
                                     "abc",
                                     5)};
constexpr std::string_view kInPieces =
    "\x01\x02\x00\x00\x00\x09\x00\x00\x00\x00\x00\x00\x00\x03\x00\x00\x00\x4e\x9d\xb9\x8f"sv;

Group LargeGroup() {
  Group group{16, 2, 9, std::string(2'500'000, '\0')};
  for (size_t i = 0; i < group.records.size(); ++i) {
    group.records[i] = static_cast<char>((i * 7 + i / 251) & 0xff);
  }
  return group;
}

std::string ErrorOfDecoding(Sequence first, std::string_view value) {
  const Result<StoredGroup> stored = DecodeGroup(first, value);
  return stored.ok() ? "decoded" : std::string(stored.error());
}

TEST(EtcdFormatTest, KeysSortAsSequences) {
  const EtcdKeys keys("lab");
  EXPECT_EQ(keys.leader(), "/pheromone/lab/leader");
  EXPECT_EQ(keys.Log(0x1a2b), "/pheromone/lab/log/0000000000001a2b");
  EXPECT_LT(keys.Log(9), keys.Log(10));
  EXPECT_LT(keys.Log(0xffff), keys.Log(0x10000));
  EXPECT_LT(keys.Log(~Sequence{0}), keys.log_end());
  EXPECT_EQ(keys.Piece({16, 2, 9, ""}, 10),
            "/pheromone/lab/piece/0000000000000010/0000000000000009/000a");
  EXPECT_LT(keys.Piece({15, 2, 9, ""}, 0x12345), keys.PiecesOf(16));
  EXPECT_GT(keys.Piece({16, 2, 9, ""}, 0), keys.PiecesOf(16));
  for (const std::string& key : {keys.leader(), keys.id(), keys.floor(), keys.Log(5)}) {
    EXPECT_GE(key, keys.watch_begin());
    EXPECT_LT(key, keys.watch_end());
  }
  EXPECT_GE(keys.PiecesOf(0), keys.watch_end());
}

TEST(EtcdFormatTest, AGroupsKeyHasItsSequence) {
  const EtcdKeys keys("lab");
  ASSERT_TRUE(keys.FirstOf("/pheromone/lab/log/0000000000001a2b"));
  EXPECT_EQ(keys.FirstOf("/pheromone/lab/log/0000000000001a2b")->value(), 0x1a2bu);
  EXPECT_FALSE(keys.FirstOf("/pheromone/lab/leader"));
  EXPECT_FALSE(keys.FirstOf("/pheromone/lab2/log/0000000000001a2b"));
  for (const char* const bad :
       {"", "0", "0000000000001A2B", "0000000000001a2b0", "000000000000 a2b", "000000000000+a2b"}) {
    const auto first = keys.FirstOf("/pheromone/lab/log/" + std::string(bad));
    ASSERT_TRUE(first) << bad;
    EXPECT_FALSE(first->ok()) << bad;
  }
}

TEST(EtcdFormatTest, ASmallGroupIsOneValue) {
  const EtcdKeys keys("lab");
  const std::vector<KeyAndValue> entries = EncodeGroup(keys, kInlineGroup);
  ASSERT_EQ(entries.size(), 1u);
  EXPECT_EQ(entries[0].key, "/pheromone/lab/log/0000000000001a2b");
  EXPECT_EQ(entries[0].value, kInline);
  const Result<StoredGroup> stored = DecodeGroup(0x1a2b, kInline);
  ASSERT_TRUE(stored.ok()) << stored.error();
  EXPECT_EQ(stored.value().group, kInlineGroup);
  EXPECT_EQ(stored.value().pieces, 0u);
  EXPECT_EQ(stored.value().end(), 0x1a2eu);
}

TEST(EtcdFormatTest, ALargeGroupIsInPiecesThatAreWrittenFirst) {
  const EtcdKeys keys("lab");
  const Group group = LargeGroup();
  const std::vector<KeyAndValue> entries = EncodeGroup(keys, group);
  ASSERT_EQ(entries.size(), 4u);
  std::string records;
  for (uint32_t i = 0; i < 3; ++i) {
    EXPECT_EQ(entries[i].key, keys.Piece(group, i));
    EXPECT_LE(entries[i].value.size(), size_t{1} << 20);
    records += entries[i].value;
  }
  EXPECT_TRUE(records == group.records);
  EXPECT_EQ(entries[3].key, keys.Log(16));
  EXPECT_EQ(entries[3].value, kInPieces);

  const Result<StoredGroup> stored = DecodeGroup(16, kInPieces);
  ASSERT_TRUE(stored.ok()) << stored.error();
  EXPECT_EQ(stored.value().pieces, 3u);
  StoredGroup complete = stored.value();
  complete.group.records = group.records;
  EXPECT_TRUE(CheckGroup(complete).ok());
  complete.group.records[2'000'000] ^= 1;
  EXPECT_FALSE(CheckGroup(complete).ok());
}

TEST(EtcdFormatTest, EveryDamageOfAGroupIsNoticed) {
  for (size_t size = 0; size < kInline.size(); ++size) {
    EXPECT_FALSE(DecodeGroup(0x1a2b, kInline.substr(0, size)).ok()) << size;
  }
  for (size_t bit = 0; bit < 8 * kInline.size(); ++bit) {
    std::string damaged(kInline);
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    EXPECT_FALSE(DecodeGroup(0x1a2b, damaged).ok()) << bit;
  }
  EXPECT_FALSE(DecodeGroup(0x1a2c, kInline).ok()) << "a group at the place of another";
  EXPECT_FALSE(DecodeGroup(0x1a2b, std::string(kInline) + "x").ok());
  EXPECT_FALSE(DecodeGroup(16, std::string(kInPieces) + "x").ok());
}

TEST(EtcdFormatTest, ErrorsSayWhatWasExpected) {
  EXPECT_EQ(ErrorOfDecoding(1, ""), "a group of 0 bytes, expected at least 21");
  std::string value(kInline);
  value[0] = 2;
  EXPECT_EQ(ErrorOfDecoding(0x1a2b, value), "a group of version 2, expected 1");
  value = kInline;
  value[1] = 0;
  EXPECT_EQ(ErrorOfDecoding(0x1a2b, value), "a group of 0 events, expected at least 1");
  EXPECT_EQ(ErrorOfDecoding(0, kInline),
            "a group of 3 events from 0, expected sequences from 1 to 2^64 - 2");
  EXPECT_EQ(ErrorOfDecoding(~Sequence{2}, kInline),
            "a group of 3 events from 18446744073709551613, expected sequences from 1 to 2^64 - 2");
  value = kInline;
  value.back() = 'd';
  EXPECT_TRUE(ErrorOfDecoding(0x1a2b, value).starts_with("the checksum is 6e847847, expected "))
      << ErrorOfDecoding(0x1a2b, value);
}

}  // namespace
}  // namespace pheromone::cluster
