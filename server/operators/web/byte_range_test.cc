#include "server/operators/web/byte_range.h"

#include <gtest/gtest.h>

namespace pheromone::web {
namespace {

using Kind = ByteRange::Kind;

ByteRange Part(uint64_t first, uint64_t count) {
  return {Kind::kPart, first, count};
}

// The examples of RFC 9110, section 14.1.2, for 10 000 bytes.
TEST(ByteRange, TheExamplesOfTheRfc) {
  EXPECT_EQ(ParseRange("bytes=0-499", 10'000), Part(0, 500));
  EXPECT_EQ(ParseRange("bytes=500-999", 10'000), Part(500, 500));
  EXPECT_EQ(ParseRange("bytes=-500", 10'000), Part(9500, 500));
  EXPECT_EQ(ParseRange("bytes=9500-", 10'000), Part(9500, 500));
  EXPECT_EQ(ContentRange(Part(500, 500), 10'000), "bytes 500-999/10000");
}

TEST(ByteRange, EndsAtTheEndOfTheFile) {
  EXPECT_EQ(ParseRange("bytes=9000-20000", 10'000), Part(9000, 1000));
  EXPECT_EQ(ParseRange("bytes=9999-99999999999999999999999", 10'000), Part(9999, 1));
  EXPECT_EQ(ParseRange("bytes=-20000", 10'000), Part(0, 10'000));
}

TEST(ByteRange, BeyondTheEndIsUnsatisfiable) {
  for (const char* header : {"bytes=10000-", "bytes=10000-10001", "bytes=-0",
                             "bytes=99999999999999999999999-99999999999999999999999"}) {
    const ByteRange range = ParseRange(header, 10'000);
    EXPECT_EQ(range.kind, Kind::kUnsatisfiable) << header;
    EXPECT_EQ(ContentRange(range, 10'000), "bytes */10000");
  }
  EXPECT_EQ(ParseRange("bytes=0-", 0).kind, Kind::kUnsatisfiable);
  EXPECT_EQ(ParseRange("bytes=-5", 0).kind, Kind::kUnsatisfiable);
}

TEST(ByteRange, OtherHeadersMeanTheWholeFile) {
  for (const char* header :
       {"", "bytes", "bytes=", "bytes=-", "bytes=a-b", "bytes=5-4", "bytes=0-1,4-5", "lines=1-2",
        "bytes=1-2x", "bytes=+1-2", "bytes=--5", "bytes=0x1-2", "bytes= - 5"}) {
    EXPECT_EQ(ParseRange(header, 100), (ByteRange{Kind::kWhole, 0, 100})) << header;
  }
}

}  // namespace
}  // namespace pheromone::web
