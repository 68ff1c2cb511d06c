// The tags of a bench and the reader that the environment has there, as naive as can be: it accepts
// whatever it is told, unless a test says otherwise. For tests only.
//
//   NaiveBench bench;                       // with the tags of the shipped robots' net
//   bench.in_range = {bench.tag("N1")};
//   bench.Serve(&exchange);                 // a request of TAG is executed and answered
//   bench.Act();                            // the reader's instant: every record is handled
//   bench.handled                           // what has been told, in order
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "client_fw/core/requests/tag_exchange.h"
#include "client_fw/core/tasks/robot_net.h"
#include "protocol/byte_order.h"
#include "protocol/net_record.h"
#include "protocol/tag_messages.h"

namespace pheromone {
namespace client {

constexpr int32_t kNaiveReader = 90;  // the environment, as an author
constexpr int32_t kNaiveRobot = 15;
constexpr int32_t kOtherRobot = 16;

struct NaiveSlot {
  int32_t author = 0;
  uint16_t generation = 0;
  uint16_t lease_s = 0;
  uint8_t statement[protocol::kNetStatementSize] = {};
};

struct NaiveTag {
  std::string name;
  uint16_t generation = 100;
  bool has_reader = false;
  NaiveSlot slots[8];
  protocol::EnvironmentRecord shown = {};

  void Put(int slot, int32_t author, const uint8_t* statement, uint16_t lease_s = 0) {
    slots[slot].author = author;
    ++slots[slot].generation;
    ++generation;
    slots[slot].lease_s = lease_s;
    std::memcpy(slots[slot].statement, statement, sizeof(slots[slot].statement));
  }
  void Erase(int slot) {
    slots[slot].author = 0;
    ++slots[slot].generation;
    ++generation;
  }
};

/// A record that was handled.
struct NaiveRecord {
  std::string tag;
  protocol::NetAction action;
  int transition;
  uint8_t seq;
  uint16_t amount;
  uint16_t energy;
};

class NaiveBench {
 public:
  NaiveBench() {
    const std::map<std::string, std::vector<uint8_t>> vectors = {
        {"N1", {1}}, {"P", {2, 8, 15}}, {"N5", {3}},  {"S1", {4}},  {"Src", {5, 12}}, {"S3", {6}},
        {"N2", {7}}, {"N4", {9}},       {"N6", {10}}, {"S2", {11}}, {"S4", {13}},     {"N3", {14}}};
    uint16_t number = 31;
    for (const auto& [name, candidates] : vectors) {
      NaiveTag* const tag = &tags[number++];
      tag->name = name;
      tag->has_reader = true;
      protocol::TriggerRecord trigger = {kRobotNet.hash, 0, {}};
      for (const uint8_t candidate : candidates) {
        trigger.candidates[trigger.count++] = candidate;
      }
      uint8_t statement[protocol::kNetStatementSize];
      protocol::Encode(trigger, statement);
      tag->Put(0, kNaiveReader, statement);
      tag->shown.hash = kRobotNet.hash;
      Show(tag);
    }
  }

  uint16_t tag(const std::string& name) const {
    for (const auto& [number, tag] : tags) {
      if (tag.name == name) {
        return number;
      }
    }
    ADD_FAILURE() << "no tag " << name;
    return 0;
  }
  NaiveTag* at(const std::string& name) { return &tags[tag(name)]; }

  /// Writes slot 1, if it has changed.
  void Show(NaiveTag* tag) {
    uint8_t statement[protocol::kNetStatementSize];
    protocol::Encode(tag->shown, statement);
    if (tag->slots[1].author != kNaiveReader ||
        std::memcmp(tag->slots[1].statement, statement, sizeof(statement)) != 0) {
      tag->Put(1, kNaiveReader, statement);
    }
  }

  /// The reader's instant: one record of each tag.
  void Act() {
    for (auto& [number, tag] : tags) {
      if (!tag.has_reader) {
        continue;
      }
      for (int slot = 2; slot < 8; ++slot) {
        const int32_t author = tag.slots[slot].author;
        protocol::RobotRecord record = {};
        if (author == 0 || protocol::Decode(tag.slots[slot].statement, kRobotNet.hash, &record) !=
                               protocol::NetRecordFault::kNone) {
          continue;
        }
        tag.Erase(slot);
        Handle(&tag, author, record);
        break;
      }
      Show(&tag);
    }
  }

  /// Executes the request and answers it.
  void Serve(TagExchange* exchange) {
    ASSERT_EQ(TagExchange::kAsked, exchange->state);
    protocol::Message answer;
    const protocol::Reason reason = Execute(exchange->message, &answer);
    exchange->reason = reason;
    exchange->state =
        reason == protocol::Reason::kNone ? TagExchange::kAnswered : TagExchange::kRefused;
    exchange->message = reason == protocol::Reason::kNone ? answer : exchange->message;
  }

  /// The answer, or why there is none.
  protocol::Reason Execute(const protocol::Message& request, protocol::Message* answer) {
    ++requests;
    protocol::ScanRequest scan;
    protocol::TagReadRequest read;
    protocol::TagWriteRequest write;
    protocol::SymbolRequest symbol;
    if (Decode(request, &scan)) {
      return Scan(scan, answer);
    }
    if (Decode(request, &read)) {
      return Read(read, answer);
    }
    if (Decode(request, &write)) {
      return Write(write, answer);
    }
    EXPECT_TRUE(Decode(request, &symbol)) << "opcode " << int{request.opcode};
    ++names;
    Encode(protocol::SymbolAnswer{request.id, symbol.seq, symbol.kind, kNaiveRobot}, answer);
    return protocol::Reason::kNone;
  }

