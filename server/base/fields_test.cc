#include "server/base/fields.h"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

namespace pheromone {
namespace {

enum class Colour : uint8_t { kRed, kGreen };

struct Part {
  uint8_t kind = 1;
  int32_t weight = -1;
  bool operator==(const Part&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("kind", it.kind, Within(1, 15));
    visit("weight", it.weight, AtLeast(-5));
  }
};

struct Plain {
  int64_t x = 0;
  bool operator==(const Plain&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("x", it.x);
  }
};

struct Alone {
  static constexpr bool kHashedAlone = true;
  uint16_t word = 0;
  bool operator==(const Alone&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("word", it.word);
  }
};

struct Whole {
  bool flag = true;
  Colour colour = Colour::kGreen;
  std::string name = "ab";
  Plain plain{-2};
  Alone alone{7};
  std::vector<Part> parts{{3, 4}, {5, 6}};
  std::vector<Plain> plains;
  std::array<uint8_t, 2> raw{8, 9};
  uint32_t late = 77;
  bool operator==(const Whole&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("flag", it.flag);
    visit("colour", it.colour, UpTo(Colour::kGreen));
    visit("name", it.name);
    visit("plain", it.plain);
    visit("alone", it.alone);
    visit("parts", it.parts);
    visit("plains", it.plains);
    visit("raw", it.raw);
    visit("late", it.late, Within(0, 99));
  }
};

std::string BytesOf(const Whole& whole) {
  ByteWriter writer;
  EncodeFields(whole, &writer);
  return writer.bytes();
}

// By hand: little-endian, in the order of the description.
const std::string kBytes(
    "\x01\x01"
    "\x02\0\0\0ab"
    "\xFE\xFF\xFF\xFF\xFF\xFF\xFF\xFF"
    "\x07\0"
    "\x02\0\0\0\x03\x04\0\0\0\x05\x06\0\0\0"
    "\0\0\0\0"
    "\x08\x09"
    "\x4D\0\0\0",
    2 + 6 + 8 + 2 + 14 + 4 + 2 + 4);

TEST(Fields, AreWrittenInTheirOrder) {
  EXPECT_EQ(BytesOf(Whole{}), kBytes);
  EXPECT_EQ(BytesAtMost(Whole{}), kBytes.size());
}

TEST(Fields, ComeBack) {
  ByteReader reader(kBytes);
  Whole same;
  same.parts.clear();
  same.name = "another";
  DecodeFields(&reader, &same);
  reader.ExpectEnd();
  EXPECT_TRUE(reader.ok()) << reader.error();
  EXPECT_EQ(same, Whole{});
}

TEST(Fields, AnEnumeratorThatDoesNotExistFailsTheReader) {
  std::string bytes = kBytes;
  bytes[1] = 2;
  ByteReader reader(bytes);
  Whole whole;
  DecodeFields(&reader, &whole);
  EXPECT_EQ(reader.error(), "colour is 2, expected at most 1");
}

TEST(Fields, AreHashedAsWords) {
  const uint64_t parts = Hash64({2, Hash64({3, 4}), Hash64({5, 6})});
  const uint64_t plains = Hash64({0});
  EXPECT_EQ(HashFields(Whole{}), Hash64({1, 1, HashText("ab"), static_cast<uint64_t>(-2),
                                         Hash64({7}), parts, plains, 8, 9, 77}));
}

TEST(Fields, BoundsNameTheFieldItsValueAndItsRange) {
  EXPECT_TRUE(CheckFields(Whole{}, "whole").ok());
  Whole whole;
  whole.parts[1].kind = 16;
  EXPECT_EQ(CheckFields(whole, "whole").error(), "whole.parts[1].kind is 16, expected 1 to 15");
  EXPECT_EQ(CheckFields(whole, "").error(), "parts[1].kind is 16, expected 1 to 15");
  whole.parts[1] = {1, -6};
  EXPECT_EQ(CheckFields(whole, "").error(), "parts[1].weight is -6, expected at least -5");
}

TEST(Fields, AreDescribedForPeople) {
  EXPECT_EQ(DescribeFields<Whole>(),
            "flag flag\n"
            "u8 colour: 0 to 1\n"
            "text name\n"
            "i64 plain.x\n"
            "u16 alone.word\n"
            "list parts, each\n"
            "  u8 kind: 1 to 15\n"
            "  i32 weight: at least -5\n"
            "list plains, each\n"
            "  i64 x\n"
            "2 bytes raw\n"
            "u32 late: 0 to 99\n");
}

}  // namespace
}  // namespace pheromone
