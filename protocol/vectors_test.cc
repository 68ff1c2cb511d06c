// The messages against the vectors: field by field, both ways.
#include "protocol/testing/vectors.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "protocol/messages.h"
#include "protocol/tag_messages.h"
#include "protocol/testing/message_fields.h"
#include "protocol/testing/message_table.h"

namespace pheromone::protocol {
namespace {

using testing::Bytes;
using testing::FieldsVector;
using testing::FrameVector;
using testing::ToBody;
using testing::ToMessage;

// Fields to body and body to fields.
template <typename M>
void CheckBothWays(const M& message, const Bytes& body) {
  Message encoded;
  ASSERT_TRUE(Encode(message, &encoded));
  EXPECT_EQ(ToBody(encoded), body);
  M decoded;
  ASSERT_TRUE(Decode(ToMessage(body), &decoded));
  EXPECT_EQ(decoded, message);
}

TEST(Vectors, EveryMessageEncodesAndDecodesFieldByField) {
  for (const FieldsVector& vector : testing::LoadFields()) {
    SCOPED_TRACE(vector.name);
    const FrameVector frame = testing::LoadFrame(vector.name);
    ASSERT_TRUE(frame.body.has_value());
    testing::WithMessage(vector, [&](const auto& message) { CheckBothWays(message, *frame.body); });
    EXPECT_EQ(testing::AcceptedAs(ToMessage(*frame.body)),
              std::vector<std::string>{vector.message});
  }
}

TEST(Vectors, EveryMessageOfTheTableHasAVector) {
  std::set<std::string> in_vectors;
  for (const FieldsVector& vector : testing::LoadFields()) {
    in_vectors.insert(vector.message);
  }
  std::set<std::string> in_table;
  for (const testing::TableRow& row : testing::MessageTable()) {
    if (!row.name.empty()) {
      in_table.insert(row.name);
    }
  }
  EXPECT_EQ(in_vectors, in_table);
}

TEST(Vectors, TheVerdictOkMeansAMessageWithFields) {
  std::set<std::string> with_fields;
  for (const FieldsVector& vector : testing::LoadFields()) {
    EXPECT_TRUE(with_fields.insert(vector.name).second) << vector.name << " stands twice";
  }
  std::set<std::string> ok;
  for (const FrameVector& vector : testing::LoadFrames()) {
    if (vector.verdict == "ok") {
      ok.insert(vector.name);
    }
  }
  EXPECT_EQ(ok, with_fields);
}

TEST(Vectors, MessagesOfUnknownOpcodeBadLengthOrBadValueAreNotDecoded) {
  std::map<std::string, int> seen;
  for (const FrameVector& vector : testing::LoadFrames()) {
    if (!vector.delivered() || vector.verdict == "ok") {
      continue;
    }
    const Message message = ToMessage(*vector.body);
    EXPECT_TRUE(testing::AcceptedAs(message).empty()) << vector.name;
    EXPECT_EQ(LengthOf(message.opcode).known, vector.verdict != "unknown-opcode") << vector.name;
    ++seen[vector.verdict];
  }
  EXPECT_GE(seen["unknown-opcode"], 10);
  EXPECT_GE(seen["bad-length"], 5);
  EXPECT_GE(seen["bad-value"], 3);
}

// The specification quotes vectors, some with wider spaces between the fields.
TEST(Vectors, TheReadmeQuotesThemCorrectly) {
  std::ifstream stream(std::string(PHEROMONE_SOURCE_DIR) + "/protocol/README.md");
  std::string readme;
  for (std::string word; stream >> word;) {
    std::erase(word, '`');
    readme += word + " ";
  }
  for (const char* name : {"hello_of_the_worked_example",
                           "hello_answer_of_the_worked_example",
                           "sense_of_the_worked_example",
                           "sense_answer_of_the_worked_example",
                           "sense_too_short_crc_is_dle_dle",
                           "zero_line",
                           "opcode_tag_answer_holds_false_frame",
                           "symbol_robot_of_the_worked_example",
                           "symbol_answer_of_the_worked_example",
                           "symbol_namespace_of_the_worked_example",
                           "symbol_string_of_the_worked_example",
                           "scan_of_the_worked_example",
                           "scan_answer_of_the_worked_example",
                           "read_of_the_worked_example",
                           "read_answer_of_the_worked_example",
                           "write_of_the_worked_example",
                           "write_answer_of_the_worked_example",
                           "erase_of_the_worked_example",
                           "erase_answer_of_the_worked_example",
                           "net_read_trigger",
                           "net_read_answer_trigger",
                           "net_write_present",
                           "net_write_answer_present",
                           "net_read_outcome",
                           "net_read_answer_accepted",
                           "net_read_answer_green",
                           "net_write_pass"}) {
    std::string wire;
    for (const uint8_t byte : testing::LoadFrame(name).wire) {
      constexpr char kDigits[] = "0123456789ABCDEF";
      wire += {kDigits[byte / 16], kDigits[byte % 16], ' '};
    }
    EXPECT_NE(readme.find(wire), std::string::npos) << name << ": " << wire;
  }
}

}  // namespace
}  // namespace pheromone::protocol
