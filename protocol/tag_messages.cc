#include "protocol/tag_messages.h"

#include "protocol/byte_order.h"

namespace pheromone {
namespace protocol {
namespace {

constexpr uint8_t kRowBytes = 8;  // of SCAN's answer
constexpr uint8_t kBeforeRows = 1;
constexpr uint8_t kBeforeSymbolText = 6;
constexpr uint8_t kBeforeResolvedText = 14;

// Whether the opcode is `opcode` and the length is within its bounds.
bool HasFormOf(const Message& message, uint8_t opcode) {
  const LengthRule rule = LengthOf(opcode);
  return message.opcode == opcode && message.length >= rule.least && message.length <= rule.most;
}

uint8_t AtMost(uint8_t most, uint8_t value) {
  return value < most ? value : most;
}

// Takes the fields of DATA from its front, one after the other.
class FieldReader {
 public:
  explicit FieldReader(const Message& from) : at_(from.data) {}

  FieldReader& operator()(uint8_t& to) {
    to = *at_++;
    return *this;
  }
  FieldReader& operator()(uint16_t& to) {
    to = GetU16(Skip(2));
    return *this;
  }
  FieldReader& operator()(int16_t& to) {
    to = GetI16(Skip(2));
    return *this;
  }
  FieldReader& operator()(uint32_t& to) {
    to = GetU32(Skip(4));
    return *this;
  }
  FieldReader& operator()(int32_t& to) {
    to = GetI32(Skip(4));
    return *this;
  }
  FieldReader& operator()(SymbolKind& to) {
    to = static_cast<SymbolKind>(*at_++);
    return *this;
  }

 private:
  const uint8_t* Skip(uint8_t count) {
    const uint8_t* const before = at_;
    at_ += count;
    return before;
  }

  const uint8_t* at_;
};

// Appends them. The message's length is that of what has been appended.
class FieldWriter {
 public:
  FieldWriter(Message* to, uint8_t id, uint8_t opcode) : to_(to) {
    to->id = id;
    to->opcode = opcode;
    to->length = 0;
  }

  FieldWriter& operator()(uint8_t from) {
    *Add(1) = from;
    return *this;
  }
  FieldWriter& operator()(uint16_t from) {
    PutU16(Add(2), from);
    return *this;
  }
  FieldWriter& operator()(int16_t from) {
    PutI16(Add(2), from);
    return *this;
  }
  FieldWriter& operator()(uint32_t from) {
    PutU32(Add(4), from);
    return *this;
  }
  FieldWriter& operator()(int32_t from) {
    PutI32(Add(4), from);
    return *this;
  }
  FieldWriter& operator()(SymbolKind from) { return (*this)(static_cast<uint8_t>(from)); }

 private:
  uint8_t* Add(uint8_t count) {
    uint8_t* const at = to_->data + to_->length;
    to_->length = static_cast<uint8_t>(to_->length + count);
    return at;
  }

