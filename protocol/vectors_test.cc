// The messages against the vectors: field by field, both ways.
#include "protocol/testing/vectors.h"

#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
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

// Hands out a line's fields, each once, and knows whether all were asked for.
class FieldReader {
 public:
  explicit FieldReader(const FieldsVector& vector) : vector_(vector) {}

  const std::string& Text(const std::string& name) {
    used_.insert(name);
    const auto found = vector_.fields.find(name);
    if (found == vector_.fields.end()) {
      throw std::runtime_error(vector_.name + " has no field " + name);
    }
    return found->second;
  }

  int64_t Number(const std::string& name) { return std::stoll(Text(name)); }

  /// Separated by commas; "-" for none.
  std::vector<int> List(const std::string& name) {
    std::vector<int> all;
    std::istringstream stream(Text(name));
    for (std::string one; std::getline(stream, one, ',') && one != "-";) {
      all.push_back(std::stoi(one));
    }
    return all;
  }

  /// Into a field of any integer type that holds it.
  template <typename Integer>
  void Get(const std::string& name, Integer* to) {
    const int64_t value = Number(name);
    if (value < std::numeric_limits<Integer>::min() ||
        value > std::numeric_limits<Integer>::max()) {
      throw std::runtime_error(vector_.name + ": " + name + " is out of range");
    }
    *to = static_cast<Integer>(value);
  }

  /// As 32 bits, signed or not.
  void GetWord(const std::string& name, int32_t* to) {
    *to = static_cast<int32_t>(static_cast<uint32_t>(Number(name)));
  }

  /// Bytes in hexadecimal, without spaces; "-" for none. Returns how many.
  uint8_t GetBytes(const std::string& name, uint8_t* to) {
    const std::string& digits = Text(name);
    uint8_t count = 0;
    for (size_t i = 0; digits != "-" && i < digits.size(); i += 2) {
      to[count++] = static_cast<uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16));
    }
    return count;
  }

  bool AllUsed() const { return used_.size() == vector_.fields.size(); }

 private:
  const FieldsVector& vector_;
  std::set<std::string> used_;
};

template <typename Code>
Code GetCode(FieldReader* fields, const std::string& name) {
  return static_cast<Code>(fields->Number(name));
}

void Get(FieldReader* fields, WirePose* pose) {
  fields->Get("x", &pose->x);
  fields->Get("y", &pose->y);
  fields->Get("heading", &pose->heading);
}

void Get(FieldReader* fields, SenseRequest* m) {
  fields->Get("type", &m->type);
  Get(fields, &m->pose);
}

void Get(FieldReader* fields, SenseAnswer* m) {
  fields->Get("type", &m->type);
  fields->Get("left", &m->left);
  fields->Get("right", &m->right);
}

void Get(FieldReader* fields, DepositRequest* m) {
  fields->Get("type", &m->type);
  fields->Get("seq", &m->seq);
  fields->Get("x", &m->x);
  fields->Get("y", &m->y);
  fields->Get("quanta", &m->quanta);
}

void Get(FieldReader* fields, DepositAnswer* m) {
  fields->Get("type", &m->type);
  fields->Get("seq", &m->seq);
}

void Get(FieldReader* fields, TraceRequest* m) {
  fields->Get("type", &m->type);
  fields->Get("seq", &m->seq);
  Get(fields, &m->pose);
}

void Get(FieldReader* fields, TraceAnswer* m) {
  fields->Get("type", &m->type);
  fields->Get("seq", &m->seq);
  fields->Get("left", &m->left);
  fields->Get("right", &m->right);
}

// A COMMAND's arguments by name and size, in the order of the wire.
struct Argument {
  const char* name;
  int bytes;
};

std::vector<Argument> ArgumentsOf(CommandCode code) {
  switch (code) {
    case CommandCode::kSpeed:
      return {{"speed_mm_s", 2}};
    case CommandCode::kGoTo:
      return {{"x", 2}, {"y", 2}};
    case CommandCode::kFollowType:
      return {{"type_to_follow", 1}};
    case CommandCode::kSetParameter:
      return {{"parameter", 1}, {"value", 4}};
    case CommandCode::kGetParameter:
      return {{"parameter", 1}};
    default:
      return {};
  }
}

