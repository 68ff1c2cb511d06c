#include "server/formats/maps/png_picture.h"

#include <gtest/gtest.h>

#include "server/formats/maps/testing/rasters.h"

namespace pheromone::maps {
namespace {

using testing::ErrorOf;
using testing::kNaN;
using testing::RasterOf;
using testing::Rows;
using testing::RowsOf;

enum ColourType : char { kGray = 0, kRgb = 2, kPalette = 3, kGrayAlpha = 4, kRgba = 6 };

std::string BigEndian(size_t number, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) {
    text += static_cast<char>(number >> (8 * i) & 0xFF);
  }
  return text;
}

// PNG, ISO/IEC 15948, annex D, a bit at a time.
size_t Crc(const std::string& bytes) {
  size_t crc = 0xFFFFFFFF;
  for (const char byte : bytes) {
    crc ^= static_cast<uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 1) != 0 ? crc >> 1 ^ 0xEDB88320 : crc >> 1;
    }
  }
  return crc ^ 0xFFFFFFFF;
}

std::string Chunk(const std::string& kind, const std::string& data) {
  return BigEndian(data.size(), 4) + kind + data + BigEndian(Crc(kind + data), 4);
}

// zlib, RFC 1950 and 1951, in one stored block.
std::string Deflated(const std::string& data) {
  size_t a = 1;
  size_t b = 0;
  for (const char byte : data) {
    a = (a + static_cast<uint8_t>(byte)) % 65521;
    b = (b + a) % 65521;
  }
  const std::string size = {static_cast<char>(data.size() & 0xFF),
                            static_cast<char>(data.size() >> 8)};
  const std::string complement = {static_cast<char>(~size[0]), static_cast<char>(~size[1])};
  return "\x78\x01\x01" + size + complement + data + BigEndian(b << 16 | a, 4);
}

// A file written by hand. `scanlines` has a filter byte before each row; `between` are chunks that
// go before the pixels.
std::string Png(size_t columns, size_t rows, char depth, ColourType type,
                const std::string& scanlines, const std::string& between = "", char interlace = 0) {
  return "\x89PNG\r\n\x1A\n" +
         Chunk("IHDR", BigEndian(columns, 4) + BigEndian(rows, 4) + depth +
                           static_cast<char>(type) + std::string(2, '\0') + interlace) +
         between + Chunk("IDAT", Deflated(scanlines)) + Chunk("IEND", "");
}

std::string Polyline(std::initializer_list<int> bytes) {
  std::string text(1, '\0');  // filter 0: none
  for (const int byte : bytes) {
    text += static_cast<char>(byte);
  }
  return text;
}

void ExpectLevels(const std::string& bytes, uint16_t maximum, const Rows& expected) {
  const auto image = ParsePng(bytes, "a");
  ASSERT_TRUE(image.ok()) << image.error();
  EXPECT_EQ(image.value().maximum, maximum);
  EXPECT_TRUE(testing::Same(image.value().raster, RasterOf(expected)))
      << ::testing::PrintToString(RowsOf(image.value().raster));
}

TEST(Png, GrayIsReadFromTheTopRowDown) {
  ExpectLevels(Png(2, 2, 8, kGray, Polyline({0, 1}) + Polyline({254, 255})), 255,
               {{0, 1}, {254, 255}});
  ExpectLevels(Png(2, 1, 16, kGray, Polyline({1, 2, 255, 255})), 65535, {{258, 65535}});
}

TEST(Png, FewerBitsAreSpreadSoThatWhiteStaysWhite) {
  ExpectLevels(Png(4, 1, 1, kGray, Polyline({0b10100000})), 255, {{255, 0, 255, 0}});
  ExpectLevels(Png(4, 1, 2, kGray, Polyline({0b00011011})), 255, {{0, 85, 170, 255}});
  ExpectLevels(Png(2, 1, 4, kGray, Polyline({0x1F})), 255, {{17, 255}});
}

TEST(Png, AColourIsTheMeanOfItsChannels) {
  ExpectLevels(Png(2, 1, 8, kRgb, Polyline({10, 20, 60, 255, 255, 254})), 255, {{30, 764.0 / 3}});
  ExpectLevels(Png(1, 1, 16, kRgb, Polyline({1, 0, 2, 0, 3, 0})), 65535, {{512}});
  const std::string palette = Chunk("PLTE", std::string("\x03\x06\x09\xFF\xFF\xFF", 6));
  ExpectLevels(Png(3, 1, 8, kPalette, Polyline({1, 0, 1}), palette), 255, {{255, 6, 255}});
}

TEST(Png, WhatIsNotOpaqueIsUnknown) {
  ExpectLevels(Png(3, 1, 8, kGrayAlpha, Polyline({9, 255, 9, 254, 9, 0})), 255, {{9, kNaN, kNaN}});
  ExpectLevels(Png(2, 1, 8, kRgba, Polyline({1, 2, 3, 255, 1, 2, 3, 128})), 255, {{2, kNaN}});
  ExpectLevels(Png(2, 1, 16, kGrayAlpha, Polyline({1, 0, 255, 255, 1, 0, 255, 254})), 65535,
               {{256, kNaN}});
  const std::string transparent = Chunk("tRNS", std::string("\0\x07", 2));
  ExpectLevels(Png(2, 1, 8, kGray, Polyline({7, 8}), transparent), 255, {{kNaN, 8}});
}

