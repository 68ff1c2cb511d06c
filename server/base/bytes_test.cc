#include "server/base/bytes.h"

#include <gtest/gtest.h>

#include <vector>

namespace pheromone {
namespace {

TEST(Bytes, NumbersAreLittleEndianAndUnpadded) {
  ByteWriter writer;
  writer.U8(0x01);
  writer.U16(0x0302);
  writer.U32(0x07060504);
  writer.U64(0x0F0E0D0C0B0A0908);
  writer.I16(-2);
  writer.I32(-3);
  writer.I64(-4);
  writer.Flag(true);
  writer.Text("ab");
  EXPECT_EQ(writer.bytes(), std::string("\x01\x02\x03\x04\x05\x06\x07\x08\x09\x0A\x0B\x0C\x0D\x0E"
                                        "\x0F\xFE\xFF\xFD\xFF\xFF\xFF\xFC\xFF\xFF\xFF\xFF\xFF\xFF"
                                        "\xFF\x01\x02\0\0\0ab",
                                        36));
}

TEST(Bytes, WhatWasWrittenIsRead) {
  ByteWriter writer;
  writer.U64(UINT64_MAX);
  writer.I64(INT64_MIN);
  writer.Text("");
  writer.Text(std::string("\0x", 2));
  writer.Flag(false);
  ByteReader reader(writer.bytes());
  EXPECT_EQ(reader.U64(), UINT64_MAX);
  EXPECT_EQ(reader.I64(), INT64_MIN);
  EXPECT_EQ(reader.Text(), "");
  EXPECT_EQ(reader.Text(), std::string("\0x", 2));
  EXPECT_FALSE(reader.Flag());
  reader.ExpectEnd();
  EXPECT_TRUE(reader.ok()) << reader.error();
}

TEST(Bytes, TheFirstFailureStaysAndGivesZeros) {
  ByteReader reader("\x07\x07");
  EXPECT_EQ(reader.U32(), 0u);
  EXPECT_EQ(reader.error(), "unexpected end of data");
  reader.Fail("something else");
  EXPECT_EQ(reader.error(), "unexpected end of data");
  EXPECT_EQ(reader.U8(), 0);
}

TEST(Bytes, AFlagIsZeroOrOneAndNothingFollowsTheEnd) {
  ByteReader two("\x02");
  EXPECT_FALSE(two.Flag());
  EXPECT_EQ(two.error(), "a flag is 2, expected at most 1");
  ByteReader more("\x01\x01");
  EXPECT_TRUE(more.Flag());
  more.ExpectEnd();
  EXPECT_EQ(more.error(), "trailing bytes");
}

TEST(Bytes, ALengthThatLiesCostsNothing) {
  ByteReader reader(std::string_view("\xFF\xFF\xFF\xFFxyz", 7));
  EXPECT_LE(reader.Text().size(), 4u);
  EXPECT_FALSE(reader.ok());
}

TEST(Bytes, PortionsMakeTheSameBytes) {
  std::string streamed;
  std::vector<std::string> portions;
  ByteWriter all;
  ByteWriter writer([&](std::string_view portion) { portions.emplace_back(portion); });
  for (uint64_t i = 0; i < 20'000; ++i) {
    all.U64(i * i);
    writer.U64(i * i);
  }
  writer.Flush();
  EXPECT_GT(portions.size(), 2u);
  size_t next = 0;
  ByteReader reader([&]() -> std::string_view {
    return next < portions.size() ? std::string_view(portions[next++]) : std::string_view();
  });
  for (uint64_t i = 0; i < 20'000; ++i) {
    ASSERT_EQ(reader.U64(), i * i);
  }
  reader.ExpectEnd();
  EXPECT_TRUE(reader.ok());
  for (const std::string& portion : portions) {
    streamed += portion;
  }
  EXPECT_EQ(streamed, all.bytes());
}

}  // namespace
}  // namespace pheromone
