// What follows from the one list of each message's fields: `Fields` of the structs in messages.h
// and tag_messages.h.
//
//   SizeOf<HelloAnswer>().least                    // bytes of DATA
//   constexpr uint8_t kAt = OffsetOf(&HelloAnswer::epoch);      // in DATA
//   if (one == another) ...                        // fields in use only
//   ForEachField(message, &sink);                  // sink.Add("nonce", message.nonce) ...
//   NameOf(message)                                // "SENSE_WIDE_ANSWER", as in the vectors
//   ForEachMessage(&visitor);                      // visitor.Visit(SenseRequest()) ...
//
// A list calls its visitor for each field in the order of the wire, each call of what the one
// before returned, and returns what the last one did. So a visitor that is a constant can count in
// C++11, which is what Arduino compiles for AVRs. Before C++17, a call's arguments may be evaluated
// before the calls in front of it: visitors take references.
//
//   Id(id), ToAll()                        the frame's CLIENT_ID
//   Opcode(name, opcode)                   a message of one opcode
//   Opcode(flag_name, flag, name, opcode, name_if_set, opcode_if_set)
//   Typed(type, name, service)             one opcode a pheromone type
//   Typed(type, wide, name, service, wide_name, wide_service)
//   Field(name, field)                     an integer, or an enumeration over uint8_t
//   Coordinate(name, field, wide)          32 bits if wide, else 16
//   Nibbles(high_name, high, low_name, low)    two counts in one byte
//   Arguments(name, array, code)           those of a COMMAND
//   Some(name, array, count)               items of an array
//   Rest(name, array, count)               the same to the end of DATA, which tells the count
//
// The items of an array are bytes, or structs with Fields. Freestanding; plain values; any thread.
#pragma once

#include <stdint.h>

#include "protocol/messages.h"
#include "protocol/tag_messages.h"

/// X(M) for each message.
#define PHEROMONE_MESSAGES(X) \
  X(SenseRequest)             \
  X(SenseAnswer)              \
  X(DepositRequest)           \
  X(DepositAnswer)            \
  X(TraceRequest)             \
  X(TraceAnswer)              \
  X(Command)                  \
  X(CommandAck)               \
  X(EventReport)              \
  X(EventAck)                 \
  X(HelloRequest)             \
  X(HelloAnswer)              \
  X(Ping)                     \
  X(Round)                    \
  X(ErrorAnswer)              \
  X(ScanRequest)              \
  X(ScanAnswer)               \
  X(TagReadRequest)           \
  X(TagReadAnswer)            \
  X(TagWriteRequest)          \
  X(TagEraseRequest)          \
  X(TagWritten)               \
  X(SymbolRequest)            \
  X(SymbolAnswer)             \
  X(ResolveRequest)           \
  X(ResolveAnswer)

namespace pheromone {
namespace protocol {

/// Calls `visitor->Visit(M())` for each message.
template <typename Visitor>
void ForEachMessage(Visitor* visitor) {
#define PHEROMONE_VISIT(M) visitor->Visit(M());
  PHEROMONE_MESSAGES(PHEROMONE_VISIT)
#undef PHEROMONE_VISIT
}

// --- Bytes of DATA

/// For visitors that need nothing of ID and OPCODE.
template <typename Visitor>
class IgnoresHeader {
 public:
  constexpr const Visitor& Id(const uint8_t& /*id*/) const { return Same(); }
  constexpr const Visitor& ToAll() const { return Same(); }
  template <typename... Any>
  constexpr const Visitor& Opcode(const Any&... /*any*/) const {
    return Same();
  }
  template <typename... Any>
  constexpr const Visitor& Typed(const Any&... /*any*/) const {
    return Same();
  }

 private:
  constexpr const Visitor& Same() const { return static_cast<const Visitor&>(*this); }
};

/// Computes how many bytes DATA may have.
class Sizer : public IgnoresHeader<Sizer> {
 public:
  constexpr explicit Sizer(bool is_wide) : Sizer(is_wide, 0, 0, 1) {}

