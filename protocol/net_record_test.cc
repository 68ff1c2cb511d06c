#include "protocol/net_record.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "protocol/byte_order.h"
#include "protocol/crc16.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::NetRecordVector;
using RecordFields = std::map<std::string, std::string>;

constexpr uint32_t kHash = 0x12345678;

const std::map<NetRecordFault, std::string> kFaults = {
    {NetRecordFault::kNone, "ok"},         {NetRecordFault::kNoRecord, "no-record"},
    {NetRecordFault::kVersion, "version"}, {NetRecordFault::kCrc, "crc"},
    {NetRecordFault::kKind, "kind"},       {NetRecordFault::kHash, "hash"},
    {NetRecordFault::kValue, "value"}};

RecordFields TextsOf(const TriggerRecord& record) {
  std::string candidates;
  for (int i = 0; i < record.count; ++i) {
    candidates += (i == 0 ? "" : ",") + std::to_string(record.candidates[i]);
  }
  return {{"candidates", candidates.empty() ? "-" : candidates}};
}

RecordFields TextsOf(const EnvironmentRecord& record) {
  return {{"state", std::to_string(record.state)},
          {"outcome", std::to_string(static_cast<int>(record.outcome))},
          {"robot", std::to_string(record.robot)},
          {"seq", std::to_string(record.seq)},
          {"amount", std::to_string(record.amount)},
          {"left", std::to_string(record.left)}};
}

RecordFields TextsOf(const RobotRecord& record) {
  return {{"seq", std::to_string(record.seq)},
          {"action", std::to_string(static_cast<int>(record.action))},
          {"transition", std::to_string(record.transition)},
          {"amount", std::to_string(record.amount)},
          {"energy", std::to_string(record.energy)}};
}

template <typename Record>
void Check(const NetRecordVector& vector) {
  ASSERT_EQ(vector.bytes.size(), kNetStatementSize);
  Record record = {};
  record.hash = 77;
  const NetRecordFault fault = Decode(vector.bytes.data(), vector.hash, &record);
  EXPECT_EQ(kFaults.at(fault), vector.verdict);
  EXPECT_EQ(IsNetRecord(vector.bytes.data()), vector.verdict != "no-record");
  if (fault != NetRecordFault::kNone) {
    EXPECT_EQ(record.hash, 77U) << "it was filled";
    EXPECT_EQ(TextsOf(record), TextsOf(Record{}));
    return;
  }
  EXPECT_EQ(record.hash, vector.hash);
  EXPECT_EQ(NetHashOf(vector.bytes.data()), vector.hash);
  EXPECT_EQ(TextsOf(record), vector.fields);
  uint8_t statement[kNetStatementSize] = {};
  Encode(record, statement);
  EXPECT_EQ(testing::Bytes(statement, statement + sizeof(statement)), vector.bytes);
}

TEST(NetRecord, TheVectorsSayWhatItIs) {
  const std::vector<NetRecordVector> vectors = testing::LoadNetRecords();
  std::map<std::string, int> seen;
  for (const NetRecordVector& vector : vectors) {
    SCOPED_TRACE(vector.name);
    ++seen[vector.wanted + " " + vector.verdict];
    if (vector.wanted == "trigger") {
      Check<TriggerRecord>(vector);
    } else if (vector.wanted == "environment") {
      Check<EnvironmentRecord>(vector);
    } else {
      Check<RobotRecord>(vector);
    }
  }
  for (const char* wanted : {"trigger", "environment", "robot"}) {
    for (const char* verdict : {"ok", "hash", "value", "kind"}) {
      EXPECT_GT(seen[std::string(wanted) + " " + verdict], 0) << wanted << " " << verdict;
    }
  }
}

// CRC-16/ARC finds every single bit, and every burst of up to 16 bits.
TEST(NetRecord, NoSingleBitOfARecordIsChangedUnnoticed) {
  uint8_t statement[kNetStatementSize];
  Encode(RobotRecord{kHash, 7, NetAction::kTake, 5, 100, 3}, statement);
  for (int bit = 0; bit < 8 * kNetStatementSize; ++bit) {
    statement[bit / 8] = static_cast<uint8_t>(statement[bit / 8] ^ 1 << bit % 8);
    RobotRecord record = {};
    EXPECT_NE(Decode(statement, kHash, &record), NetRecordFault::kNone) << bit;
    statement[bit / 8] = static_cast<uint8_t>(statement[bit / 8] ^ 1 << bit % 8);
  }
}

TEST(NetRecord, EverythingThatDecodesIsEncodedAgainOrHasSpareBytes) {
  std::mt19937 random(5);
  int decoded = 0;
  for (int i = 0; i < 100'000; ++i) {
    uint8_t statement[kNetStatementSize];
    for (uint8_t& byte : statement) {
      byte = static_cast<uint8_t>(random() % 3 == 0 ? random() : random() % 4);
    }
    PutI32(statement, kTypeNetRecord);
    statement[4] = kNetRecordVersion;
    PutU32(statement + 6, kHash);
    PutU16(statement + 22, Crc16(statement + 4, 18));
    RobotRecord robot = {};
    EnvironmentRecord environment = {};
    TriggerRecord trigger = {};
    uint8_t again[kNetStatementSize] = {};
    if (Decode(statement, kHash, &robot) == NetRecordFault::kNone) {
      Encode(robot, again);
      EXPECT_EQ(0, std::memcmp(statement + 4, again + 4, 9));
    } else if (Decode(statement, kHash, &environment) == NetRecordFault::kNone) {
      Encode(environment, again);
      EXPECT_EQ(0, std::memcmp(statement + 4, again + 4, 13));
    } else if (Decode(statement, kHash, &trigger) == NetRecordFault::kNone) {
      Encode(trigger, again);
      EXPECT_EQ(0, std::memcmp(statement + 4, again + 4, 7u + trigger.count));
    } else {
      continue;
    }
    ++decoded;
  }
  EXPECT_GT(decoded, 1000);
}

TEST(NetRecord, MoreCandidatesThanFitAreCutOff) {
  TriggerRecord record = {kHash, 200, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}};
  uint8_t statement[kNetStatementSize];
  Encode(record, statement);
  ASSERT_EQ(Decode(statement, kHash, &record), NetRecordFault::kNone);
  EXPECT_EQ(record.count, kMaxCandidates);
}

}  // namespace
}  // namespace pheromone::protocol
