#include "client_fw/tracker/picture.h"

#include <gtest/gtest.h>

#include <string>

#include "server/base/base64.h"

namespace pheromone::tracker {
namespace {

// 16 x 8 pixels, the left half of level 40, the right one of 200: netpbm's pnmtojpeg made it.
std::string TwoHalves() {
  const char kJpeg[] =
      "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAAIBAQEBAQIBAQECAgICAgQDAgICAgUEBAMEBgUGBgYFBgYGBwkIBgcJ"
      "BwYGCAsICQoKCgoKBggLDAsKDAkKCgr/wAALCAAIABABAREA/8QAHwAAAQUBAQEBAQEAAAAAAAAAAAECAwQFBgcI"
      "CQoL/8QAtRAAAgEDAwIEAwUFBAQAAAF9AQIDAAQRBRIhMUEGE1FhByJxFDKBkaEII0KxwRVS0fAkM2JyggkKFhcY"
      "GRolJicoKSo0NTY3ODk6Q0RFRkdISUpTVFVWV1hZWmNkZWZnaGlqc3R1dnd4eXqDhIWGh4iJipKTlJWWl5iZmqKj"
      "pKWmp6ipqrKztLW2t7i5usLDxMXGx8jJytLT1NXW19jZ2uHi4+Tl5ufo6erx8vP09fb3+Pn6/9oACAEBAAA/APyf"
      "r+oCv//Z";
  return FromBase64(kJpeg).value();
}

TEST(PictureTest, ReadsAJpeg) {
  const auto picture = ParsePicture(TwoHalves(), "x.jpg");
  ASSERT_TRUE(picture.ok()) << picture.error();
  ASSERT_EQ(picture.value().width, 16);
  ASSERT_EQ(picture.value().height, 8);
  for (int row = 0; row < 8; ++row) {
    EXPECT_NEAR(picture.value().levels[picture.value().IndexOf(1, row)], 40, 2);
    EXPECT_NEAR(picture.value().levels[picture.value().IndexOf(14, row)], 200, 2);
  }
}

TEST(PictureTest, RefusesADamagedJpeg) {
  const std::string jpeg = TwoHalves();
  for (const size_t size : {size_t{2}, size_t{30}, jpeg.size() - 20}) {
    const auto picture = ParsePicture(jpeg.substr(0, size), "x.jpg");
    ASSERT_FALSE(picture.ok()) << size;
    EXPECT_EQ(picture.error().find("x.jpg: JPEG: "), 0u) << picture.error();
  }
}

// As cheap cameras send them.
TEST(PictureTest, ReadsAJpegWithBytesBeforeItsEnd) {
  std::string jpeg = TwoHalves();
  jpeg.insert(jpeg.size() - 2, std::string("\0\1", 2));
  EXPECT_TRUE(ParsePicture(jpeg, "x.jpg").ok());
}

TEST(PictureTest, ReadsAPgmFromTheTop) {
  const auto picture = ParsePicture(std::string("P5 2 2 255\n\x01\x02\x03\x04", 15), "x.pgm");
  ASSERT_TRUE(picture.ok()) << picture.error();
  EXPECT_EQ(picture.value().levels, (std::vector<uint8_t>{1, 2, 3, 4}));
}

TEST(PictureTest, WritesAPngThatItReads) {
  Picture picture = MakePicture(3, 2);
  picture.levels = {0, 50, 100, 150, 200, 255};
  const auto png = EncodePng(picture);
  ASSERT_TRUE(png.ok()) << png.error();
  const auto again = ParsePicture(png.value(), "x.png");
  ASSERT_TRUE(again.ok()) << again.error();
  EXPECT_EQ(again.value().width, 3);
  EXPECT_EQ(again.value().levels, picture.levels);
}

TEST(PictureTest, TellsWhatIsNoPicture) {
  EXPECT_EQ(ParsePicture("GIF89a", "x.gif").ErrorOr(""),
            "x.gif: found no picture, expected PNG, JPEG or PGM");
}

// Rows may be padded, and the last one need not be.
TEST(PictureTest, TakesTheGrayOfYuyv) {
  const std::string bytes("\x0A\x80\x0B\x80--\x0C\x80\xFD\x80", 10);
  const auto picture = PictureOfYuyv(bytes, 2, 2, 6);
  ASSERT_TRUE(picture.ok()) << picture.error();
  EXPECT_EQ(picture.value().levels, (std::vector<uint8_t>{10, 11, 12, 253}));
  EXPECT_FALSE(PictureOfYuyv(bytes.substr(1), 2, 2, 6).ok());
}

}  // namespace
}  // namespace pheromone::tracker
