// The wire format, from the examples of its specifications.
#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "server/foxglove/base64.h"
#include "server/foxglove/protobuf.h"

namespace pheromone::foxglove {
namespace {

using std::string_view_literals::operator""sv;

// protobuf.dev/programming-guides/encoding
TEST(ProtobufTest, WritesTheExamplesOfTheEncodingGuide) {
  ProtobufWriter writer;
  writer.Varint(1, 150);
  EXPECT_EQ(writer.Take(), "\x08\x96\x01"sv);
  writer.Text(2, "testing");
  EXPECT_EQ(writer.Take(), "\x12\x07testing"sv);
  writer.Message(3, [](ProtobufWriter& it) { it.Varint(1, 150); });
  EXPECT_EQ(writer.Take(), "\x1a\x03\x08\x96\x01"sv);
}

TEST(ProtobufTest, LeavesOutWhatIsZeroButNotMessages) {
  ProtobufWriter writer;
  writer.Varint(1, 0);
  writer.Double(2, 0);
  writer.Fixed32(3, 0);
  writer.Text(4, "");
  writer.Message(5, [](ProtobufWriter&) {});
  writer.EvenZero(6, 0);
  EXPECT_EQ(writer.Take(), "\x2a\x00\x30\x00"sv);
}

TEST(ProtobufTest, WritesLengthsOfSeveralBytesBeforeLongMessages) {
  ProtobufWriter writer;
  writer.Message(1, [](ProtobufWriter& it) { it.Text(1, std::string(200, 'x')); });
  EXPECT_EQ(writer.Take(), "\x0a\xcb\x01\x0a\xc8\x01" + std::string(200, 'x'));
}

TEST(ProtobufTest, WritesFixedWidthsLittleEndian) {
  ProtobufWriter writer;
  writer.Double(1, 1);
  writer.Fixed32(2, 0x01020304);
  EXPECT_EQ(writer.Take(), "\x09\x00\x00\x00\x00\x00\x00\xf0\x3f\x15\x04\x03\x02\x01"sv);
}

// RFC 4648, section 10
TEST(Base64Test, EncodesTheVectorsOfItsSpecification) {
  EXPECT_EQ(ToBase64(""), "");
  EXPECT_EQ(ToBase64("f"), "Zg==");
  EXPECT_EQ(ToBase64("fo"), "Zm8=");
  EXPECT_EQ(ToBase64("foo"), "Zm9v");
  EXPECT_EQ(ToBase64("foob"), "Zm9vYg==");
  EXPECT_EQ(ToBase64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(ToBase64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(ToBase64("\xfb\xff\xbf"), "+/+/");
}

}  // namespace
}  // namespace pheromone::foxglove
