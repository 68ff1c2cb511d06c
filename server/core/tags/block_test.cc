#include "server/core/tags/block.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

namespace pheromone::tags {
namespace {

// Robot 15 at 2006-01-28T14:20:00Z: symbols (1, 2) and (3, 4), int 244; as little-endian bytes.
constexpr char kQuintet[] = "0f000000907ddb4301000000020000000300000004000000fdfffffff4000000";

const Block kFact = {.author = 15,
                     .time_s = 1'138'458'000,
                     .subject = {1, 2},
                     .predicate = {3, 4},
                     .object = {-3, 244}};

std::string Hex(const Words& words) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const int32_t word : words) {
    for (int byte = 0; byte < 4; ++byte) {
      const uint32_t value = (static_cast<uint32_t>(word) >> (8 * byte)) & 0xFFu;
      text += {kDigits[value >> 4], kDigits[value & 15]};
    }
  }
  return text;
}

TEST(BlockTest, WordsAreInThePapersOrder) {
  EXPECT_EQ(Hex(ToWords(kFact)), kQuintet);
  EXPECT_EQ(BlockFromWords(ToWords(kFact)), kFact);
}

TEST(BlockTest, TimesReachBeyond2038) {
  Block late = kFact;
  late.time_s = 0xFFFFFFFFu;
  EXPECT_EQ(BlockFromWords(ToWords(late)).time_s, 0xFFFFFFFFu);
}

TEST(BlockTest, AnEmptySlotIsAllZero) {
  EXPECT_TRUE(BlockFromWords({}).is_empty());
  EXPECT_EQ(ToWords({}), Words{});
}

std::string FaultOf(Term subject, Term predicate, Term object) {
  Block block = kFact;
  block.subject = subject;
  block.predicate = predicate;
  block.object = object;
  const Status status = CheckBlock(block);
  return status.ErrorOr("");
}

TEST(BlockTest, SubjectsAreSymbolsRobotsAndTags) {
  EXPECT_EQ(FaultOf({0, 1}, {1, 2}, {1, 3}), "");
  EXPECT_EQ(FaultOf({-17, 15}, {1, 2}, {1, 3}), "");
  EXPECT_EQ(FaultOf({-18, 7}, {1, 2}, {1, 3}), "");
  EXPECT_EQ(FaultOf({-3, 15}, {1, 2}, {1, 3}),
            "the subject is (-3, 15), expected a symbol, a robot or a tag");
  EXPECT_EQ(FaultOf({1, 0}, {1, 2}, {1, 3}),
            "the subject is (1, 0), expected a symbol, a robot or a tag");
}

TEST(BlockTest, PredicatesAreSymbols) {
  EXPECT_EQ(FaultOf({1, 1}, {-3, 2}, {1, 3}), "the predicate is (-3, 2), expected a symbol");
  EXPECT_EQ(FaultOf({1, 1}, {-17, 2}, {1, 3}), "the predicate is (-17, 2), expected a symbol");
}

TEST(BlockTest, ObjectsHaveValuesOfTheirType) {
  for (const Term good : {Term{-1, 1},
                          {-2, 0x10FFFF},
                          {-3, -5},
                          {-4, -1},
                          {-5, -1},
                          {-6, -719'162},
                          {-7, 86'399'999},
                          {-17, 1},
                          {-18, 65'535},
                          {-99, -7}}) {
    EXPECT_EQ(FaultOf({1, 1}, {1, 2}, good), "") << good.space;
  }
  EXPECT_EQ(FaultOf({1, 1}, {1, 2}, {-2, 0xD800}),
            "the object is character 55296, expected a Unicode scalar value");
  EXPECT_EQ(FaultOf({1, 1}, {1, 2}, {-7, 86'400'000}),
            "the object is time 86400000 ms, expected 0 to 86399999");
  EXPECT_EQ(FaultOf({1, 1}, {1, 2}, {-1, 0}),
            "the object is (-1, 0), expected a string's number from 1 on");
  EXPECT_EQ(FaultOf({1, 1}, {1, 2}, {-17, 0}),
            "the object is (-17, 0), expected a number from 1 on");
}

TEST(BlockTest, AuthorsAreNumberedFromOne) {
  Block block = kFact;
  block.author = -1;
  EXPECT_EQ(CheckBlock(block).error(), "the author is -1, expected at least 1");
}

TEST(BlockTest, TheWordsOfANetsRecordAreCarried) {
  EXPECT_EQ(FaultOf({kNetRecordType, -1}, {-7, 99}, {-2, -5}), "");
  Block block = kFact;
  EXPECT_FALSE(block.is_net_record());
  block.subject.space = kNetRecordType;
  EXPECT_TRUE(block.is_net_record());
  block.author = 0;
  EXPECT_FALSE(CheckBlock(block).ok());
}

TEST(BlockTest, UnknownTypesAreTold) {
  EXPECT_TRUE(IsKnownType({-7, 0}));
  EXPECT_TRUE(IsKnownType({-17, 0}));
  EXPECT_FALSE(IsKnownType({-8, 0}));
  EXPECT_FALSE(IsKnownType({-16, 0}));
  EXPECT_FALSE(IsKnownType({-19, 0}));
}

}  // namespace
}  // namespace pheromone::tags
