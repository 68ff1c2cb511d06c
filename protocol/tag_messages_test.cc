#include "protocol/tag_messages.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/testing/message_fields.h"
#include "protocol/testing/message_table.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::AcceptedAs;
using testing::Bytes;
using testing::ToBody;
using testing::ToMessage;

// The message is accepted as `name` and nothing else, and comes back with the same fields.
template <typename Struct>
void ExpectSurvives(const Struct& sent, const std::string& name) {
  Message message;
  Encode(sent, &message);
  ASSERT_EQ(AcceptedAs(message), std::vector<std::string>{name});
  Struct received;
  ASSERT_TRUE(Decode(message, &received));
  ASSERT_EQ(received, sent);
}

TEST(TagMessages, ScanAnswersOfEverySize) {
  for (uint8_t count = 0; count <= kMaxTagsInRange; ++count) {
    ScanAnswer answer;
    answer.id = 3;
    answer.more = static_cast<uint8_t>(kManyMoreTags - count);
    answer.count = count;
    for (uint8_t i = 0; i < count; ++i) {
      answer.rows[i] = {static_cast<uint16_t>(65529 + i), static_cast<int16_t>(-32768 + i),
                        static_cast<int16_t>(32767 - i), static_cast<uint16_t>(0x1010 * i)};
    }
    ExpectSurvives(answer, "SCAN_ANSWER");
  }
}

TEST(TagMessages, TextsOfEveryLength) {
  for (uint8_t length = 0; length <= kMaxSymbolText; ++length) {
    SymbolRequest symbol;
    symbol.id = 4;
    symbol.seq = length;
    symbol.kind = SymbolKind::kString;
    symbol.number = -length;
    symbol.length = length;
    for (uint8_t i = 0; i < length; ++i) {
      symbol.text[i] = static_cast<uint8_t>(0xF0 + i);
    }
    ExpectSurvives(symbol, "SYMBOL");
  }
  for (uint8_t count = 0; count <= kMaxResolvedText; ++count) {
    ResolveAnswer answer;
    answer.id = 4;
    answer.kind = SymbolKind::kMapping;
    answer.robot = -1;
    answer.number = INT32_MAX;
    answer.rows = UINT32_MAX - count;
    answer.length = static_cast<uint8_t>(255 - count);
    answer.count = count;
    for (uint8_t i = 0; i < count; ++i) {
      answer.text[i] = static_cast<uint8_t>(0x0F + i);
    }
    ExpectSurvives(answer, "RESOLVE_ANSWER");
  }
}

TEST(TagMessages, ABlockHasItsWordsInTheirPlaces) {
  const Bytes body = *testing::LoadFrame("read_answer_of_the_reference").body;
  TagReadAnswer answer;
  ASSERT_TRUE(Decode(ToMessage(body), &answer));
  EXPECT_EQ(answer.words[kWordAuthor], 15);
  EXPECT_EQ(answer.words[kWordTime], 1'138'458'000);
  EXPECT_EQ(answer.words[kWordSubjectNamespace], 1);
  EXPECT_EQ(answer.words[kWordSubject], 2);
  EXPECT_EQ(answer.words[kWordPredicateNamespace], 3);
  EXPECT_EQ(answer.words[kWordPredicate], 4);
  EXPECT_EQ(answer.words[kWordObjectNamespace], kTypeInt);
  EXPECT_EQ(answer.words[kWordObject], 244);
  TagWriteRequest request;
  ASSERT_TRUE(Decode(ToMessage(*testing::LoadFrame("write_of_the_reference").body), &request));
  for (uint8_t i = 0; i < kStatementWords; ++i) {
    EXPECT_EQ(request.words[i], answer.words[kWordSubjectNamespace + i]) << int{i};
  }
}

TEST(TagMessages, AMessageThatIsNoneLeavesTheLastOneAsItWas) {
  ScanAnswer answer;
  ASSERT_TRUE(Decode(ToMessage({1, kScanAnswer, 9, 8, 7, 6, 5, 4, 3, 2, 1}), &answer));
  const ScanAnswer before = answer;
  EXPECT_FALSE(Decode(ToMessage({1, kScanAnswer, 1, 1, 1, 1, 1, 1, 1, 1}), &answer));
  EXPECT_EQ(answer, before);
}

TEST(TagMessages, CountsBeyondTheArraysAreCut) {
  Message message;
  ScanAnswer scan;
  scan.count = kMaxTagsInRange + 1;
  Encode(scan, &message);
  EXPECT_EQ(message.length, 57);
  SymbolRequest symbol;
  symbol.length = 255;
  Encode(symbol, &message);
  EXPECT_EQ(message.length, 62);
  ResolveAnswer resolved;
  resolved.count = 51;
  resolved.length = 255;
  Encode(resolved, &message);
  EXPECT_EQ(message.length, 64);
  resolved.length = 3;  // there is no more text than this
  Encode(resolved, &message);
  EXPECT_EQ(message.length, 17);
}

}  // namespace
}  // namespace pheromone::protocol