  std::map<uint16_t, NaiveTag> tags;
  std::vector<uint16_t> in_range;
  std::map<uint16_t, int16_t> distance;  ///< of those in range, if not 0
  std::vector<NaiveRecord> handled;
  int requests = 0;
  int names = 0;
  int reads = 0;
  int scans = 0;
  int writes = 0;
  bool shows_green = true;
  uint16_t source = 1000;
  std::function<bool(const NaiveRecord&)> accepts = [](const NaiveRecord&) { return true; };
  /// Called before a WRITE is executed.
  std::function<void()> before_write = [] {};
  protocol::Reason refuses_writes = protocol::Reason::kNone;

 private:
  void Handle(NaiveTag* tag, int32_t author, const protocol::RobotRecord& record) {
    protocol::EnvironmentRecord* const shown = &tag->shown;
    if (auto last = last_.find(author); last != last_.end() && last->second.seq == record.seq) {
      shown->robot = author;  // a repetition: the same again
      shown->seq = record.seq;
      shown->outcome = last->second.outcome;
      shown->amount = last->second.amount;
      return;
    }
    const NaiveRecord told{tag->name,  record.action, record.transition,
                           record.seq, record.amount, record.energy};
    handled.push_back(told);
    const bool accepted = accepts(told);
    shown->robot = author;
    shown->seq = record.seq;
    shown->outcome = accepted ? protocol::NetOutcome::kAccepted : protocol::NetOutcome::kRefused;
    shown->amount = 0;
    if (accepted && record.action == protocol::NetAction::kTake) {
      shown->amount = record.amount < source ? record.amount : source;
      source = static_cast<uint16_t>(source - shown->amount);
    }
    shown->left = source;
    const uint8_t without_green = static_cast<uint8_t>(shown->state & ~protocol::kNetGreen);
    const bool green = accepted && record.action == protocol::NetAction::kPresent && shows_green;
    shown->state =
        green ? static_cast<uint8_t>(without_green | protocol::kNetGreen) : without_green;
    last_[author] = *shown;
  }

  bool IsInRange(uint16_t tag) const {
    for (const uint16_t number : in_range) {
      if (number == tag) {
        return true;
      }
    }
    return false;
  }

  protocol::Reason Scan(const protocol::ScanRequest& scan, protocol::Message* answer) {
    ++scans;
    protocol::ScanAnswer found;
    found.id = scan.id;
    for (const auto& [number, tag] : tags) {
      if (number <= scan.after || !IsInRange(number)) {
        continue;
      }
      if (found.count == page_size) {
        ++found.more;
        continue;
      }
      const auto at = distance.find(number);
      found.rows[found.count++] = {number, at == distance.end() ? int16_t{0} : at->second, 0,
                                   tag.generation};
    }
    Encode(found, answer);
    return protocol::Reason::kNone;
  }

  protocol::Reason Read(const protocol::TagReadRequest& read, protocol::Message* answer) {
    ++reads;
    if (!IsInRange(read.tag)) {
      return protocol::Reason::kNoTagInRange;
    }
    const NaiveTag& tag = tags[read.tag];
    protocol::TagReadAnswer found;
    found.id = read.id;
    found.tag = read.tag;
    found.slots = 8;
    found.slot = found.next = protocol::kNoSlot;
    found.tag_generation = tag.generation;
    for (uint8_t i = 8; i-- > read.slot;) {
      if (tag.slots[i].author != 0) {
        found.next = found.slot;
        found.slot = i;
      }
    }
    if (found.slot != protocol::kNoSlot) {
      const NaiveSlot& slot = tag.slots[found.slot];
      found.slot_generation = slot.generation;
      found.words[protocol::kWordAuthor] = slot.author;
      for (size_t i = 0; i < protocol::kStatementWords; ++i) {
        found.words[2 + i] = protocol::GetI32(&slot.statement[4 * i]);
      }
    }
    Encode(found, answer);
    return protocol::Reason::kNone;
  }

  protocol::Reason Write(const protocol::TagWriteRequest& write, protocol::Message* answer) {
    before_write();
    if (refuses_writes != protocol::Reason::kNone) {
      return refuses_writes;
    }
    if (!IsInRange(write.tag)) {
      return protocol::Reason::kNoTagInRange;
    }
    NaiveTag* const tag = &tags[write.tag];
    if ((write.flags & protocol::kTagExpect) != 0 && write.expected != tag->generation) {
      return protocol::Reason::kGenerationChanged;
    }
    EXPECT_EQ(protocol::kNoSlot, write.slot);
    for (uint8_t i = 0; i < 8; ++i) {
      if (tag->slots[i].author != 0) {
        continue;
      }
      ++writes;
      uint8_t statement[protocol::kNetStatementSize];
      for (size_t k = 0; k < protocol::kStatementWords; ++k) {
        protocol::PutI32(&statement[4 * k], write.words[k]);
      }
      tag->Put(i, kNaiveRobot, statement, write.lease_s);
      Encode(protocol::TagWritten{write.id, false, write.seq, write.tag, i,
                                  tag->slots[i].generation, tag->generation},
             answer);
      return protocol::Reason::kNone;
    }
    return protocol::Reason::kTagFull;
  }

 public:
  uint8_t page_size = protocol::kMaxTagsInRange;  ///< rows of an answer to SCAN

 private:
  std::map<int32_t, protocol::EnvironmentRecord> last_;  // by author
};

/// The tags of a round trip, from the nest.
inline std::vector<std::string> TripA() {
  return {"N1", "P", "N5", "S1", "Src", "S3", "N2", "P", "N4"};
}
inline std::vector<std::string> TripB() {
  return {"N1", "P", "N6", "S2", "Src", "S4", "N3", "P", "N4"};
}

}  // namespace client
}  // namespace pheromone
