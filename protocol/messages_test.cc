#include "protocol/messages.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "protocol/fields.h"
#include "protocol/tag_messages.h"
#include "protocol/testing/message_fields.h"
#include "protocol/testing/message_table.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::AcceptedAs;
using testing::ExpectedNames;
using testing::ToBody;

constexpr uint8_t kIds[] = {1, 16, 254, 255};
constexpr uint8_t kBytes[] = {0, 1, 16, 127, 128, 255};
constexpr int16_t kNarrow[] = {-32768, -32767, -256, -1, 0, 1, 16, 0x1010, 255, 256, 32767};
constexpr int32_t kWide[] = {INT32_MIN, INT32_MIN + 1, -65536, -32769, -32768, -1,    0,
                             1,         0x10101010,    32767,  32768,  65535,  65536, INT32_MAX};
constexpr uint16_t kWords[] = {0, 1, 0x1010, 255, 256, 16384, 32767, 32768, 49152, 65535};

// The message is accepted as `name` and nothing else, and comes back with the same fields.
template <typename Struct>
void ExpectComesBack(const Struct& sent, const std::string& name) {
  Message message;
  ASSERT_TRUE(Encode(sent, &message));
  ASSERT_EQ(AcceptedAs(message), std::vector<std::string>{name});
  Struct received;
  ASSERT_TRUE(Decode(message, &received));
  ASSERT_EQ(received, sent);
}

TEST(MessagesComeBack, SenseAndTraceWithExtremePoses) {
  for (uint8_t type = kMinType; type <= kMaxType; ++type) {
    for (const uint16_t heading : kWords) {
      for (const int16_t x : kNarrow) {
        for (const int16_t y : kNarrow) {
          ExpectComesBack(SenseRequest{2, type, false, {x, y, heading}}, "SENSE");
          ExpectComesBack(TraceRequest{2, type, false, 9, {x, y, heading}}, "TRACE");
        }
      }
      for (const int32_t x : kWide) {
        for (const int32_t y : kWide) {
          ExpectComesBack(SenseRequest{2, type, true, {x, y, heading}}, "SENSE_WIDE");
          ExpectComesBack(TraceRequest{2, type, true, 9, {x, y, heading}}, "TRACE_WIDE");
        }
      }
    }
  }
}

TEST(MessagesComeBack, AnswersWithExtremeIntensities) {
  for (uint8_t type = kMinType; type <= kMaxType; ++type) {
    for (const int16_t left : kNarrow) {
      for (const int16_t right : kNarrow) {
        ExpectComesBack(SenseAnswer{3, type, false, left, right}, "SENSE_ANSWER");
        ExpectComesBack(SenseAnswer{3, type, true, left, right}, "SENSE_WIDE_ANSWER");
        ExpectComesBack(TraceAnswer{3, type, false, 255, left, right}, "TRACE_ANSWER");
        ExpectComesBack(TraceAnswer{3, type, true, 255, left, right}, "TRACE_WIDE_ANSWER");
      }
    }
  }
}

TEST(MessagesComeBack, Deposit) {
  for (uint8_t type = kMinType; type <= kMaxType; ++type) {
    for (const uint8_t seq : kBytes) {
      ExpectComesBack(DepositAnswer{4, type, seq}, "DEPOSIT_ANSWER");
      for (const int16_t x : kNarrow) {
        for (const int16_t y : kNarrow) {
          ExpectComesBack(DepositRequest{4, type, seq, x, y, static_cast<uint8_t>(seq + 1)},
                          "DEPOSIT");
        }
      }
    }
  }
}

TEST(MessagesComeBack, EveryCommandWithItsArguments) {
  for (uint8_t code = 1; code <= 9; ++code) {
    for (const uint8_t id : kIds) {
      for (const uint8_t fill : kBytes) {
        Command command;
        command.id = id;
        command.seq = fill;
        command.code = static_cast<CommandCode>(code);
        for (int i = 0; i < testing::CommandArguments(code); ++i) {
          command.arguments[i] = static_cast<uint8_t>(fill + i);
        }
        ExpectComesBack(command, "COMMAND");
      }
    }
  }
}