  template <typename T>
  constexpr Sizer Field(const char* /*name*/, const T& /*field*/) const {
    return Plus(sizeof(T));
  }
  constexpr Sizer Coordinate(const char* /*name*/, const int32_t& /*field*/,
                             const bool& /*wide*/) const {
    return Plus(wide ? 4 : 2);
  }
  constexpr Sizer Nibbles(const char* /*high_name*/, const uint8_t& /*high*/,
                          const char* /*low_name*/, const uint8_t& /*low*/) const {
    return Plus(1);
  }
  template <typename Code, unsigned size>
  constexpr Sizer Arguments(const char* /*name*/, const uint8_t (&)[size],
                            const Code& /*code*/) const {
    return Sizer(wide, least, most + size, step);
  }
  template <typename T, unsigned size>
  constexpr Sizer Some(const char* /*name*/, const T (&items)[size],
                       const uint8_t& /*count*/) const {
    return Sizer(wide, least, most + size * BytesOf(items[0]), step);
  }
  template <typename T, unsigned size>
  constexpr Sizer Rest(const char* /*name*/, const T (&items)[size],
                       const uint8_t& /*count*/) const {
    return Sizer(wide, least, most + size * BytesOf(items[0]), BytesOf(items[0]));
  }

  /// Of an item of an array.
  static constexpr uint8_t BytesOf(const uint8_t& /*item*/) { return 1; }
  template <typename Row>
  static constexpr uint8_t BytesOf(const Row& row) {
    return Row::Fields(row, Sizer(false)).least;
  }

  bool wide;
  uint8_t least;
  uint8_t most;
  uint8_t step;  ///< from one length to the next

 private:
  constexpr Sizer(bool is_wide, unsigned at_least, unsigned at_most, unsigned by)
      : wide(is_wide),
        least(static_cast<uint8_t>(at_least)),
        most(static_cast<uint8_t>(at_most)),
        step(static_cast<uint8_t>(by)) {}
  constexpr Sizer Plus(unsigned bytes) const {
    return Sizer(wide, least + bytes, most + bytes, step);
  }
};

/// A message without values, whose fields have addresses.
template <typename M>
struct Blank {
  static constexpr M kIt{};
};
#if __cplusplus < 201703L
template <typename M>
constexpr M Blank<M>::kIt;
#endif

/// `wide` matters only for messages that have both widths.
template <typename M>
constexpr Sizer SizeOf(bool wide = false) {
  return M::Fields(Blank<M>::kIt, Sizer(wide));
}

/// Finds where in DATA a field begins, up to the first array whose length varies.
template <typename Wanted>
class OffsetFinder : public IgnoresHeader<OffsetFinder<Wanted>> {
 public:
  constexpr explicit OffsetFinder(const Wanted* wanted)
      : wanted_(wanted), offset_(0), found_(false) {}

  template <typename T>
  constexpr OffsetFinder Field(const char* /*name*/, const T& field) const {
    return Past(Is(&field), sizeof(T));
  }
  constexpr OffsetFinder Coordinate(const char* /*name*/, const int32_t& field,
                                    const bool& wide) const {
    return Past(Is(&field), wide ? 4 : 2);
  }
  constexpr OffsetFinder Nibbles(const char* /*high_name*/, const uint8_t& high,
                                 const char* /*low_name*/, const uint8_t& low) const {
    return Past(Is(&high) || Is(&low), 1);
  }
  template <typename Code, unsigned size>
  constexpr OffsetFinder Arguments(const char* /*name*/, const uint8_t (&bytes)[size],
                                   const Code& /*code*/) const {
    return Past(Is(&bytes[0]), 0);
  }
  template <typename T, unsigned size>
  constexpr OffsetFinder Some(const char* /*name*/, const T (&items)[size],
                              const uint8_t& /*count*/) const {
    return Past(Is(&items[0]), 0);
  }
  template <typename T, unsigned size>
  constexpr OffsetFinder Rest(const char* /*name*/, const T (&items)[size],
                              const uint8_t& /*count*/) const {
    return Past(Is(&items[0]), 0);
  }

  /// 255 if it is not found.
  constexpr uint8_t offset() const { return found_ ? offset_ : uint8_t{255}; }

 private:
  constexpr OffsetFinder(const Wanted* wanted, unsigned offset, bool found)
      : wanted_(wanted), offset_(static_cast<uint8_t>(offset)), found_(found) {}

  constexpr bool Is(const Wanted* field) const { return field == wanted_; }
  template <typename T>
  constexpr bool Is(const T* /*field*/) const {
    return false;
  }
  constexpr OffsetFinder Past(bool is_wanted, unsigned bytes) const {
    return OffsetFinder(wanted_, offset_ + (found_ || is_wanted ? 0 : bytes), found_ || is_wanted);
  }