  Message* to_;
};

// --- The fields of each message in their order: of a request or an answer, read and written alike.

template <typename Pass, typename Item>
void Each(Pass& pass, Item* items, uint8_t count) {
  for (uint8_t i = 0; i < count; ++i) {
    pass(items[i]);
  }
}

template <typename Pass>
void Fields(Pass& pass, ScanRequest& it) {
  pass(it.x)(it.y)(it.after);
}

template <typename Pass>
void Fields(Pass& pass, ScanAnswer& it) {
  pass(it.more);
  for (uint8_t i = 0; i < it.count; ++i) {
    TagInRange& row = it.rows[i];
    pass(row.tag)(row.dx)(row.dy)(row.generation);
  }
}

template <typename Pass>
void Fields(Pass& pass, TagReadRequest& it) {
  pass(it.x)(it.y)(it.tag)(it.slot);
}

template <typename Pass>
void Fields(Pass& pass, TagReadAnswer& it) {
  pass(it.tag)(it.slot)(it.next)(it.slots)(it.tag_generation)(it.slot_generation)(it.lease_s)(
      it.flags);
  Each(pass, it.words, kTagWords);
}

template <typename Pass>
void Fields(Pass& pass, TagWriteRequest& it) {
  pass(it.seq)(it.x)(it.y)(it.tag)(it.slot)(it.flags)(it.expected)(it.lease_s)(it.time);
  Each(pass, it.words, kStatementWords);
}

template <typename Pass>
void Fields(Pass& pass, TagEraseRequest& it) {
  pass(it.seq)(it.x)(it.y)(it.tag)(it.slot)(it.flags)(it.expected);
}

template <typename Pass>
void Fields(Pass& pass, TagWritten& it) {
  pass(it.seq)(it.tag)(it.slot)(it.slot_generation)(it.tag_generation);
}

template <typename Pass>
void Fields(Pass& pass, SymbolRequest& it) {
  pass(it.seq)(it.kind)(it.number);
  Each(pass, it.text, it.length);
}

template <typename Pass>
void Fields(Pass& pass, SymbolAnswer& it) {
  pass(it.seq)(it.kind)(it.number);
}

template <typename Pass>
void Fields(Pass& pass, ResolveRequest& it) {
  pass(it.kind)(it.robot)(it.number)(it.offset);
}

template <typename Pass>
void Fields(Pass& pass, ResolveAnswer& it) {
  pass(it.kind)(it.robot)(it.number)(it.rows)(it.length);
  Each(pass, it.text, it.count);
}

// Counts of rows or bytes in `to` are already those of the message.
template <typename T>
bool Read(const Message& from, uint8_t opcode, T* to) {
  if (!HasFormOf(from, opcode)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  Fields(reader, *to);
  return true;
}

template <typename T>
void Write(T from, uint8_t opcode, Message* to) {
  FieldWriter writer(to, from.id, opcode);
  Fields(writer, from);
}

}  // namespace

bool Decode(const Message& from, ScanRequest* to) {
  return Read(from, kScan, to);
}

bool Decode(const Message& from, ScanAnswer* to) {
  if (!HasFormOf(from, kScanAnswer) || (from.length - kBeforeRows) % kRowBytes != 0) {
    return false;
  }
  to->count = static_cast<uint8_t>((from.length - kBeforeRows) / kRowBytes);
  return Read(from, kScanAnswer, to);
}

bool Decode(const Message& from, TagReadRequest* to) {
  return Read(from, kTagRead, to);
}

bool Decode(const Message& from, TagReadAnswer* to) {
  return Read(from, kTagReadAnswer, to);
}

bool Decode(const Message& from, TagWriteRequest* to) {
  return Read(from, kTagWrite, to);
}

bool Decode(const Message& from, TagEraseRequest* to) {
  return Read(from, kTagErase, to);
}

bool Decode(const Message& from, TagWritten* to) {
  to->erased = from.opcode == kTagEraseAnswer;
  return Read(from, to->erased ? kTagEraseAnswer : kTagWriteAnswer, to);
}

bool Decode(const Message& from, SymbolRequest* to) {
  if (!HasFormOf(from, kSymbol)) {
    return false;
  }
  to->length = static_cast<uint8_t>(from.length - kBeforeSymbolText);
  return Read(from, kSymbol, to);
}

bool Decode(const Message& from, SymbolAnswer* to) {
  return Read(from, kSymbolAnswer, to);
}

bool Decode(const Message& from, ResolveRequest* to) {
  return Read(from, kResolve, to);
}

bool Decode(const Message& from, ResolveAnswer* to) {
  if (!HasFormOf(from, kResolveAnswer) ||
      from.length - kBeforeResolvedText > from.data[kBeforeResolvedText - 1]) {
    return false;
  }
  to->count = static_cast<uint8_t>(from.length - kBeforeResolvedText);
  return Read(from, kResolveAnswer, to);
}

void Encode(const ScanRequest& from, Message* to) {
  Write(from, kScan, to);
}

void Encode(const ScanAnswer& from, Message* to) {
  ScanAnswer it = from;
  it.count = AtMost(kMaxTagsInRange, from.count);
  Write(it, kScanAnswer, to);
}

void Encode(const TagReadRequest& from, Message* to) {
  Write(from, kTagRead, to);
}

void Encode(const TagReadAnswer& from, Message* to) {
  Write(from, kTagReadAnswer, to);
}

void Encode(const TagWriteRequest& from, Message* to) {
  Write(from, kTagWrite, to);
}

void Encode(const TagEraseRequest& from, Message* to) {
  Write(from, kTagErase, to);
}

void Encode(const TagWritten& from, Message* to) {
  Write(from, from.erased ? kTagEraseAnswer : kTagWriteAnswer, to);
}

void Encode(const SymbolRequest& from, Message* to) {
  SymbolRequest it = from;
  it.length = AtMost(kMaxSymbolText, from.length);
  Write(it, kSymbol, to);
}

void Encode(const SymbolAnswer& from, Message* to) {
  Write(from, kSymbolAnswer, to);
}

void Encode(const ResolveRequest& from, Message* to) {
  Write(from, kResolve, to);
}

void Encode(const ResolveAnswer& from, Message* to) {
  ResolveAnswer it = from;
  it.count = AtMost(AtMost(kMaxResolvedText, from.length), from.count);
  Write(it, kResolveAnswer, to);
}

}  // namespace protocol
}  // namespace pheromone
