#include "server/base/base64.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <utility>

namespace pheromone {
namespace {

// RFC 4648, section 10
constexpr std::pair<const char*, const char*> kVectors[] = {
    {"", ""},
    {"f", "Zg=="},
    {"fo", "Zm8="},
    {"foo", "Zm9v"},
    {"foob", "Zm9vYg=="},
    {"fooba", "Zm9vYmE="},
    {"foobar", "Zm9vYmFy"},
    {"\xfb\xff\xbf", "+/+/"},
};

TEST(Base64Test, EncodesTheVectorsOfItsSpecification) {
  for (const auto& [bytes, text] : kVectors) {
    EXPECT_EQ(ToBase64(bytes), text);
  }
}

TEST(Base64Test, DecodesTheVectorsOfItsSpecification) {
  for (const auto& [bytes, text] : kVectors) {
    const Result<std::string> decoded = FromBase64(text);
    ASSERT_TRUE(decoded.ok()) << decoded.error();
    EXPECT_EQ(decoded.value(), bytes);
  }
}

TEST(Base64Test, DecodesAllByteValues) {
  // By Python's base64: each digit once, in the alphabet's order.
  const Result<std::string> decoded =
      FromBase64("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/");
  ASSERT_TRUE(decoded.ok()) << decoded.error();
  const std::string_view expected(
      "\x00\x10\x83\x10\x51\x87\x20\x92\x8b\x30\xd3\x8f\x41\x14\x93\x51\x55\x97\x61\x96\x9b\x71\xd7"
      "\x9f\x82\x18\xa3\x92\x59\xa7\xa2\x9a\xab\xb2\xdb\xaf\xc3\x1c\xb3\xd3\x5d\xb7\xe3\x9e\xbb\xf3"
      "\xdf\xbf",
      48);
  EXPECT_EQ(decoded.value(), expected);
}

TEST(Base64Test, RejectsWhatIsNotBase64AndSaysWhere) {
  const auto error_of = [](const char* text) {
    const Result<std::string> decoded = FromBase64(text);
    return decoded.ok() ? "decoded" : std::string(decoded.error());
  };
  EXPECT_EQ(error_of("Zm9"), "not Base64 at character 4");       // padding is missing
  EXPECT_EQ(error_of("Zm9v\n"), "not Base64 at character 6");    //
  EXPECT_EQ(error_of("Zm-v"), "not Base64 at character 3");      // the alphabet of section 5
  EXPECT_EQ(error_of("Zm9vZh=="), "not Base64 at character 6");  // bits beyond the last byte
  EXPECT_EQ(error_of("Zg==Zg=="), "not Base64 at character 3");  // padding in the middle
  EXPECT_EQ(error_of("Z==="), "not Base64 at character 2");
  EXPECT_EQ(error_of("===="), "not Base64 at character 1");
}

}  // namespace
}  // namespace pheromone
