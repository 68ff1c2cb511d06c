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
// A list calls its visitor for each field in the order of the wire:
//
//   Id(id), ToAll()                        the frame's CLIENT_ID
//   Opcode(name, opcode)                   a message of one opcode
//   Opcode(flag_name, flag, name, opcode, name_if_set, opcode_if_set)
//   Typed(type, name, service)             one opcode a pheromone type
//   Typed(type, wide, name, service, wide_name, wide_service)
//   (name, field)                          an integer, or an enumeration over uint8_t
//   Coordinate(name, field, wide)          32 bits if wide, else 16
//   Nibbles(high_name, high, low_name, low)    two counts in one byte
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
class IgnoresHeader {
 public:
  constexpr void Id(const uint8_t& /*id*/) {}
  constexpr void ToAll() {}
  template <typename... Any>
  constexpr void Opcode(const Any&... /*any*/) {}
  template <typename... Any>
  constexpr void Typed(const Any&... /*any*/) {}
};

/// Computes how many bytes DATA may have.
class Sizer : public IgnoresHeader {
 public:
  constexpr explicit Sizer(bool is_wide) : wide(is_wide) {}

  template <typename T>
  constexpr void operator()(const char* /*name*/, const T& /*field*/) {
    Add(sizeof(T));
  }
  constexpr void Coordinate(const char* /*name*/, const int32_t& /*field*/, bool /*wide*/) {
    Add(wide ? 4 : 2);
  }
  constexpr void Nibbles(const char* /*high_name*/, const uint8_t& /*high*/,
                         const char* /*low_name*/, const uint8_t& /*low*/) {
    Add(1);
  }
  template <typename T, unsigned size>
  constexpr void Some(const char* /*name*/, const T (&items)[size], uint8_t /*count*/) {
    most = static_cast<uint8_t>(most + size * BytesOf(items[0]));
  }
  template <typename T, unsigned size>
  constexpr void Rest(const char* name, const T (&items)[size], const uint8_t& count) {
    Some(name, items, count);
    step = BytesOf(items[0]);
  }

  /// Of an item of an array.
  static constexpr uint8_t BytesOf(const uint8_t& /*item*/) { return 1; }
  template <typename Row>
  static constexpr uint8_t BytesOf(const Row& row) {
    Sizer sizer(false);
    Row::Fields(row, sizer);
    return sizer.least;
  }

  bool wide;
  uint8_t least = 0;
  uint8_t most = 0;
  uint8_t step = 1;  ///< from one length to the next

 private:
  constexpr void Add(unsigned bytes) {
    least = static_cast<uint8_t>(least + bytes);
    most = static_cast<uint8_t>(most + bytes);
  }
};

/// `wide` matters only for messages that have both widths.
template <typename M>
constexpr Sizer SizeOf(bool wide = false) {
  const M it{};
  Sizer sizer(wide);
  M::Fields(it, sizer);
  return sizer;
}

/// Finds where in DATA a field begins, up to the first array whose length varies.
template <typename Field>
class OffsetFinder : public IgnoresHeader {
 public:
  constexpr explicit OffsetFinder(const Field* wanted) : wanted_(wanted) {}

  template <typename T>
  constexpr void operator()(const char* /*name*/, const T& field) {
    Pass(Is(&field), sizeof(T));
  }
  constexpr void Coordinate(const char* /*name*/, const int32_t& field, bool wide) {
    Pass(Is(&field), wide ? 4 : 2);
  }
  constexpr void Nibbles(const char* /*high_name*/, const uint8_t& high, const char* /*low_name*/,
                         const uint8_t& low) {
    Pass(Is(&high) || Is(&low), 1);
  }
  template <typename T, unsigned size>
  constexpr void Some(const char* /*name*/, const T (&items)[size], uint8_t /*count*/) {
    Pass(Is(&items[0]), 0);
  }
  template <typename T, unsigned size>
  constexpr void Rest(const char* /*name*/, const T (&items)[size], const uint8_t& /*count*/) {
    Pass(Is(&items[0]), 0);
  }

  /// 255 if it is not found.
  constexpr uint8_t offset() const { return found_ ? offset_ : uint8_t{255}; }

 private:
  constexpr bool Is(const Field* field) const { return field == wanted_; }
  template <typename T>
  constexpr bool Is(const T* /*field*/) const {
    return false;
  }
  constexpr void Pass(bool is_wanted, unsigned bytes) {
    found_ = found_ || is_wanted;
    offset_ = static_cast<uint8_t>(offset_ + (found_ ? 0 : bytes));
  }

  const Field* wanted_;
  uint8_t offset_ = 0;
  bool found_ = false;
};

template <typename M, typename Field>
constexpr uint8_t OffsetOf(Field M::*field) {
  const M it{};
  OffsetFinder<Field> finder(&(it.*field));
  M::Fields(it, finder);
  return finder.offset();
}

/// Of an item of an array.
template <typename M, typename Item, unsigned size>
constexpr uint8_t OffsetOf(Item (M::*array)[size], unsigned index) {
  const M it{};
  OffsetFinder<Item> finder(&(it.*array)[index]);
  M::Fields(it, finder);
  return finder.offset();
}

// --- OPCODE

