// What is written on a virtual RFID tag: blocks of 32 bytes, each a subject-predicate-object triple
// with the writer and the time of writing (Tammet, Vain and Kuusik 2006, section 3.2).
//
//   Block block = BlockFromWords(words);     // eight words, as on the wire
//   if (const Status good = CheckBlock(block); !good.ok()) ...
//
// A term is a namespace and a number. A namespace from 0 on is the number of a string, and so is
// the number: together they are an IRI (symbols.h). A negative namespace is a type code, and the
// number is the value itself.
//
// Pure; any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/base/result.h"

namespace pheromone::tags {

/// The namespace of a term that is not a symbol. The paper lists seven types but numbers them -1 to
/// -6: the list's order counts here. Numbers below kTime are additions to the paper.
enum class TypeCode : int32_t {
  kString = -1,    ///< the number of a string
  kChar = -2,      ///< a Unicode scalar value
  kInt = -3,       ///< a number of 32 bits
  kFloat = -4,     ///< the bits of a binary32
  kDateTime = -5,  ///< unsigned Unix seconds, UTC
  kDate = -6,      ///< days since 1970-01-01
  kTime = -7,      ///< milliseconds since midnight
  kRobot = -17,    ///< the number of a robot
  kTag = -18,      ///< the number of a tag
};

/// In place of a subject's namespace: the other words are no terms, but a record of a Petri net
/// (protocol/net_record.h), and carried as they are.
constexpr int32_t kNetRecordType = -32;

struct Term {
  int32_t space = 0;
  int32_t value = 0;
  bool operator==(const Term&) const = default;

  bool is(TypeCode code) const { return space == static_cast<int32_t>(code); }
  bool is_symbol() const { return space >= 0; }

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("space", it.space);
    visit("value", it.value);
  }
};

/// An empty slot has author 0 and is otherwise zero, too.
struct Block {
  int32_t author = 0;   ///< the number of the robot or person who wrote it, from 1
  uint32_t time_s = 0;  ///< Unix seconds UTC by the writer's clock, until 2106
  Term subject;
  Term predicate;
  Term object;
  bool operator==(const Block&) const = default;

  bool is_empty() const { return author == 0; }
  bool is_net_record() const { return subject.space == kNetRecordType; }

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("author", it.author);
    visit("time_s", it.time_s);
    visit("subject", it.subject);
    visit("predicate", it.predicate);
    visit("object", it.object);
  }
};

/// As in the paper's list: author, time, then namespace and number of subject, predicate, object.
constexpr size_t kBlockWords = 8;
using Words = std::array<int32_t, kBlockWords>;
Words ToWords(const Block& block);
Block BlockFromWords(const Words& words);

/// Whether it can be written. Errors: an author below 1; a subject that is neither a symbol, a
/// robot nor a tag; a predicate that is no symbol (RDF has no literals there); a value that its
/// type does not have, such as a surrogate for a character. An object of an unknown type is
/// carried, and so is all of a net's record.
Status CheckBlock(const Block& block);

/// The same for the object alone.
Status CheckObject(const Term& object);

/// Whether CheckBlock knows its type, so that it can be told in words and exported.
bool IsKnownType(const Term& term);

}  // namespace pheromone::tags
