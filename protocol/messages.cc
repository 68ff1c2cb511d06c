#include "protocol/messages.h"

#include "protocol/byte_order.h"
#include "protocol/fields.h"

namespace pheromone {
namespace protocol {
namespace {

// Makes places in DATA constants for avr-g++ -Os too: a third less flash than calls.
#define PHEROMONE_INLINE __attribute__((always_inline)) inline

// Reads ID, OPCODE and DATA, whose length is right, into a message. `rest` are the bytes of a list
// at the end. Unused items of arrays become zero.
class Reader {
 public:
  Reader(const Message& from, uint8_t rest) : from_(from), at_(from.data), rest_(rest) {}

  Reader& Id(uint8_t& id) {
    id = from_.id;
    return *this;
  }
  Reader& ToAll() { return *this; }
  Reader& Opcode(const char* /*name*/, uint8_t /*opcode*/) { return *this; }
  Reader& Opcode(const char* /*flag_name*/, bool& flag, const char* /*name*/, uint8_t /*opcode*/,
                 const char* /*name_if_set*/, uint8_t if_set) {
    flag = from_.opcode == if_set;
    return *this;
  }
  Reader& Typed(uint8_t& type, const char* /*name*/, unsigned /*service*/) {
    type = TypeOf(from_.opcode);
    return *this;
  }
  Reader& Typed(uint8_t& type, bool& is_wide, const char* /*name*/, unsigned /*service*/,
                const char* /*wide_name*/, unsigned wide) {
    type = TypeOf(from_.opcode);
    is_wide = (from_.opcode & 0xF0u) == wide;
    return *this;
  }

  PHEROMONE_INLINE Reader& Field(const char* /*name*/, uint8_t& to) {
    to = *at_++;
    return *this;
  }
  PHEROMONE_INLINE Reader& Field(const char* /*name*/, uint16_t& to) {
    to = GetU16(Pass(2));
    return *this;
  }
  PHEROMONE_INLINE Reader& Field(const char* /*name*/, int16_t& to) {
    to = GetI16(Pass(2));
    return *this;
  }
  PHEROMONE_INLINE Reader& Field(const char* /*name*/, uint32_t& to) {
    to = GetU32(Pass(4));
    return *this;
  }
  PHEROMONE_INLINE Reader& Field(const char* /*name*/, int32_t& to) {
    to = GetI32(Pass(4));
    return *this;
  }
  template <typename Code>
  Reader& Field(const char* /*name*/, Code& to) {
    to = static_cast<Code>(*at_++);
    return *this;
  }
  Reader& Coordinate(const char* /*name*/, int32_t& to, const bool& wide) {
    to = wide ? GetI32(Pass(4)) : GetI16(Pass(2));
    return *this;
  }
  Reader& Nibbles(const char* /*high_name*/, uint8_t& high, const char* /*low_name*/,
                  uint8_t& low) {
    high = static_cast<uint8_t>(*at_ >> 4);
    low = *at_++ & 0x0Fu;
    return *this;
  }
  template <uint8_t size>
  Reader& Arguments(const char* name, uint8_t (&bytes)[size], const CommandCode& code) {
    return Some(name, bytes, ArgumentsInUse(code));
  }
  template <typename Item, uint8_t size>
  Reader& Some(const char* /*name*/, Item (&items)[size], const uint8_t& count) {
    uint8_t i = 0;
    for (; i < count; ++i) {
      ReadItem(items[i]);
    }
    for (; i < size; ++i) {
      items[i] = Item();
    }
    return *this;
  }
  template <typename Item, unsigned size>
  Reader& Rest(const char* name, Item (&items)[size], uint8_t& count) {
    count = static_cast<uint8_t>(rest_ / Sizer::BytesOf(items[0]));
    return Some(name, items, count);
  }

 private:
  void ReadItem(uint8_t& item) { item = *at_++; }
  template <typename Row>
  void ReadItem(Row& row) {
    Row::Fields(row, *this);
  }

  PHEROMONE_INLINE const uint8_t* Pass(uint8_t count) {
    const uint8_t* const before = at_;
    at_ += count;
    return before;
  }