void Get(FieldReader* fields, Command* m) {
  fields->Get("seq", &m->seq);
  m->code = GetCode<CommandCode>(fields, "code");
  int at = 0;
  for (const Argument& argument : ArgumentsOf(m->code)) {
    int64_t rest = fields->Number(argument.name);
    for (int i = 0; i < argument.bytes; ++i, rest >>= 8) {
      m->arguments[at++] = static_cast<uint8_t>(rest & 0xFF);
    }
  }
}

void Get(FieldReader* fields, CommandAck* m) {
  fields->Get("seq", &m->seq);
  m->code = GetCode<CommandCode>(fields, "code");
  fields->Get("result", &m->result);
}

void Get(FieldReader* fields, EventReport* m) {
  fields->Get("seq", &m->seq);
  m->code = GetCode<EventCode>(fields, "code");
  fields->Get("argument", &m->argument);
}

void Get(FieldReader* fields, EventAck* m) {
  fields->Get("seq", &m->seq);
}

void Get(FieldReader* fields, HelloRequest* m) {
  fields->Get("nonce", &m->nonce);
  fields->Get("firmware_version", &m->firmware_version);
  fields->Get("round_period", &m->round_period);
}

void Get(FieldReader* fields, HelloAnswer* m) {
  fields->Get("nonce", &m->nonce);
  fields->Get("protocol_version", &m->protocol_version);
  fields->Get("epoch", &m->epoch);
  fields->Get("pose_unit_10um", &m->pose_unit_10um);
  fields->Get("antenna_distance_mm", &m->antenna_distance_mm);
  fields->Get("type_mask", &m->type_mask);
  fields->Get("slot_ms", &m->slot_ms);
  fields->Get("response_window_ms", &m->response_window_ms);
  fields->Get("last_opcode", &m->last_opcode);
  fields->Get("last_seq", &m->last_seq);
}

void Get(FieldReader* fields, Ping* m) {
  m->length = fields->GetBytes("payload", m->payload);
}

void Get(FieldReader* fields, ErrorAnswer* m) {
  fields->Get("refused_opcode", &m->refused_opcode);
  m->reason = GetCode<Reason>(fields, "reason");
  fields->Get("seq", &m->seq);
}

void Get(FieldReader* fields, Round* m) {
  fields->Get("number", &m->number);
  fields->Get("turn_ms", &m->turn_ms);
  fields->Get("turn_bytes", &m->turn_bytes);
  fields->Get("slot_ms", &m->slot_ms);
  fields->Get("open_slots", &m->open_slots);
  const std::vector<int> left = fields->List("left");
  const std::vector<int> right = fields->List("right");
  m->answer_count = static_cast<uint8_t>(left.size());
  for (size_t i = 0; i < left.size(); ++i) {
    m->answers[i] = {static_cast<int16_t>(left.at(i)), static_cast<int16_t>(right.at(i))};
  }
  for (const int id : fields->List("turns")) {
    m->turns[m->turn_count++] = static_cast<uint8_t>(id);
  }
}

void Get(FieldReader* fields, ScanRequest* m) {
  fields->Get("x", &m->x);
  fields->Get("y", &m->y);
  fields->Get("after", &m->after);
}

void Get(FieldReader* fields, ScanAnswer* m) {
  fields->Get("more", &m->more);
  const std::vector<int> tag = fields->List("tag");
  const std::vector<int> dx = fields->List("dx");
  const std::vector<int> dy = fields->List("dy");
  const std::vector<int> generation = fields->List("generation");
  m->count = static_cast<uint8_t>(tag.size());
  for (size_t i = 0; i < tag.size(); ++i) {
    m->rows[i] = {static_cast<uint16_t>(tag.at(i)), static_cast<int16_t>(dx.at(i)),
                  static_cast<int16_t>(dy.at(i)), static_cast<uint16_t>(generation.at(i))};
  }
}

void Get(FieldReader* fields, TagReadRequest* m) {
  fields->Get("x", &m->x);
  fields->Get("y", &m->y);
  fields->Get("tag", &m->tag);
  fields->Get("slot", &m->slot);
}