TEST(Png, InterlacedIsReadWhole) {
  // Adam7 of 2 x 2: pass 1 has the upper left pixel, pass 6 the upper right, pass 7 the lower row.
  ExpectLevels(Png(2, 2, 8, kGray, Polyline({1}) + Polyline({2}) + Polyline({3, 4}), "", 1), 255,
               {{1, 2}, {3, 4}});
}

TEST(Png, GrayComesBackAsItWasWritten) {
  for (uint32_t seed = 0; seed < 40; ++seed) {
    const GrayImage image = testing::RandomGray(seed, seed % 2 == 0 ? 255 : 65535);
    const auto bytes = EncodeGrayPng(image);
    ASSERT_TRUE(bytes.ok()) << bytes.error();
    const auto back = ParsePng(bytes.value(), "a");
    ASSERT_TRUE(back.ok()) << back.error();
    EXPECT_EQ(back.value().maximum, image.maximum);
    EXPECT_TRUE(testing::Same(back.value().raster, image.raster)) << seed;
  }
}

TEST(Png, OtherMaximaAreSpreadUpToWhite) {
  const auto bytes = EncodeGrayPng({RasterOf({{0, 3, 5}}), 5});
  ASSERT_TRUE(bytes.ok()) << bytes.error();
  ExpectLevels(bytes.value(), 255, {{0, 153, 255}});
}

TEST(Picture, DrawsEachCellAsASquareInItsColour) {
  const auto bytes =
      EncodePicture(RasterOf({{2, 4}, {kNaN, 9}}),
                    {.low = 2, .high = 6, .unknown = {1, 2, 3}, .pixels_per_cell = 2});
  ASSERT_TRUE(bytes.ok()) << bytes.error();
  const double low = (68 + 1 + 84) / 3.0;
  const double middle = (33 + 145 + 140) / 3.0;
  const double high = (253 + 231 + 37) / 3.0;
  ExpectLevels(bytes.value(), 255,
               {{low, low, middle, middle},
                {low, low, middle, middle},
                {2, 2, high, high},
                {2, 2, high, high}});
}

TEST(Picture, IsNoLargerThanARasterMayBe) {
  EXPECT_EQ(ErrorOf(EncodePicture(RasterOf({{1, 2}}), {.pixels_per_cell = 15'001})).substr(0, 34),
            "picture: found 30002 columns and 1");
}

TEST(Png, NoBeginningIsTakenForTheWhole) {
  testing::ExpectEveryBeginningRefused(EncodeGrayPng(testing::RandomGray(3, 65535)).value(),
                                       ParsePng);
  testing::ExpectEveryBeginningRefused(
      Png(2, 2, 8, kGray, Polyline({1}) + Polyline({2}) + Polyline({3, 4}), "", 1), ParsePng);
}

TEST(Png, AFlippedBitInThePixelsIsSeen) {
  const std::string good = Png(2, 1, 8, kGray, Polyline({1, 2}));
  for (size_t i = good.size() - 28; i < good.size() - 12; ++i) {  // data and CRC of IDAT
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x10);
    EXPECT_FALSE(ParsePng(bad, "a").ok()) << i;
  }
}

TEST(Png, ErrorsNameTheFileAndTheByte) {
  EXPECT_EQ(ErrorOf(ParsePng("P5 1 1 255 x", "a.png")),
            "a.png: byte 0: found \"P5 1 1 2\", expected a PNG's signature");
  EXPECT_EQ(ErrorOf(ParsePng("", "a.png")),
            "a.png: byte 0: found \"\", expected a PNG's signature");
  EXPECT_EQ(ErrorOf(ParsePng(Png(2, 2, 8, kGray, Polyline({1, 2})), "a.png")).substr(0, 12),
            "a.png: byte ");
}

TEST(Png, AHugeClaimIsRefusedFromTheHeader) {
  const std::string few = Polyline({1, 2});
  EXPECT_FALSE(ParsePng(Png(30'001, 1, 8, kGray, few), "a").ok());
  EXPECT_FALSE(ParsePng(Png(0x7FFFFFFF, 0x7FFFFFFF, 8, kGray, few), "a").ok());
  EXPECT_EQ(ErrorOf(ParsePng(Png(30'000, 30'000, 8, kGray, few), "a")).substr(0, 53),
            "a: byte 41: found 30000 columns and 30000 rows, expec");
  EXPECT_EQ(ErrorOf(ParsePng(Png(8'000, 8'000, 1, kGray, few), "a")),
            "a: byte 71: the file ends too early");
}

// libpng 1.6.39 takes, and clears, as much memory as a text chunk says it is long.
TEST(Png, AChunkLongerThanTheFileIsRefused) {
  std::string bytes = Png(1, 1, 8, kGray, Polyline({7}), Chunk("zTXt", std::string(20, 'a')));
  bytes[33] = 0x40;  // the length of zTXt: a gigabyte
  EXPECT_EQ(ErrorOf(ParsePng(bytes, "a")),
            "a: byte 33: found a chunk that extends beyond the end of the file");
}

TEST(Png, TextThatUnpacksWithoutEndIsNotUnpacked) {
  std::string text("Comment\0\0", 9);
  text += Deflated(std::string(60'000, 'x'));
  std::string many;
  for (int i = 0; i < 200; ++i) {
    many += Chunk("zTXt", text);
  }
  EXPECT_TRUE(ParsePng(Png(1, 1, 8, kGray, Polyline({7}), many), "a").ok());
}

}  // namespace
}  // namespace pheromone::maps
