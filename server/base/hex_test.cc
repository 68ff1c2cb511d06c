#include "server/base/hex.h"

#include <gtest/gtest.h>

#include <array>

namespace pheromone {
namespace {

using namespace std::string_literals;

TEST(Hex, HasTwoDigitsForEachByte) {
  EXPECT_EQ(HexText(""), "");
  EXPECT_EQ(HexText("\0\x09\x7F\x80\xFF"s), "00097f80ff");
  EXPECT_EQ(HexText(std::array<uint8_t, 2>{0xA5, 0x0F}), "a50f");
}

TEST(Hex, IsReadInEitherCase) {
  EXPECT_EQ(ParseHex(""), "");
  EXPECT_EQ(ParseHex("00097f80fFAb"), "\0\x09\x7F\x80\xFF\xAB"s);
}

TEST(Hex, IsNothingIfAnyCharacterIsNoDigitOrHasNoOther) {
  for (const char* bad : {"0", "000", "0g", "g0", "-1", "+1", " 1", "1 ", "0x12", "00\n"}) {
    EXPECT_EQ(ParseHex(bad), std::nullopt) << bad;
  }
}

}  // namespace
}  // namespace pheromone