  const Wanted* wanted_;
  uint8_t offset_;
  bool found_;
};

template <typename M, typename Wanted>
constexpr uint8_t OffsetOf(Wanted M::*field) {
  return M::Fields(Blank<M>::kIt, OffsetFinder<Wanted>(&(Blank<M>::kIt.*field))).offset();
}

/// Of an item of an array.
template <typename M, typename Item, unsigned size>
constexpr uint8_t OffsetOf(Item (M::*array)[size], unsigned index) {
  return M::Fields(Blank<M>::kIt, OffsetFinder<Item>(&(Blank<M>::kIt.*array)[index])).offset();
}

// --- OPCODE

/// For visitors that need nothing of DATA.
template <typename Visitor>
class IgnoresData {
 public:
  template <typename... Any>
  constexpr const Visitor& Field(const Any&... /*any*/) const {
    return Same();
  }
  template <typename... Any>
  constexpr const Visitor& Coordinate(const Any&... /*any*/) const {
    return Same();
  }
  template <typename... Any>
  constexpr const Visitor& Nibbles(const Any&... /*any*/) const {
    return Same();
  }
  template <typename... Any>
  constexpr const Visitor& Arguments(const Any&... /*any*/) const {
    return Same();
  }
  template <typename... Any>
  constexpr const Visitor& Some(const Any&... /*any*/) const {
    return Same();
  }
  template <typename... Any>
  constexpr const Visitor& Rest(const Any&... /*any*/) const {
    return Same();
  }

 private:
  constexpr const Visitor& Same() const { return static_cast<const Visitor&>(*this); }
};

/// Compares an opcode with those of a message.
class OpcodeMatcher : public IgnoresHeader<OpcodeMatcher>, public IgnoresData<OpcodeMatcher> {
 public:
  constexpr explicit OpcodeMatcher(uint8_t an_opcode) : OpcodeMatcher(an_opcode, false, false) {}

  constexpr OpcodeMatcher Opcode(const char* /*name*/, uint8_t only) const {
    return Result(false, opcode == only);
  }
  constexpr OpcodeMatcher Opcode(const char* /*flag_name*/, const bool& /*flag*/,
                                 const char* /*name*/, uint8_t if_clear,
                                 const char* /*name_if_set*/, uint8_t if_set) const {
    return Result(opcode == if_set, opcode == if_clear);
  }
  constexpr OpcodeMatcher Typed(const uint8_t& /*type*/, const char* /*name*/,
                                unsigned service) const {
    return Result(false, HasService(service));
  }
  constexpr OpcodeMatcher Typed(const uint8_t& /*type*/, const bool& /*wide*/, const char* /*name*/,
                                unsigned narrow, const char* /*wide_name*/, unsigned wide) const {
    return Result(HasService(wide), HasService(narrow));
  }

  uint8_t opcode;
  bool matches;
  bool flag;  ///< what the opcode says of `wide`, `answer` or `erased`

 private:
  constexpr OpcodeMatcher(uint8_t an_opcode, bool it_matches, bool is_set)
      : opcode(an_opcode), matches(it_matches), flag(is_set) {}
  constexpr OpcodeMatcher Result(bool is_if_set, bool is_if_clear) const {
    return OpcodeMatcher(opcode, is_if_set || is_if_clear, is_if_set);
  }
  constexpr bool HasService(unsigned service) const {
    return (opcode & 0xF0u) == service && (opcode & 0x0Fu) >= kMinType;
  }
};

/// Notes a message's name.
class Namer : public IgnoresHeader<Namer>, public IgnoresData<Namer> {
 public:
  explicit Namer(const char* its_name = "") : name(its_name) {}

  Namer Opcode(const char* its_name, uint8_t /*opcode*/) const { return Namer(its_name); }
  Namer Opcode(const char* /*flag_name*/, const bool& flag, const char* if_clear,
               uint8_t /*opcode*/, const char* if_set, uint8_t /*opcode_if_set*/) const {
    return Namer(flag ? if_set : if_clear);
  }
  Namer Typed(const uint8_t& /*type*/, const char* its_name, unsigned /*service*/) const {
    return Namer(its_name);
  }
  Namer Typed(const uint8_t& /*type*/, const bool& wide, const char* narrow_name,
              unsigned /*service*/, const char* wide_name, unsigned /*wide_service*/) const {
    return Namer(wide ? wide_name : narrow_name);
  }