void GetStatement(FieldReader* fields, int32_t* words) {
  fields->GetWord("subject_namespace", &words[0]);
  fields->GetWord("subject", &words[1]);
  fields->GetWord("predicate_namespace", &words[2]);
  fields->GetWord("predicate", &words[3]);
  fields->GetWord("object_namespace", &words[4]);
  fields->GetWord("object", &words[5]);
}

void Get(FieldReader* fields, TagReadAnswer* m) {
  fields->Get("tag", &m->tag);
  fields->Get("slot", &m->slot);
  fields->Get("next", &m->next);
  fields->Get("slots", &m->slots);
  fields->Get("tag_generation", &m->tag_generation);
  fields->Get("slot_generation", &m->slot_generation);
  fields->Get("lease_s", &m->lease_s);
  fields->Get("flags", &m->flags);
  fields->GetWord("author", &m->words[kWordAuthor]);
  fields->GetWord("time", &m->words[kWordTime]);
  GetStatement(fields, m->words + 2);
}

void Get(FieldReader* fields, TagWriteRequest* m) {
  fields->Get("seq", &m->seq);
  fields->Get("x", &m->x);
  fields->Get("y", &m->y);
  fields->Get("tag", &m->tag);
  fields->Get("slot", &m->slot);
  fields->Get("flags", &m->flags);
  fields->Get("expected", &m->expected);
  fields->Get("lease_s", &m->lease_s);
  fields->Get("time", &m->time);
  GetStatement(fields, m->words);
}

void Get(FieldReader* fields, TagEraseRequest* m) {
  fields->Get("seq", &m->seq);
  fields->Get("x", &m->x);
  fields->Get("y", &m->y);
  fields->Get("tag", &m->tag);
  fields->Get("slot", &m->slot);
  fields->Get("flags", &m->flags);
  fields->Get("expected", &m->expected);
}

void Get(FieldReader* fields, TagWritten* m) {
  fields->Get("seq", &m->seq);
  fields->Get("tag", &m->tag);
  fields->Get("slot", &m->slot);
  fields->Get("slot_generation", &m->slot_generation);
  fields->Get("tag_generation", &m->tag_generation);
}

void Get(FieldReader* fields, SymbolRequest* m) {
  fields->Get("seq", &m->seq);
  m->kind = GetCode<SymbolKind>(fields, "kind");
  fields->Get("number", &m->number);
  m->length = fields->GetBytes("text", m->text);
}

void Get(FieldReader* fields, SymbolAnswer* m) {
  fields->Get("seq", &m->seq);
  m->kind = GetCode<SymbolKind>(fields, "kind");
  fields->Get("number", &m->number);
}

void Get(FieldReader* fields, ResolveRequest* m) {
  m->kind = GetCode<SymbolKind>(fields, "kind");
  fields->Get("robot", &m->robot);
  fields->Get("number", &m->number);
  fields->Get("offset", &m->offset);
}

void Get(FieldReader* fields, ResolveAnswer* m) {
  m->kind = GetCode<SymbolKind>(fields, "kind");
  fields->Get("robot", &m->robot);
  fields->Get("number", &m->number);
  fields->Get("rows", &m->rows);
  fields->Get("text_length", &m->length);
  m->count = fields->GetBytes("text", m->text);
}

// Fields to body and body to fields. `m` is what the fields do not say (wide, answer).
template <typename Struct>
void CheckBothWays(const FieldsVector& vector, const Bytes& body, Struct m) {
  FieldReader fields(vector);
  if constexpr (std::is_same_v<Struct, Round>) {
    EXPECT_EQ(fields.Number("id"), kBroadcastId);
  } else {
    fields.Get("id", &m.id);
  }
  Get(&fields, &m);
  EXPECT_TRUE(fields.AllUsed()) << "fields that no one asked for";
  Message encoded;
  ASSERT_TRUE(testing::TryEncode(m, &encoded));
  EXPECT_EQ(ToBody(encoded), body);
  Struct decoded;
  ASSERT_TRUE(Decode(ToMessage(body), &decoded));
  EXPECT_EQ(testing::Fields(decoded), testing::Fields(m));
}