TEST(MessagesComeBack, AcksAndEvents) {
  for (const uint8_t id : kIds) {
    for (const uint8_t seq : kBytes) {
      ExpectComesBack(EventAck{id, seq}, "EVENT_ACK");
      for (const uint8_t code : kBytes) {
        for (const int16_t value : kNarrow) {
          ExpectComesBack(CommandAck{id, seq, static_cast<CommandCode>(code), value},
                          "COMMAND_ACK");
          ExpectComesBack(EventReport{id, seq, static_cast<EventCode>(code), value}, "EVENT");
        }
      }
      for (const uint8_t opcode : kBytes) {
        for (const uint8_t reason : kBytes) {
          ExpectComesBack(ErrorAnswer{id, opcode, static_cast<Reason>(reason), seq}, "ERROR");
        }
      }
    }
  }
}

// Gives every field another value, beginning with `value`.
struct Filler {
  template <typename Field>
  void Add(const char* /*name*/, Field& field) {
    field = static_cast<Field>(value++);
  }

  unsigned value;
};

TEST(MessagesComeBack, HelloAndItsAnswer) {
  for (const uint16_t word : kWords) {
    for (const uint8_t byte : kBytes) {
      HelloRequest request;
      HelloAnswer answer;
      Filler filler{word + 3u * byte};
      ForEachField(request, &filler);
      ForEachField(answer, &filler);
      ExpectComesBack(request, "HELLO");
      ExpectComesBack(answer, "HELLO_ANSWER");
    }
  }
}

TEST(MessagesComeBack, PingsOfEveryLength) {
  for (uint8_t length = 0; length <= kMaxPing; ++length) {
    for (const bool answer : {false, true}) {
      Ping ping;
      ping.id = 6;
      ping.answer = answer;
      ping.length = length;
      for (uint8_t i = 0; i < length; ++i) {
        ping.payload[i] = static_cast<uint8_t>(0x0F + i);
      }
      ExpectComesBack(ping, answer ? "PING_ANSWER" : "PING");
    }
  }
}

TEST(MessagesComeBack, RoundsOfEverySize) {
  for (uint8_t answers = 0; answers <= kMaxTurns; ++answers) {
    for (uint8_t turns = 0; turns <= kMaxTurns; ++turns) {
      Round round;
      round.number = static_cast<uint8_t>(answers + 250);
      round.turn_ms = turns;
      round.turn_bytes = answers;
      round.slot_ms = static_cast<uint8_t>(16 + turns);
      round.open_slots = kOpenUntilNextRound;
      round.answer_count = answers;
      round.turn_count = turns;
      for (int i = 0; i < answers; ++i) {
        round.answers[i] = {kNarrow[i], kNarrow[answers - 1 - i]};
      }
      for (int i = 0; i < turns; ++i) {
        round.turns[i] = static_cast<uint8_t>(i % 2 == 0 ? 1 + i : 254 - i);
      }
      ExpectComesBack(round, "ROUND");
    }
  }
}

// ---- What Decode accepts

TEST(Decode, AcceptsExactlyTheLengthsOfTheTable) {
  for (unsigned opcode = 0; opcode <= 0xFF; ++opcode) {
    for (unsigned length = 0; length <= kMaxData; ++length) {
      Message message;
      message.id = opcode == kRound ? kBroadcastId : 1;
      message.opcode = static_cast<uint8_t>(opcode);
      if (opcode == kRound) {
        message.data[5] = 0x11;  // an answer and a turn
        message.data[10] = 1;
      }
      message.length = static_cast<uint8_t>(length);
      ASSERT_EQ(AcceptedAs(message), ExpectedNames(message)) << opcode << ", length " << length;
    }
  }
}

TEST(Decode, AcceptsCommandsOfTheirCodesLengthOnly) {
  for (unsigned code = 0; code <= 0xFF; ++code) {
    for (unsigned length = 0; length <= kMaxData; ++length) {
      Message message;
      message.id = 1;
      message.opcode = kCommand;
      message.length = static_cast<uint8_t>(length);
      message.data[1] = static_cast<uint8_t>(code);
      ASSERT_EQ(AcceptedAs(message), ExpectedNames(message)) << code << ", length " << length;
    }
  }
}

void ExpectSame(const Round& round, const testing::NaiveRound& naive) {
  EXPECT_EQ(naive.header, (std::vector<int>{round.number, round.turn_ms, round.turn_bytes,
                                            round.slot_ms, round.open_slots}));
  EXPECT_EQ(naive.turns, std::vector<int>(round.turns, round.turns + round.turn_count));
  ASSERT_EQ(naive.answers.size(), round.answer_count);
  for (size_t i = 0; i < naive.answers.size(); ++i) {
    const RoundAnswer& answer = round.answers[i];
    EXPECT_EQ(naive.answers[i], (std::pair<int, int>{answer.left, answer.right}));
  }
}