  const char* name;
};

template <typename M>
const char* NameOf(const M& message) {
  return M::Fields(message, Namer()).name;
}

// --- One field after the other

/// Hands every field to a sink, those of ID and OPCODE too.
template <typename Sink>
class FieldLister {
 public:
  explicit FieldLister(Sink* sink) : sink_(sink) {}

  template <typename Number>
  FieldLister& Id(Number& id) {
    return Field("id", id);
  }
  FieldLister& ToAll() { return *this; }
  FieldLister& Opcode(const char* /*name*/, uint8_t /*opcode*/) { return *this; }
  template <typename Flag>
  FieldLister& Opcode(const char* flag_name, Flag& flag, const char* /*name*/, uint8_t /*opcode*/,
                      const char* /*name_if_set*/, uint8_t /*opcode_if_set*/) {
    return Field(flag_name, flag);
  }
  template <typename Number>
  FieldLister& Typed(Number& type, const char* /*name*/, unsigned /*service*/) {
    return Field("type", type);
  }
  template <typename Number, typename Flag>
  FieldLister& Typed(Number& type, Flag& wide, const char* /*name*/, unsigned /*service*/,
                     const char* /*wide_name*/, unsigned /*wide_service*/) {
    return Field("type", type).Field("wide", wide);
  }
  template <typename Value>
  FieldLister& Field(const char* name, Value& field) {
    sink_->Add(name, field);
    return *this;
  }
  template <typename Value>
  FieldLister& Coordinate(const char* name, Value& field, const bool& /*wide*/) {
    return Field(name, field);
  }
  template <typename Number>
  FieldLister& Nibbles(const char* high_name, Number& high, const char* low_name, Number& low) {
    return Field(high_name, high).Field(low_name, low);
  }
  template <typename Byte, unsigned size>
  FieldLister& Arguments(const char* name, Byte (&bytes)[size], const CommandCode& code) {
    return Some(name, bytes, ArgumentsInUse(code));
  }
  template <typename Item, unsigned size>
  FieldLister& Some(const char* name, Item (&items)[size], const uint8_t& count) {
    for (uint8_t i = 0; i < count && i < size; ++i) {
      ListItem(name, items[i]);
    }
    return *this;
  }
  template <typename Item, unsigned size, typename Number>
  FieldLister& Rest(const char* name, Item (&items)[size], Number& count) {
    return Field("count", count).Some(name, items, count);
  }

 private:
  void ListItem(const char* name, uint8_t& item) { sink_->Add(name, item); }
  void ListItem(const char* name, const uint8_t& item) { sink_->Add(name, item); }
  template <typename Row>
  void ListItem(const char* /*name*/, Row& row) {
    Row::Fields(row, *this);
  }

  Sink* sink_;
};

/// Calls `sink->Add(name, field)` for each field in use; `sink` may change the fields if `it` is
/// not const. The count of an array comes before its items, as "count" if DATA has no field for it.
template <typename M, typename Sink>
void ForEachField(M& it, Sink* sink) {
  FieldLister<Sink> lister(sink);
  M::Fields(it, lister);
}

/// The values of all fields in use.
class FieldValues {
 public:
  template <typename Field>
  void Add(const char* /*name*/, Field field) {
    values_[size_++ % kMax] = static_cast<int32_t>(field);
  }
  bool operator==(const FieldValues& other) const {
    for (uint8_t i = 0; i < size_ && i < kMax; ++i) {
      if (values_[i] != other.values_[i]) {
        return false;
      }
    }
    return size_ == other.size_;
  }

 private:
  static constexpr uint8_t kMax = 64;  // the longest SYMBOL has 61
  int32_t values_[kMax] = {};
  uint8_t size_ = 0;
};

/// Whether two messages have the same fields.
template <typename M>
auto operator==(const M& one, const M& another)
    -> decltype(M::Fields(one, *static_cast<FieldLister<FieldValues>*>(nullptr)), bool()) {
  FieldValues values;
  ForEachField(one, &values);
  FieldValues others;
  ForEachField(another, &others);
  return values == others;
}

}  // namespace protocol
}  // namespace pheromone
