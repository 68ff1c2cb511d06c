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

// DATA from its front.
class FieldReader {
 public:
  explicit FieldReader(const Message& from) : at_(from.data) {}

  uint8_t U8() { return *at_++; }
  uint16_t U16() { return GetU16(Skip(2)); }
  int16_t I16() { return GetI16(Skip(2)); }
  uint32_t U32() { return GetU32(Skip(4)); }
  int32_t I32() { return GetI32(Skip(4)); }
  void Words(int32_t* to, uint8_t count) {
    for (uint8_t i = 0; i < count; ++i) {
      to[i] = I32();
    }
  }
  void Text(uint8_t* to, uint8_t count) {
    for (uint8_t i = 0; i < count; ++i) {
      to[i] = U8();
    }
  }

 private:
  const uint8_t* Skip(uint8_t count) {
    const uint8_t* const before = at_;
    at_ += count;
    return before;
  }

  const uint8_t* at_;
};

// The same to write; the message's length is that of what has been put.
class FieldWriter {
 public:
  FieldWriter(Message* to, uint8_t id, uint8_t opcode) : to_(to) {
    to->id = id;
    to->opcode = opcode;
    to->length = 0;
  }

  void U8(uint8_t value) { *Add(1) = value; }
  void U16(uint16_t value) { PutU16(Add(2), value); }
  void I16(int16_t value) { PutI16(Add(2), value); }
  void U32(uint32_t value) { PutU32(Add(4), value); }
  void I32(int32_t value) { PutI32(Add(4), value); }
  void Words(const int32_t* from, uint8_t count) {
    for (uint8_t i = 0; i < count; ++i) {
      I32(from[i]);
    }
  }
  void Text(const uint8_t* from, uint8_t count) {
    for (uint8_t i = 0; i < count; ++i) {
      U8(from[i]);
    }
  }

 private:
  uint8_t* Add(uint8_t count) {
    uint8_t* const at = to_->data + to_->length;
    to_->length = static_cast<uint8_t>(to_->length + count);
    return at;
  }

  Message* to_;
};

}  // namespace

