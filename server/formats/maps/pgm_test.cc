#include "server/formats/maps/pgm.h"

#include <gtest/gtest.h>

#include <array>

#include "server/formats/maps/testing/rasters.h"

namespace pheromone::maps {
namespace {

using testing::ErrorOf;
using testing::kNaN;
using testing::RasterOf;
using testing::Rows;
using testing::RowsOf;

std::string Text(std::string_view bytes) {
  return ErrorOf(ParsePgm(bytes, "a.pgm"));
}

TEST(Pgm, BinaryIsReadFromTheTopRowDown) {
  const auto image = ParsePgm(std::string_view("P5 3 2 255\n\x00\x01\x02\xFD\xFE\xFF", 17), "a");
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(image.value().maximum, 255);
  EXPECT_EQ(RowsOf(image.value().raster), (Rows{{0, 1, 2}, {253, 254, 255}}));
}

TEST(Pgm, SixteenBitsComeWithTheHighByteFirst) {
  const auto image = ParsePgm(std::string_view("P5\n1 2\n1000\n\x03\xE8\x00\x0A", 16), "a");
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(image.value().maximum, 1000);
  EXPECT_EQ(RowsOf(image.value().raster), (Rows{{1000}, {10}}));
}

TEST(Pgm, OfTextIsReadWhateverTheLayout) {
  const auto image = ParsePgm("P2#by hand\n3\t2 # size\r\n7\n0 1 2 3 # half\n\n4\n7", "a");
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(image.value().maximum, 7);
  EXPECT_EQ(RowsOf(image.value().raster), (Rows{{0, 1, 2}, {3, 4, 7}}));
}

TEST(Pgm, APixelThatLooksLikeBlankOrCommentIsAPixel) {
  const auto image = ParsePgm("P5 #c\n2 1 255\n #", "a");
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(RowsOf(image.value().raster), (Rows{{' ', '#'}}));
}

TEST(Pgm, IsWrittenAsOtherProgramsExpectIt) {
  EXPECT_EQ(EncodePgm({RasterOf({{0, 1, 255}, {32, 10, 65}}), 255}),
            std::string("P5\n3 2\n255\n\x00\x01\xFF \nA", 17));
  EXPECT_EQ(EncodePgm({RasterOf({{0, 1000}}), 1000}),
            std::string("P5\n2 1\n1000\n\0\0\x03\xE8", 16));
}

TEST(Pgm, LevelsThatItCannotHoldBecomeTheNearestItCan) {
  EXPECT_EQ(EncodePgm({RasterOf({{kNaN, -3, 64.6, 300}}), 255}),
            std::string("P5\n4 1\n255\n\x00\x00"
                        "A\xFF",
                        15));
}

TEST(Pgm, ComesBackAsItWasWritten) {
  for (uint32_t seed = 0; seed < 60; ++seed) {
    const uint16_t maximum = std::array<uint16_t, 6>{1, 7, 255, 256, 1000, 65535}[seed % 6];
    const GrayImage image = testing::RandomGray(seed, maximum);
    const auto back = ParsePgm(EncodePgm(image), "a");
    ASSERT_TRUE(back.ok()) << back.error();
    EXPECT_EQ(back.value().maximum, maximum);
    EXPECT_TRUE(testing::Same(back.value().raster, image.raster)) << seed;
  }
}

TEST(Pgm, NoBeginningIsTakenForTheWhole) {
  testing::ExpectEveryBeginningRefused(EncodePgm(testing::RandomGray(1, 255)), ParsePgm);
  testing::ExpectEveryBeginningRefused(EncodePgm(testing::RandomGray(2, 65535)), ParsePgm);
  testing::ExpectEveryBeginningRefused("P2 2 2 9\n1 2\n3 4", ParsePgm);
}

TEST(Pgm, ErrorsSayWhereAndWhat) {
  EXPECT_EQ(Text("P6 1 1 255 x"),
            "a.pgm: byte 0: found \"P6\", expected P5 or P2, as a PGM begins");
  EXPECT_EQ(Text("P51 1 255 x"), "a.pgm:1:3: expected white space after P5");
  EXPECT_EQ(Text("P5\n# hm\n 12 x4 255 "),
            "a.pgm:3:5: found \"x4\", expected the height, 1 to 30000");
  EXPECT_EQ(Text("P5 0 1 255 "), "a.pgm:1:4: found \"0\", expected the width, 1 to 30000");
  EXPECT_EQ(Text("P5 1 1 65536 "),
            "a.pgm:1:8: found \"65536\", expected the white level, 1 to 65535");
  EXPECT_EQ(Text("P5 1"), "a.pgm:1:5: found the end, expected the height, 1 to 30000");
  EXPECT_EQ(Text("P5 2 2 255 abc"), "a.pgm: byte 11: found 3 bytes of pixels, expected 4");
  EXPECT_EQ(Text("P5 2 2 255 abcde"), "a.pgm: byte 11: found 5 bytes of pixels, expected 4");
  EXPECT_EQ(Text("P5 2 1 65 A!"), "no error");
  EXPECT_EQ(Text("P5 2 1 65 AB"), "a.pgm: byte 11: found level 66, expected at most 65");
  EXPECT_EQ(Text("P2 2 1 9\n3\n10"), "a.pgm:3:1: found \"10\", expected a level, 0 to 9");
  EXPECT_EQ(Text("P2 2 1 9\n3 -1"), "a.pgm:2:3: found \"-1\", expected a level, 0 to 9");
  EXPECT_EQ(Text("P2 2 1 9\n3 4\n5"), "a.pgm:3:1: found more than 2 levels, expected the end");
}

TEST(Pgm, AHugeClaimIsRefusedFromTheHeader) {
  EXPECT_EQ(Text("P5 99999999999999999999 1 255 "),
            "a.pgm:1:4: found \"99999999999999999999\", expected the width, 1 to 30000");
  EXPECT_EQ(Text("P5 30000 30000 255 x"),
            "a.pgm:1:19: found 30000 columns and 30000 rows, expected 1 to 30000 of each and at "
            "most 67108864 cells");
  EXPECT_EQ(Text("P2 8000 8000 255 1 2 3"),
            "a.pgm:1:17: the rest of the file is too short for 64000000 levels");
}

}  // namespace
}  // namespace pheromone::maps
