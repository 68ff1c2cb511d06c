#include "server/formats/foxglove/base64.h"

#include <gtest/gtest.h>

namespace pheromone::foxglove {
namespace {

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