  const Message& from_;
  const uint8_t* at_;
  uint8_t rest_;
};

// Writes them.
class Writer {
 public:
  explicit Writer(Message* to) : to_(to), at_(to->data) {}

  // The length of what has been written.
  uint8_t length() const { return static_cast<uint8_t>(at_ - to_->data); }

  // Whether all coordinates fit.
  bool fits() const { return fits_; }

  Writer& Id(const uint8_t& id) {
    to_->id = id;
    return *this;
  }
  Writer& ToAll() {
    to_->id = kBroadcastId;
    return *this;
  }
  Writer& Opcode(const char* /*name*/, uint8_t opcode) {
    to_->opcode = opcode;
    return *this;
  }
  Writer& Opcode(const char* /*flag_name*/, const bool& flag, const char* /*name*/, uint8_t opcode,
                 const char* /*name_if_set*/, uint8_t if_set) {
    to_->opcode = flag ? if_set : opcode;
    return *this;
  }
  Writer& Typed(const uint8_t& type, const char* /*name*/, unsigned service) {
    to_->opcode = static_cast<uint8_t>(service | (type & 0x0Fu));
    return *this;
  }
  Writer& Typed(const uint8_t& type, const bool& is_wide, const char* name, unsigned narrow,
                const char* /*wide_name*/, unsigned wide) {
    return Typed(type, name, is_wide ? wide : narrow);
  }

  PHEROMONE_INLINE Writer& Field(const char* /*name*/, const uint8_t& from) {
    *Add(1) = from;
    return *this;
  }
  PHEROMONE_INLINE Writer& Field(const char* /*name*/, const uint16_t& from) {
    PutU16(Add(2), from);
    return *this;
  }
  PHEROMONE_INLINE Writer& Field(const char* /*name*/, const int16_t& from) {
    PutI16(Add(2), from);
    return *this;
  }
  PHEROMONE_INLINE Writer& Field(const char* /*name*/, const uint32_t& from) {
    PutU32(Add(4), from);
    return *this;
  }
  PHEROMONE_INLINE Writer& Field(const char* /*name*/, const int32_t& from) {
    PutI32(Add(4), from);
    return *this;
  }
  template <typename Code>
  Writer& Field(const char* /*name*/, const Code& from) {
    *Add(1) = static_cast<uint8_t>(from);
    return *this;
  }
  Writer& Coordinate(const char* /*name*/, const int32_t& from, const bool& wide) {
    if (wide) {
      PutI32(Add(4), from);
    } else {
      fits_ = fits_ && FitsNarrow(from, 0);
      PutU16(Add(2), static_cast<uint16_t>(static_cast<uint32_t>(from) & 0xFFFFu));
    }
    return *this;
  }
  Writer& Nibbles(const char* /*high_name*/, const uint8_t& high, const char* /*low_name*/,
                  const uint8_t& low) {
    *Add(1) = static_cast<uint8_t>(high << 4 | low);
    return *this;
  }
  template <unsigned size>
  Writer& Arguments(const char* name, const uint8_t (&bytes)[size], const CommandCode& code) {
    return Some(name, bytes, ArgumentsInUse(code));
  }
  template <typename Item, unsigned size>
  Writer& Some(const char* /*name*/, const Item (&items)[size], const uint8_t& count) {
    for (uint8_t i = 0; i < count && i < size; ++i) {
      WriteItem(items[i]);
    }
    return *this;
  }
  template <typename Item, unsigned size>
  Writer& Rest(const char* name, const Item (&items)[size], const uint8_t& count) {
    return Some(name, items, count);
  }

 private:
  void WriteItem(const uint8_t& item) { *Add(1) = item; }
  template <typename Row>
  void WriteItem(const Row& row) {
    Row::Fields(row, *this);
  }

  PHEROMONE_INLINE uint8_t* Add(uint8_t count) {
    uint8_t* const before = at_;
    at_ += count;
    return before;
  }

  Message* to_;
  uint8_t* at_;
  bool fits_ = true;
};

// Finds the message that has an opcode.
struct LengthFinder {
  template <typename M>
  void Visit(const M& message) {
    const OpcodeMatcher matcher = M::Fields(message, OpcodeMatcher(opcode));
    if (matcher.matches) {
      constexpr Sizer kNarrow = SizeOf<M>(false);
      constexpr Sizer kWide = SizeOf<M>(true);
      rule.known = true;
      rule.least = matcher.flag ? kWide.least : kNarrow.least;
      rule.most = matcher.flag ? kWide.most : kNarrow.most;
    }
  }