/// For visitors that need nothing of DATA.
class IgnoresData {
 public:
  template <typename T>
  constexpr void operator()(const char* /*name*/, const T& /*field*/) {}
  template <typename... Any>
  constexpr void Coordinate(const Any&... /*any*/) {}
  template <typename... Any>
  constexpr void Nibbles(const Any&... /*any*/) {}
  template <typename... Any>
  constexpr void Some(const Any&... /*any*/) {}
  template <typename... Any>
  constexpr void Rest(const Any&... /*any*/) {}
};

/// Compares an opcode with those of a message.
class OpcodeMatcher : public IgnoresHeader, public IgnoresData {
 public:
  constexpr explicit OpcodeMatcher(uint8_t an_opcode) : opcode(an_opcode) {}

  constexpr void Opcode(const char* /*name*/, uint8_t only) { matches = opcode == only; }
  constexpr void Opcode(const char* /*flag_name*/, const bool& /*flag*/, const char* /*name*/,
                        uint8_t if_clear, const char* /*name_if_set*/, uint8_t if_set) {
    flag = opcode == if_set;
    matches = flag || opcode == if_clear;
  }
  constexpr void Typed(const uint8_t& /*type*/, const char* /*name*/, unsigned service) {
    matches = HasService(service);
  }
  constexpr void Typed(const uint8_t& /*type*/, const bool& /*wide*/, const char* /*name*/,
                       unsigned narrow, const char* /*wide_name*/, unsigned wide) {
    flag = HasService(wide);
    matches = flag || HasService(narrow);
  }

  uint8_t opcode;
  bool matches = false;
  bool flag = false;  ///< what the opcode says of `wide`, `answer` or `erased`

 private:
  constexpr bool HasService(unsigned service) const {
    return (opcode & 0xF0u) == service && (opcode & 0x0Fu) >= kMinType;
  }
};

/// Notes a message's name.
class Namer : public IgnoresHeader, public IgnoresData {
 public:
  void Opcode(const char* its_name, uint8_t /*opcode*/) { name = its_name; }
  void Opcode(const char* /*flag_name*/, const bool& flag, const char* if_clear, uint8_t /*opcode*/,
              const char* if_set, uint8_t /*opcode_if_set*/) {
    name = flag ? if_set : if_clear;
  }
  void Typed(const uint8_t& /*type*/, const char* its_name, unsigned /*service*/) {
    name = its_name;
  }
  void Typed(const uint8_t& /*type*/, const bool& wide, const char* narrow_name,
             unsigned /*service*/, const char* wide_name, unsigned /*wide_service*/) {
    name = wide ? wide_name : narrow_name;
  }

  const char* name = "";
};

template <typename M>
const char* NameOf(const M& message) {
  Namer namer;
  M::Fields(message, namer);
  return namer.name;
}

// --- One field after the other

/// Hands every field to a sink, those of ID and OPCODE too.
template <typename Sink>
class FieldLister {
 public:
  explicit FieldLister(Sink* sink) : sink_(sink) {}

  template <typename Number>
  void Id(Number& id) {
    sink_->Add("id", id);
  }
  void ToAll() {}
  void Opcode(const char* /*name*/, uint8_t /*opcode*/) {}
  template <typename Flag>
  void Opcode(const char* flag_name, Flag& flag, const char* /*name*/, uint8_t /*opcode*/,
              const char* /*name_if_set*/, uint8_t /*opcode_if_set*/) {
    sink_->Add(flag_name, flag);
  }
  template <typename Number>
  void Typed(Number& type, const char* /*name*/, unsigned /*service*/) {
    sink_->Add("type", type);
  }
  template <typename Number, typename Flag>
  void Typed(Number& type, Flag& wide, const char* /*name*/, unsigned /*service*/,
             const char* /*wide_name*/, unsigned /*wide_service*/) {
    sink_->Add("type", type);
    sink_->Add("wide", wide);
  }
  template <typename Field>
  void operator()(const char* name, Field& field) {
    sink_->Add(name, field);
  }
  template <typename Field>
  void Coordinate(const char* name, Field& field, bool /*wide*/) {
    sink_->Add(name, field);
  }
  template <typename Number>
  void Nibbles(const char* high_name, Number& high, const char* low_name, Number& low) {
    sink_->Add(high_name, high);
    sink_->Add(low_name, low);
  }
  template <typename Item, unsigned size>
  void Some(const char* name, Item (&items)[size], uint8_t count) {
    for (uint8_t i = 0; i < count && i < size; ++i) {
      ListItem(name, items[i]);
    }
  }
  template <typename Item, unsigned size, typename Number>
  void Rest(const char* name, Item (&items)[size], Number& count) {
    sink_->Add("count", count);
    Some(name, items, count);
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
    values_[size_++ % kMost] = static_cast<int32_t>(field);
  }
  bool operator==(const FieldValues& other) const {
    for (uint8_t i = 0; i < size_ && i < kMost; ++i) {
      if (values_[i] != other.values_[i]) {
        return false;
      }
    }
    return size_ == other.size_;
  }

 private:
  static constexpr uint8_t kMost = 64;  // the longest SYMBOL has 61
  int32_t values_[kMost] = {};
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
