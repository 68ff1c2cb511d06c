// The messages of the TAG service (virtual RFID tags), as structs, and their one translation to and
// from Message: as messages.h, which has all the others.
//
//   TagReadRequest request;
//   if (Decode(message, &request)) ...        // opcode and length are right
//   Encode(TagWritten{id, false, seq, tag, slot, slot_generation, tag_generation}, &message);
//
// Decode checks the opcode and the exact length, and of an answer to RESOLVE that it has no more
// text than there is; nothing else. Encode yields a message whose length is right; counts over the
// arrays' sizes are cut off.
//
// A tag has slots, each empty or with one block. A block is a statement with its author and time:
// eight words of 32 bits, whose places are those of TagWord. What they mean is in README.md, "TAG".
//
// Units: x, y, dx and dy in the map's pose unit; leases in seconds. Generations wrap.
#pragma once

#include <stdint.h>

#include "protocol/messages.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace protocol {

/// Rows of one answer to SCAN.
constexpr uint8_t kMaxTagsInRange = 7;
/// `more` of an answer to SCAN: this many or more.
constexpr uint8_t kManyMoreTags = 255;
/// In a WRITE: the tag's drop policy chooses the slot. In the answer to READ: there is none.
constexpr uint8_t kNoSlot = 255;
/// Bytes of text of SYMBOL, and of one answer to RESOLVE.
constexpr uint8_t kMaxSymbolText = 56;
constexpr uint8_t kMaxResolvedText = 50;

/// Bits of `flags` in WRITE and ERASE.
constexpr uint8_t kTagReplace = 0x01;  ///< WRITE only: the author's block of the same subject ...
constexpr uint8_t kTagExpect = 0x02;   ///< only if the generation is still `expected`
/// A bit of `flags` in the answer to READ: the block is never dropped.
constexpr uint8_t kTagPrivileged = 0x01;

/// The words of a block, by place. A WRITE has those from kWordSubjectNamespace on.
enum TagWord : uint8_t {
  kWordAuthor = 0,  ///< the robot's number
  kWordTime = 1,    ///< Unix seconds, an u32
  kWordSubjectNamespace = 2,
  kWordSubject = 3,
  kWordPredicateNamespace = 4,
  kWordPredicate = 5,
  kWordObjectNamespace = 6,
  kWordObject = 7,
};
constexpr uint8_t kTagWords = 8;
constexpr uint8_t kStatementWords = kTagWords - kWordSubjectNamespace;

/// Negative namespaces: the next word is a value of this type. Other negative ones are carried as
/// they are.
enum TagType : int32_t {
  kTypeString = -1,  ///< number of a string
  kTypeChar = -2,    ///< a Unicode scalar value
  kTypeInt = -3,
  kTypeFloat = -4,       ///< the bits of an IEEE 754 binary32
  kTypeDateTime = -5,    ///< Unix seconds, an u32
  kTypeDate = -6,        ///< days since 1970-01-01
  kTypeTime = -7,        ///< ms since midnight
  kTypeFragments = -16,  ///< reserved for chains of fragments
  kTypeRobot = -17,      ///< a robot's number
  kTypeTag = -18,        ///< a tag's number
  kTypeNetRecord = -32,  ///< of a subject: the block is a record of a net (net_record.h)
};

/// What a SYMBOL defines and a RESOLVE asks for.
enum class SymbolKind : uint8_t {
  kRobot = 1,    ///< a robot's unique id, by its number
  kString = 2,   ///< a string, by the robot's number and its own
  kMapping = 3,  ///< the robot whose strings another one uses
  kRow = 4,      ///< RESOLVE only: any of these, by its place in the tables
};

/// Subject, predicate and object of a block.
template <typename Word, typename Visit>
constexpr Visit VisitStatement(Word* words, Visit&& visit) {
  return visit.Field("subject_namespace", words[0])
      .Field("subject", words[1])
      .Field("predicate_namespace", words[2])
      .Field("predicate", words[3])
      .Field("object_namespace", words[4])
      .Field("object", words[5]);
}

/// Which tags are in range of (x, y), from the first number after `after` on.
struct ScanRequest {
  uint8_t id = 0;
  int32_t x = 0;
  int32_t y = 0;
  uint16_t after = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("SCAN", kScan)
        .Field("x", it.x)
        .Field("y", it.y)
        .Field("after", it.after);
  }
};

/// A row of the answer to SCAN.
struct TagInRange {
  uint16_t tag = 0;
  int16_t dx = 0;  ///< the tag's position minus that of the request
  int16_t dy = 0;
  uint16_t generation = 0;  ///< of the tag

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Field("tag", it.tag)
        .Field("dx", it.dx)
        .Field("dy", it.dy)
        .Field("generation", it.generation);
  }
};

struct ScanAnswer {
  uint8_t id = 0;
  uint8_t more = 0;   ///< further tags in range, at most kManyMoreTags
  uint8_t count = 0;  ///< rows in use, at most kMaxTagsInRange
  TagInRange rows[kMaxTagsInRange];

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("SCAN_ANSWER", kScanAnswer)
        .Field("more", it.more)
        .Rest("rows", it.rows, it.count);
  }
};

/// The first slot of a tag at or after `slot` that is not empty.
struct TagReadRequest {
  uint8_t id = 0;
  int32_t x = 0;
  int32_t y = 0;
  uint16_t tag = 0;
  uint8_t slot = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("READ", kTagRead)
        .Field("x", it.x)
        .Field("y", it.y)
        .Field("tag", it.tag)
        .Field("slot", it.slot);
  }
};