bool Decode(const Message& from, ScanRequest* to) {
  if (!HasFormOf(from, kScan)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->x = reader.I32();
  to->y = reader.I32();
  to->after = reader.U16();
  return true;
}

bool Decode(const Message& from, ScanAnswer* to) {
  if (!HasFormOf(from, kScanAnswer) || (from.length - kBeforeRows) % kRowBytes != 0) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->more = reader.U8();
  to->count = static_cast<uint8_t>((from.length - kBeforeRows) / kRowBytes);
  for (uint8_t i = 0; i < to->count; ++i) {
    TagInRange& row = to->rows[i];
    row.tag = reader.U16();
    row.dx = reader.I16();
    row.dy = reader.I16();
    row.generation = reader.U16();
  }
  return true;
}

bool Decode(const Message& from, TagReadRequest* to) {
  if (!HasFormOf(from, kTagRead)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->x = reader.I32();
  to->y = reader.I32();
  to->tag = reader.U16();
  to->slot = reader.U8();
  return true;
}

bool Decode(const Message& from, TagReadAnswer* to) {
  if (!HasFormOf(from, kTagReadAnswer)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->tag = reader.U16();
  to->slot = reader.U8();
  to->next = reader.U8();
  to->slots = reader.U8();
  to->tag_generation = reader.U16();
  to->slot_generation = reader.U16();
  to->lease_s = reader.U16();
  to->flags = reader.U8();
  reader.Words(to->words, kTagWords);
  return true;
}

bool Decode(const Message& from, TagWriteRequest* to) {
  if (!HasFormOf(from, kTagWrite)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->seq = reader.U8();
  to->x = reader.I32();
  to->y = reader.I32();
  to->tag = reader.U16();
  to->slot = reader.U8();
  to->flags = reader.U8();
  to->expected = reader.U16();
  to->lease_s = reader.U16();
  to->time = reader.U32();
  reader.Words(to->words, kStatementWords);
  return true;
}

bool Decode(const Message& from, TagEraseRequest* to) {
  if (!HasFormOf(from, kTagErase)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->seq = reader.U8();
  to->x = reader.I32();
  to->y = reader.I32();
  to->tag = reader.U16();
  to->slot = reader.U8();
  to->flags = reader.U8();
  to->expected = reader.U16();
  return true;
}

bool Decode(const Message& from, TagWritten* to) {
  const bool erased = from.opcode == kTagEraseAnswer;
  if (!HasFormOf(from, erased ? kTagEraseAnswer : kTagWriteAnswer)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->erased = erased;
  to->seq = reader.U8();
  to->tag = reader.U16();
  to->slot = reader.U8();
  to->slot_generation = reader.U16();
  to->tag_generation = reader.U16();
  return true;
}

bool Decode(const Message& from, SymbolRequest* to) {
  if (!HasFormOf(from, kSymbol)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->seq = reader.U8();
  to->kind = static_cast<SymbolKind>(reader.U8());
  to->number = reader.I32();
  to->length = static_cast<uint8_t>(from.length - kBeforeSymbolText);
  reader.Text(to->text, to->length);
  return true;
}

bool Decode(const Message& from, SymbolAnswer* to) {
  if (!HasFormOf(from, kSymbolAnswer)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->seq = reader.U8();
  to->kind = static_cast<SymbolKind>(reader.U8());
  to->number = reader.I32();
  return true;
}

bool Decode(const Message& from, ResolveRequest* to) {
  if (!HasFormOf(from, kResolve)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->kind = static_cast<SymbolKind>(reader.U8());
  to->robot = reader.I32();
  to->number = reader.I32();
  to->offset = reader.U8();
  return true;
}

bool Decode(const Message& from, ResolveAnswer* to) {
  if (!HasFormOf(from, kResolveAnswer)) {
    return false;
  }
  FieldReader reader(from);
  to->id = from.id;
  to->kind = static_cast<SymbolKind>(reader.U8());
  to->robot = reader.I32();
  to->number = reader.I32();
  to->rows = reader.U32();
  to->length = reader.U8();
  to->count = static_cast<uint8_t>(from.length - kBeforeResolvedText);
  reader.Text(to->text, to->count);
  return true;
}

void Encode(const ScanRequest& from, Message* to) {
  FieldWriter writer(to, from.id, kScan);
  writer.I32(from.x);
  writer.I32(from.y);
  writer.U16(from.after);
}

void Encode(const ScanAnswer& from, Message* to) {
  FieldWriter writer(to, from.id, kScanAnswer);
  writer.U8(from.more);
  for (uint8_t i = 0; i < AtMost(kMaxTagsInRange, from.count); ++i) {
    const TagInRange& row = from.rows[i];
    writer.U16(row.tag);
    writer.I16(row.dx);
    writer.I16(row.dy);
    writer.U16(row.generation);
  }
}

void Encode(const TagReadRequest& from, Message* to) {
  FieldWriter writer(to, from.id, kTagRead);
  writer.I32(from.x);
  writer.I32(from.y);
  writer.U16(from.tag);
  writer.U8(from.slot);
}

void Encode(const TagReadAnswer& from, Message* to) {
  FieldWriter writer(to, from.id, kTagReadAnswer);
  writer.U16(from.tag);
  writer.U8(from.slot);
  writer.U8(from.next);
  writer.U8(from.slots);
  writer.U16(from.tag_generation);
  writer.U16(from.slot_generation);
  writer.U16(from.lease_s);
  writer.U8(from.flags);
  writer.Words(from.words, kTagWords);
}

void Encode(const TagWriteRequest& from, Message* to) {
  FieldWriter writer(to, from.id, kTagWrite);
  writer.U8(from.seq);
  writer.I32(from.x);
  writer.I32(from.y);
  writer.U16(from.tag);
  writer.U8(from.slot);
  writer.U8(from.flags);
  writer.U16(from.expected);
  writer.U16(from.lease_s);
  writer.U32(from.time);
  writer.Words(from.words, kStatementWords);
}

void Encode(const TagEraseRequest& from, Message* to) {
  FieldWriter writer(to, from.id, kTagErase);
  writer.U8(from.seq);
  writer.I32(from.x);
  writer.I32(from.y);
  writer.U16(from.tag);
  writer.U8(from.slot);
  writer.U8(from.flags);
  writer.U16(from.expected);
}

void Encode(const TagWritten& from, Message* to) {
  FieldWriter writer(to, from.id, from.erased ? kTagEraseAnswer : kTagWriteAnswer);
  writer.U8(from.seq);
  writer.U16(from.tag);
  writer.U8(from.slot);
  writer.U16(from.slot_generation);
  writer.U16(from.tag_generation);
}

void Encode(const SymbolRequest& from, Message* to) {
  FieldWriter writer(to, from.id, kSymbol);
  writer.U8(from.seq);
  writer.U8(static_cast<uint8_t>(from.kind));
  writer.I32(from.number);
  writer.Text(from.text, AtMost(kMaxSymbolText, from.length));
}

void Encode(const SymbolAnswer& from, Message* to) {
  FieldWriter writer(to, from.id, kSymbolAnswer);
  writer.U8(from.seq);
  writer.U8(static_cast<uint8_t>(from.kind));
  writer.I32(from.number);
}

void Encode(const ResolveRequest& from, Message* to) {
  FieldWriter writer(to, from.id, kResolve);
  writer.U8(static_cast<uint8_t>(from.kind));
  writer.I32(from.robot);
  writer.I32(from.number);
  writer.U8(from.offset);
}

void Encode(const ResolveAnswer& from, Message* to) {
  FieldWriter writer(to, from.id, kResolveAnswer);
  writer.U8(static_cast<uint8_t>(from.kind));
  writer.I32(from.robot);
  writer.I32(from.number);
  writer.U32(from.rows);
  writer.U8(from.length);
  writer.Text(from.text, AtMost(kMaxResolvedText, from.count));
}

}  // namespace protocol
}  // namespace pheromone