// Of any size and with any count, most of which do not fit it.
TEST(Decode, ReadsARoundAsTheNaiveReaderDoes) {
  std::mt19937 random(2);
  const auto any = [&random](unsigned limit) { return static_cast<uint8_t>(random() % limit); };
  int good = 0;
  for (int i = 0; i < 200'000; ++i) {
    testing::Bytes body{any(50) == 0 ? any(256) : kBroadcastId, kRound};
    const uint8_t answers = any(14);
    const uint8_t turns = any(14);
    const size_t length = any(3) == 0 ? any(kMaxData + 1) : 6u + 4u * answers + turns;
    while (body.size() < 2 + std::min<size_t>(length, kMaxData)) {
      const uint8_t byte = any(256);
      body.push_back(body.size() == 7 ? static_cast<uint8_t>(16 * turns + answers) : byte);
    }
    const auto naive = testing::ReadNaiveRound(body);
    Round round;
    ASSERT_EQ(Decode(testing::ToMessage(body), &round), naive.has_value());
    if (naive) {
      ++good;
      ExpectSame(round, *naive);
    }
  }
  EXPECT_GT(good, 10'000);
}

TEST(Decode, ARoundThatIsNoneLeavesTheLastOneAsItWas) {
  Round round;
  ASSERT_TRUE(Decode(testing::ToMessage({255, kRound, 9, 8, 7, 6, 5, 0x20, 4, 3}), &round));
  const Round before = round;
  EXPECT_FALSE(Decode(testing::ToMessage({255, kRound, 1, 2, 3, 4, 5, 0x20, 1, 0}), &round));
  EXPECT_EQ(round, before);
}

TEST(Decode, ACommandWithoutArgumentsLeavesNoneOfTheLastOne) {
  Command command;
  ASSERT_TRUE(Decode(testing::ToMessage({1, kCommand, 7, 8, 1, 2, 3, 4, 5}), &command));
  ASSERT_TRUE(Decode(testing::ToMessage({1, kCommand, 8, 1}), &command));
  Command halt;
  halt.id = 1;
  halt.seq = 8;
  EXPECT_EQ(command, halt);
}

// Decodes as each message that it is, and encodes again to the same bytes.
struct RoundTrips {
  template <typename M>
  void Visit(M decoded) {
    if (Decode(message, &decoded)) {
      Message again;
      EXPECT_TRUE(Encode(decoded, &again));
      EXPECT_EQ(ToBody(again), ToBody(message));
      ++count;
    }
  }

  const Message& message;
  int count = 0;
};

TEST(Decode, LosesNoBitOfAnyMessage) {
  std::mt19937 random(1);
  const auto table = testing::MessageTable();
  for (unsigned opcode = 0; opcode <= 0xFF; ++opcode) {
    const testing::TableRow& row = table[opcode];
    for (int round = 0; round < 200 && !row.name.empty(); ++round) {
      Message message;
      message.id = static_cast<uint8_t>(random());
      message.opcode = static_cast<uint8_t>(opcode);
      for (uint8_t& byte : message.data) {
        byte = static_cast<uint8_t>(random());
      }
      const int spread = row.most - row.least + 1;
      int length = row.least + static_cast<int>(random() % 1000) % spread;
      if (row.name == "COMMAND") {
        message.data[1] = static_cast<uint8_t>(1 + random() % 9);
        length = 2 + testing::CommandArguments(message.data[1]);
      }
      if (row.name == "SCAN_ANSWER") {
        length = 1 + 8 * static_cast<int>(random() % 8);
      }
      if (row.name == "RESOLVE_ANSWER") {
        length = 14 + std::min(length - 14, int{message.data[13]});
      }
      if (row.name == "ROUND") {
        const int turns = static_cast<int>(random() % 12);
        message.id = kBroadcastId;
        const int answers = static_cast<int>(random() % 12);
        message.data[5] = static_cast<uint8_t>(16 * turns + answers);
        length = 6 + 4 * answers + turns;
        for (int i = length - turns; i < length; ++i) {
          message.data[i] = static_cast<uint8_t>(1 + random() % 254);
        }
      }
      message.length = static_cast<uint8_t>(length);
      RoundTrips trips{message};
      ForEachMessage(&trips);
      ASSERT_EQ(trips.count, 1) << row.name;
    }
  }
}

// ---- What Encode refuses or mends

TEST(Encode, ANarrowMessageRefusesCoordinatesOutsideOfItsRange) {
  const auto fits = [](int32_t x, int32_t y) {
    Message message;
    const bool sense = Encode(SenseRequest{1, 1, false, {x, y, 0}}, &message);
    const bool trace = Encode(TraceRequest{1, 1, false, 0, {x, y, 0}}, &message);
    EXPECT_EQ(sense, trace) << x << ", " << y;
    EXPECT_EQ(FitsNarrow(x, y), sense) << x << ", " << y;
    return sense;
  };
  for (const int32_t inside : {-32768, 0, 32767}) {
    EXPECT_TRUE(fits(inside, 0));
    EXPECT_TRUE(fits(0, inside));
  }
  for (const int32_t outside : {INT32_MIN, -65536, -32769, 32768, 65535, 65536, INT32_MAX}) {
    EXPECT_FALSE(fits(outside, 0)) << outside;
    EXPECT_FALSE(fits(0, outside)) << outside;
    EXPECT_FALSE(fits(outside, outside)) << outside;
  }
}

TEST(Encode, APingIsCutToItsLimit) {
  Ping ping;
  ping.id = 1;
  ping.length = kMaxPing + 1;
  Message message;
  Encode(ping, &message);
  EXPECT_EQ(message.length, kMaxPing);
}

TEST(Encode, ACommandOfUnknownCodeCarriesNoArguments) {
  Command command;
  command.id = 1;
  command.code = static_cast<CommandCode>(10);
  Message message;
  Encode(command, &message);
  EXPECT_EQ(ToBody(message), (testing::Bytes{1, kCommand, 0, 10}));
  EXPECT_TRUE(AcceptedAs(message).empty());
}

// ---- What follows from the lists of fields

TEST(Fields, OffsetsAreThoseOfTheSpecification) {
  static_assert(OffsetOf(&HelloAnswer::nonce) == 0);
  static_assert(OffsetOf(&HelloAnswer::protocol_version) == 2);
  static_assert(OffsetOf(&HelloAnswer::epoch) == 3);
  static_assert(OffsetOf(&HelloAnswer::last_seq) == 14);
  static_assert(OffsetOf(&Round::answer_count) == 5);
  static_assert(OffsetOf(&Round::turn_count) == 5);
  static_assert(OffsetOf(&TagWriteRequest::time) == 17);
  static_assert(OffsetOf(&TagWriteRequest::words, 0) == 21);
  static_assert(OffsetOf(&TagReadAnswer::words, kWordObject) == 40);
  static_assert(OffsetOf(&ResolveAnswer::text, 0) == 14);
  static_assert(OffsetOf(&ScanAnswer::rows, 0) == 1);
  static_assert(OffsetOf(&Round::turns, 1) == 255, "depends on the answers");
  static_assert(SizeOf<SenseRequest>(false).least == 6);
  static_assert(SizeOf<SenseRequest>(true).least == 10);
}

TEST(Fields, MessagesAreEqualIfAllFieldsInUseAre) {
  const TraceRequest trace{2, 3, true, 9, {5, -6, 7}};
  EXPECT_TRUE(trace == (TraceRequest{2, 3, true, 9, {5, -6, 7}}));
  EXPECT_FALSE(trace == (TraceRequest{2, 3, false, 9, {5, -6, 7}}));
  EXPECT_FALSE(trace == (TraceRequest{2, 3, true, 9, {5, -6, 8}}));
  Ping ping{1, false, 2, {4, 5, 6}};
  EXPECT_TRUE(ping == (Ping{1, false, 2, {4, 5, 7}})) << "beyond the count";
  EXPECT_FALSE(ping == (Ping{1, false, 3, {4, 5, 6}}));
}

TEST(Fields, AMessageIsPrintedByNameAndFields) {
  EXPECT_EQ(testing::TextOf(SenseAnswer{3, 1, true, -5, 6}),
            "SENSE_WIDE_ANSWER id=3 type=1 wide=1 left=-5 right=6");
  EXPECT_EQ(testing::TextOf(Ping{1, true, 2, {4, 5}}),
            "PING_ANSWER id=1 answer=1 count=2 payload=4 payload=5");
}

}  // namespace
}  // namespace pheromone::protocol