/// With `slot` kNoSlot, all after `tag_generation` is 0.
struct TagReadAnswer {
  uint8_t id = 0;
  uint16_t tag = 0;
  uint8_t slot = 0;
  uint8_t next = 0;   ///< the next slot after it that is not empty, or kNoSlot
  uint8_t slots = 0;  ///< of the tag
  uint16_t tag_generation = 0;
  uint16_t slot_generation = 0;
  uint16_t lease_s = 0;  ///< what is left of it, rounded up; 0: no lease
  uint8_t flags = 0;     ///< kTagPrivileged
  int32_t words[kTagWords] = {};

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return VisitStatement(it.words + kWordSubjectNamespace,
                          visit.Id(it.id)
                              .Opcode("READ_ANSWER", kTagReadAnswer)
                              .Field("tag", it.tag)
                              .Field("slot", it.slot)
                              .Field("next", it.next)
                              .Field("slots", it.slots)
                              .Field("tag_generation", it.tag_generation)
                              .Field("slot_generation", it.slot_generation)
                              .Field("lease_s", it.lease_s)
                              .Field("flags", it.flags)
                              .Field("author", it.words[kWordAuthor])
                              .Field("time", it.words[kWordTime]));
  }
};

struct TagWriteRequest {
  uint8_t id = 0;
  uint8_t seq = 0;
  int32_t x = 0;
  int32_t y = 0;
  uint16_t tag = 0;
  uint8_t slot = 0;       ///< or kNoSlot
  uint8_t flags = 0;      ///< kTagReplace, kTagExpect
  uint16_t expected = 0;  ///< generation of the slot if one is named, else of the tag
  uint16_t lease_s = 0;   ///< 0: no lease
  uint32_t time = 0;      ///< Unix seconds by the writer's clock; 0: the server's
  int32_t words[kStatementWords] = {};

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return VisitStatement(it.words, visit.Id(it.id)
                                        .Opcode("WRITE", kTagWrite)
                                        .Field("seq", it.seq)
                                        .Field("x", it.x)
                                        .Field("y", it.y)
                                        .Field("tag", it.tag)
                                        .Field("slot", it.slot)
                                        .Field("flags", it.flags)
                                        .Field("expected", it.expected)
                                        .Field("lease_s", it.lease_s)
                                        .Field("time", it.time));
  }
};

struct TagEraseRequest {
  uint8_t id = 0;
  uint8_t seq = 0;
  int32_t x = 0;
  int32_t y = 0;
  uint16_t tag = 0;
  uint8_t slot = 0;
  uint8_t flags = 0;      ///< kTagExpect
  uint16_t expected = 0;  ///< generation of the slot

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("ERASE", kTagErase)
        .Field("seq", it.seq)
        .Field("x", it.x)
        .Field("y", it.y)
        .Field("tag", it.tag)
        .Field("slot", it.slot)
        .Field("flags", it.flags)
        .Field("expected", it.expected);
  }
};

/// The answers to WRITE and to ERASE; `erased` tells them apart.
struct TagWritten {
  uint8_t id = 0;
  bool erased = false;
  uint8_t seq = 0;
  uint16_t tag = 0;
  uint8_t slot = 0;
  uint16_t slot_generation = 0;
  uint16_t tag_generation = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("erased", it.erased, "WRITE_ANSWER", kTagWriteAnswer, "ERASE_ANSWER",
                kTagEraseAnswer)
        .Field("seq", it.seq)
        .Field("tag", it.tag)
        .Field("slot", it.slot)
        .Field("slot_generation", it.slot_generation)
        .Field("tag_generation", it.tag_generation);
  }
};

/// Defines a symbol: `kind` kRobot, kString or kMapping.
struct SymbolRequest {
  uint8_t id = 0;
  uint8_t seq = 0;
  SymbolKind kind = SymbolKind::kRobot;
  int32_t number = 0;
  uint8_t length = 0;                 ///< bytes of text in use
  uint8_t text[kMaxSymbolText] = {};  ///< UTF-8

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("SYMBOL", kSymbol)
        .Field("seq", it.seq)
        .Field("kind", it.kind)
        .Field("number", it.number)
        .Rest("text", it.text, it.length);
  }
};

struct SymbolAnswer {
  uint8_t id = 0;
  uint8_t seq = 0;
  SymbolKind kind = SymbolKind::kRobot;
  int32_t number = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("SYMBOL_ANSWER", kSymbolAnswer)
        .Field("seq", it.seq)
        .Field("kind", it.kind)
        .Field("number", it.number);
  }
};

struct ResolveRequest {
  uint8_t id = 0;
  SymbolKind kind = SymbolKind::kRobot;
  int32_t robot = 0;
  int32_t number = 0;
  uint8_t offset = 0;  ///< of the first byte of text wanted

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("RESOLVE", kResolve)
        .Field("kind", it.kind)
        .Field("robot", it.robot)
        .Field("number", it.number)
        .Field("offset", it.offset);
  }
};

struct ResolveAnswer {
  uint8_t id = 0;
  SymbolKind kind = SymbolKind::kRobot;  ///< never kRow
  int32_t robot = 0;
  int32_t number = 0;
  uint32_t rows = 0;   ///< of all tables; their generation
  uint8_t length = 0;  ///< of the whole text
  uint8_t count = 0;   ///< bytes of text in use
  uint8_t text[kMaxResolvedText] = {};

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("RESOLVE_ANSWER", kResolveAnswer)
        .Field("kind", it.kind)
        .Field("robot", it.robot)
        .Field("number", it.number)
        .Field("rows", it.rows)
        .Field("text_length", it.length)
        .Rest("text", it.text, it.count);
  }
};

}  // namespace protocol
}  // namespace pheromone