template <typename Struct>
Struct Wide() {
  Struct m;
  m.wide = true;
  return m;
}

void CheckVector(const FieldsVector& vector, const Bytes& body) {
  const std::string& name = vector.message;
  if (name == "SENSE") {
    CheckBothWays(vector, body, SenseRequest{});
  } else if (name == "SENSE_WIDE") {
    CheckBothWays(vector, body, Wide<SenseRequest>());
  } else if (name == "SENSE_ANSWER") {
    CheckBothWays(vector, body, SenseAnswer{});
  } else if (name == "SENSE_WIDE_ANSWER") {
    CheckBothWays(vector, body, Wide<SenseAnswer>());
  } else if (name == "DEPOSIT") {
    CheckBothWays(vector, body, DepositRequest{});
  } else if (name == "DEPOSIT_ANSWER") {
    CheckBothWays(vector, body, DepositAnswer{});
  } else if (name == "TRACE") {
    CheckBothWays(vector, body, TraceRequest{});
  } else if (name == "TRACE_WIDE") {
    CheckBothWays(vector, body, Wide<TraceRequest>());
  } else if (name == "TRACE_ANSWER") {
    CheckBothWays(vector, body, TraceAnswer{});
  } else if (name == "TRACE_WIDE_ANSWER") {
    CheckBothWays(vector, body, Wide<TraceAnswer>());
  } else if (name == "COMMAND") {
    CheckBothWays(vector, body, Command{});
  } else if (name == "COMMAND_ACK") {
    CheckBothWays(vector, body, CommandAck{});
  } else if (name == "EVENT") {
    CheckBothWays(vector, body, EventReport{});
  } else if (name == "EVENT_ACK") {
    CheckBothWays(vector, body, EventAck{});
  } else if (name == "HELLO") {
    CheckBothWays(vector, body, HelloRequest{});
  } else if (name == "HELLO_ANSWER") {
    CheckBothWays(vector, body, HelloAnswer{});
  } else if (name == "PING" || name == "PING_ANSWER") {
    Ping ping;
    ping.answer = name == "PING_ANSWER";
    CheckBothWays(vector, body, ping);
  } else if (name == "ERROR") {
    CheckBothWays(vector, body, ErrorAnswer{});
  } else if (name == "ROUND") {
    CheckBothWays(vector, body, Round{});
  } else if (name == "SCAN") {
    CheckBothWays(vector, body, ScanRequest{});
  } else if (name == "SCAN_ANSWER") {
    CheckBothWays(vector, body, ScanAnswer{});
  } else if (name == "READ") {
    CheckBothWays(vector, body, TagReadRequest{});
  } else if (name == "READ_ANSWER") {
    CheckBothWays(vector, body, TagReadAnswer{});
  } else if (name == "WRITE") {
    CheckBothWays(vector, body, TagWriteRequest{});
  } else if (name == "ERASE") {
    CheckBothWays(vector, body, TagEraseRequest{});
  } else if (name == "WRITE_ANSWER" || name == "ERASE_ANSWER") {
    TagWritten written;
    written.erased = name == "ERASE_ANSWER";
    CheckBothWays(vector, body, written);
  } else if (name == "SYMBOL") {
    CheckBothWays(vector, body, SymbolRequest{});
  } else if (name == "SYMBOL_ANSWER") {
    CheckBothWays(vector, body, SymbolAnswer{});
  } else if (name == "RESOLVE") {
    CheckBothWays(vector, body, ResolveRequest{});
  } else if (name == "RESOLVE_ANSWER") {
    CheckBothWays(vector, body, ResolveAnswer{});
  } else {
    ADD_FAILURE() << "no message is called " << name;
  }
}

TEST(Vectors, EveryMessageEncodesAndDecodesFieldByField) {
  for (const FieldsVector& vector : testing::LoadFields()) {
    SCOPED_TRACE(vector.name);
    const FrameVector frame = testing::LoadFrame(vector.name);
    ASSERT_TRUE(frame.body.has_value());
    CheckVector(vector, *frame.body);
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
