// The bytes of a capture, by hand and there and back.

#include "server/store/capture/format.h"

#include <gtest/gtest.h>

#include "server/base/bytes.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/capture/crc32.h"
#include "server/store/capture/in_flight.h"

namespace pheromone::capture {
namespace {

using engine::testing::Deposit;
using engine::testing::Hello;
using engine::testing::Trace;

TEST(Crc32, GivesTheCheckValueOfTheCatalogue) {
  EXPECT_EQ(Crc32("123456789"), 0xCBF43926u);
  EXPECT_EQ(Crc32(""), 0u);
}

std::string FromHex(std::string_view hex) {
  std::string bytes;
  std::string digits;
  for (const char c : hex) {
    if (c != ' ') {
      digits += c;
    }
    if (digits.size() == 2) {
      bytes += static_cast<char>(std::stoi(digits, nullptr, 16));
      digits.clear();
    }
  }
  return bytes;
}

// Laid out by hand from the pcapng draft (draft-ietf-opsawg-pcapng, section 4.3) and README.md.
TEST(Format, APacketIsAnEnhancedPacketBlock) {
  const Packet packet{0x1122334455667788, 1, 7, Direction::kFromRobots, "\x10\x02\x03", 0x0A0B0C0D};
  const std::string body = FromHex(
      "01000000 44332211 88776655 0B000000 0B000000"  // interface, time, lengths
      "0100 07000000 01 00 100203 00"                 // link, connection, direction; bytes; padding
      "0200 0400 01000000"                            // epb_flags: inbound
      "0500 0800 0900000000000000"                    // epb_packetid: record 9
  );
  const std::string time = FromHex("0D0C0B0A");
  ByteWriter crc;
  crc.U32(Crc32(body + time));
  const std::string expected = FromHex("06000000 50000000") + body + FromHex("0180 0800") + time +
                               crc.bytes() + FromHex("00000000 50000000");
  EXPECT_EQ(EncodeRecord(packet, 9), expected);
}

TEST(Format, AGapIsABlockForLocalUse) {
  const std::string sealed = FromHex("0200000000000000 0100000000000000 0300000000000000");
  ByteWriter crc;
  crc.U32(Crc32(sealed));
  const std::string expected = FromHex("09485080 2C000000") + crc.bytes() + FromHex("18000000") +
                               sealed + FromHex("2C000000");
  EXPECT_EQ(EncodeRecord(Gap{1, 3}, 2), expected);
}

// One of each, with something in every field.
std::vector<Record> OneOfEach() {
  Start start{1, 2, 3, "0.1", "# text", {{"radio-a", 20, false}, {"udp", 0, true}}, {}, 99};
  start.under_way = {{1, Hello(1, 2)}};
  engine::CommandIssued command{1, 3, protocol::CommandCode::kSpeed, {1, 2}};
  return {
      start,
      State{std::string(5'000, 'x')},
      Packet{5, 1, 6, Direction::kToRobots, "abcde", 0},
      PartialFrame{1, 6, 7, "\x10\x02"},
      Batch{8, 1, {9, -10}, {{Trace(1, 2), 11, {}}, {Deposit(1, 3), 0, protocol::Reason::kBusy}}},
      EventApplied{12, {13, 14}, command},
      Rejected{1, Hello(4, 4), protocol::Reason::kBusy},
      Dropped{{1, Hello(5, 5)}},
      FromBefore{{0, Hello(6, 6)}},
      Gap{15, 16},
      End{17, 18, 19, {{0, Hello(7, 7)}}},
      Unlogged{{1, Hello(8, 8)}}};
}

TEST(Format, EveryRecordComesBack) {
  const std::vector<Record> all = OneOfEach();
  ASSERT_EQ(all.size(), std::variant_size_v<Record>);
  for (size_t i = 0; i < all.size(); ++i) {
    ASSERT_EQ(all[i].index(), i);
    const std::string block = EncodeRecord(all[i], 40 + i);
    ASSERT_EQ(block.size() % 4, 0u);
    ByteReader reader(block);
    const uint32_t type = reader.U32();
    ASSERT_EQ(reader.U32(), block.size());
    ASSERT_TRUE(IsRecord(type));
    const auto back = DecodeRecord(type, std::string_view(block).substr(8, block.size() - 12));
    ASSERT_TRUE(back.ok()) << back.error();
    EXPECT_EQ(back.value().number, 40 + i);
    EXPECT_EQ(back.value().record.index(), i);
    EXPECT_EQ(EncodeRecord(back.value().record, 40 + i), block);
  }
}

TEST(Format, ADamagedRecordIsRefusedWhereverTheDamageIs) {
  for (const Record& record : OneOfEach()) {
    const std::string block = EncodeRecord(record, 1);
    for (size_t at = 8; at < std::min<size_t>(block.size() - 4, 300); ++at) {
      std::string damaged = block;
      damaged[at] ^= 0x40;
      ByteReader reader(damaged);
      const auto back =
          DecodeRecord(reader.U32(), std::string_view(damaged).substr(8, block.size() - 12));
      if (back.ok()) {  // in the padding, or in the end of the options
        EXPECT_EQ(EncodeRecord(back.value().record, back.value().number), block) << at;
      }
    }
  }
}

TEST(InFlight, GivesEachMessageOnceAndThoseToAllAgain) {
  InFlight in_flight;
  in_flight.Add({0, Hello(1, 1)});
  in_flight.Add({0, Hello(1, 1)});
  in_flight.Add({0, Hello(1, 2)});
  EXPECT_FALSE(in_flight.Take({1, Hello(1, 1)}));
  EXPECT_TRUE(in_flight.Take({0, Hello(1, 2)}));
  EXPECT_TRUE(in_flight.Take({0, Hello(1, 1)}));
  EXPECT_TRUE(in_flight.Take({0, Hello(1, 1)}));
  EXPECT_FALSE(in_flight.Take({0, Hello(1, 1)}));
  EXPECT_EQ(in_flight.First(0, 1), nullptr);
  in_flight.Add({0, Hello(protocol::kBroadcastId, 1)});
  EXPECT_TRUE(in_flight.Take({0, Hello(protocol::kBroadcastId, 1)}));
  EXPECT_TRUE(in_flight.Take({0, Hello(protocol::kBroadcastId, 1)}));
  EXPECT_EQ(in_flight.size(), 0u);
}

TEST(InFlight, ForgetsTheOldestOfTooMany) {
  InFlight in_flight;
  for (uint16_t nonce = 0; nonce <= InFlight::kMax; ++nonce) {
    in_flight.Add({0, Hello(1, nonce)});
  }
  EXPECT_EQ(in_flight.size(), InFlight::kMax);
  EXPECT_FALSE(in_flight.Take({0, Hello(1, 0)}));
}

}  // namespace
}  // namespace pheromone::capture
