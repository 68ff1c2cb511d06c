#include "protocol/opcodes.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "protocol/testing/message_table.h"

namespace pheromone::protocol {
namespace {

using testing::MessageTable;
using testing::TableRow;

TEST(LengthOf, MatchesTheTableForAll256Opcodes) {
  const auto table = MessageTable();
  for (unsigned opcode = 0; opcode <= 0xFF; ++opcode) {
    const TableRow& row = table[opcode];
    const LengthRule rule = LengthOf(static_cast<uint8_t>(opcode));
    EXPECT_EQ(rule.known, !row.name.empty()) << opcode;
    EXPECT_EQ(rule.least, row.least) << opcode;
    EXPECT_EQ(rule.most, row.most) << opcode;
  }
}

TEST(LengthOf, NoOpcodeIsTheDelimiterOrZero) {
  EXPECT_FALSE(LengthOf(0x10).known);
  EXPECT_FALSE(LengthOf(0x00).known);
}

TEST(LengthOf, PheromoneTypeZeroDoesNotExist) {
  for (const unsigned service : {0x00u, 0x10u, 0x20u, 0x30u, 0x60u}) {
    EXPECT_FALSE(LengthOf(static_cast<uint8_t>(service)).known) << service;
    EXPECT_FALSE(LengthOf(static_cast<uint8_t>(0x80u | service)).known) << service;
  }
}

TEST(LengthOf, TheTagServiceHasSixFunctions) {
  for (unsigned function = 0; function <= 15; ++function) {
    const bool exists = function >= 1 && function <= 6;
    EXPECT_EQ(LengthOf(static_cast<uint8_t>(0x40 + function)).known, exists) << function;
    EXPECT_EQ(LengthOf(static_cast<uint8_t>(0xC0 + function)).known, exists) << function;
  }
}

TEST(LengthOf, EveryMessageFitsTheFrame) {
  for (unsigned opcode = 0; opcode <= 0xFF; ++opcode) {
    EXPECT_LE(LengthOf(static_cast<uint8_t>(opcode)).most, kMaxData) << opcode;
  }
}

TEST(CommandArgumentLength, MatchesTheTableForAll256Codes) {
  for (unsigned code = 0; code <= 0xFF; ++code) {
    const int expected = testing::CommandArguments(code);
    EXPECT_EQ(CommandArgumentLength(static_cast<uint8_t>(code)), expected < 0 ? 0xFF : expected)
        << code;
  }
}

TEST(Opcodes, BitSevenIsTheServers) {
  for (unsigned opcode = 0; opcode <= 0xFF; ++opcode) {
    EXPECT_EQ(IsFromServer(static_cast<uint8_t>(opcode)), opcode >= 128) << opcode;
  }
}

TEST(Opcodes, ServiceAndTypeAreTheBitsBelow) {
  for (unsigned opcode = 0; opcode <= 0xFF; ++opcode) {
    EXPECT_EQ(ServiceOf(static_cast<uint8_t>(opcode)), opcode % 128 / 16 * 16) << opcode;
    EXPECT_EQ(TypeOf(static_cast<uint8_t>(opcode)), opcode % 16) << opcode;
  }
}

TEST(Opcodes, FiveServicesTakeAPheromoneType) {
  const std::set<unsigned> typed = {0, 1, 2, 3, 6};
  for (unsigned opcode = 0; opcode <= 0xFF; ++opcode) {
    EXPECT_EQ(TakesType(static_cast<uint8_t>(opcode)), typed.count(opcode % 128 / 16) == 1)
        << opcode;
  }
}

// Whatever changes the server's state begins with a seq: DEPOSIT, TRACE, EVENT, TRACE_WIDE and
// three of TAG's.
TEST(Opcodes, MutatingRequestsAreTheOnesThatCarryASequence) {
  const std::set<std::string> mutating = {"DEPOSIT", "TRACE", "TRACE_WIDE", "EVENT",
                                          "WRITE",   "ERASE", "SYMBOL"};
  const auto table = MessageTable();
  for (unsigned opcode = 0; opcode <= 0xFF; ++opcode) {
    if (!table[opcode].name.empty()) {
      EXPECT_EQ(IsMutating(static_cast<uint8_t>(opcode)), mutating.count(table[opcode].name) == 1)
          << opcode;
    }
  }
}

}  // namespace
}  // namespace pheromone::protocol