  uint8_t opcode;
  LengthRule rule;
};

// What a message asks for beside its opcode and the bounds of its length.
template <typename M>
bool IsWellFormed(const Message& /*from*/, const M* /*kind*/) {
  return true;
}

bool IsWellFormed(const Message& from, const Command* /*kind*/) {
  constexpr uint8_t kCode = OffsetOf(&Command::code);
  constexpr uint8_t kBeforeArguments = SizeOf<Command>().least;
  return from.length == kBeforeArguments + CommandArgumentLength(from.data[kCode]);
}

bool IsWellFormed(const Message& from, const Round* /*kind*/) {
  constexpr uint8_t kCounts = OffsetOf(&Round::answer_count);
  constexpr uint8_t kBeforeAnswers = SizeOf<Round>().least;
  constexpr uint8_t kAnswer = SizeOf<RoundAnswer>().least;
  const uint8_t counts = from.data[kCounts];
  const uint8_t answers = counts & 0x0Fu;
  const uint8_t turns = static_cast<uint8_t>(counts >> 4);
  if (from.id != kBroadcastId || answers > kMaxTurns || turns > kMaxTurns ||
      from.length != kBeforeAnswers + kAnswer * answers + turns) {
    return false;
  }
  for (uint8_t i = 1; i <= turns; ++i) {
    const uint8_t id = from.data[from.length - i];
    if (id == 0 || id == kBroadcastId) {
      return false;
    }
  }
  return true;
}

constexpr uint8_t kBeforeResolvedText = SizeOf<ResolveAnswer>().least;

// No more text than there is.
bool IsWellFormed(const Message& from, const ResolveAnswer* /*kind*/) {
  constexpr uint8_t kLength = OffsetOf(&ResolveAnswer::length);
  return from.length <= kBeforeResolvedText + from.data[kLength];
}

template <typename M>
void Finish(const M& /*from*/, Message* /*to*/) {}

void Finish(const ResolveAnswer& from, Message* to) {
  const unsigned most = kBeforeResolvedText + unsigned{from.length};
  if (to->length > most) {
    to->length = static_cast<uint8_t>(most);
  }
}

}  // namespace

uint8_t CommandArgumentLength(uint8_t code) {
  return ArgumentLengthOf(code);
}

LengthRule LengthOf(uint8_t opcode) {
  LengthFinder finder{opcode, {false, 0, 0}};
  ForEachMessage(&finder);
  return finder.rule;
}

template <typename M>
bool Decode(const Message& from, M* to) {
  const OpcodeMatcher matcher = M::Fields(*to, OpcodeMatcher(from.opcode));
  constexpr Sizer kNarrow = SizeOf<M>(false);
  constexpr Sizer kWide = SizeOf<M>(true);
  const uint8_t least = matcher.flag ? kWide.least : kNarrow.least;
  const uint8_t most = matcher.flag ? kWide.most : kNarrow.most;
  if (!matcher.matches || from.length < least || from.length > most) {
    return false;
  }
  const uint8_t rest = static_cast<uint8_t>(from.length - least);
  if (rest % kNarrow.step != 0 || !IsWellFormed(from, to)) {
    return false;
  }
  Reader reader(from, rest);
  M::Fields(*to, reader);
  return true;
}

template <typename M>
bool Encode(const M& from, Message* to) {
  Writer writer(to);
  M::Fields(from, writer);
  to->length = writer.length();
  Finish(from, to);
  return writer.fits();
}

// NOLINTBEGIN(bugprone-macro-parentheses): M* is a type
#define PHEROMONE_CODEC(M)                  \
  template bool Decode(const Message&, M*); \
  template bool Encode(const M&, Message*);
PHEROMONE_MESSAGES(PHEROMONE_CODEC)
#undef PHEROMONE_CODEC
// NOLINTEND(bugprone-macro-parentheses)

}  // namespace protocol
}  // namespace pheromone
