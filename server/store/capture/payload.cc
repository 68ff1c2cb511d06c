#include "server/store/capture/payload.h"

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/core/engine/event_codec.h"
#include "server/store/capture/format.h"

namespace pheromone::capture {
namespace {

constexpr std::string_view kMagic = "pheromone capture";

// --- Parts of records.

void EncodeSents(const std::vector<Sent>& all, ByteWriter* writer) {
  writer->Count(all.size());
  for (const Sent& sent : all) {
    writer->U16(sent.link);
    EncodeFields(sent.message, writer);
  }
}

Sent DecodeSent(ByteReader* reader) {
  Sent sent;
  sent.link = reader->U16();
  DecodeFields(reader, &sent.message);
  return sent;
}

std::vector<Sent> DecodeSents(ByteReader* reader) {
  std::vector<Sent> all;
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    all.push_back(DecodeSent(reader));
  }
  return all;
}

void EncodeStamp(const engine::Stamp& stamp, ByteWriter* writer) {
  writer->U64(stamp.field_time_ms);
  writer->I64(stamp.utc_ms);
}

engine::Stamp DecodeStamp(ByteReader* reader) {
  const uint64_t field_time_ms = reader->U64();
  if (field_time_ms > engine::kMaxFieldTimeMs) {
    reader->Fail("field time out of range");
  }
  return {field_time_ms, reader->I64()};
}

protocol::Reason DecodeReason(ByteReader* reader) {
  return static_cast<protocol::Reason>(
      reader->U8UpTo(static_cast<uint8_t>(protocol::Reason::kUnknownSymbol), "a reason"));
}

// --- The records that are blocks for local use.

void Encode(const Start& it, ByteWriter* writer) {
  writer->Text(kMagic);
  writer->U8(kFormatVersion);
  writer->U64(it.utc_ns);
  writer->U64(it.recording);
  writer->U32(it.part);
  writer->Text(it.version);
  writer->Text(it.config);
  writer->Count(it.links.size());
  for (const LinkInfo& link : it.links) {
    writer->Text(link.name);
    writer->U16(link.gap_timeout_ms);
    writer->Flag(link.datagrams);
  }
  EncodeSents(it.under_way, writer);
  writer->U64(it.state_bytes);
}

void Decode(ByteReader* reader, Start* it) {
  const std::string magic = reader->Text();
  const uint8_t version = reader->U8();
  if (magic != kMagic) {
    reader->Fail("not a pheromoned capture");
  } else if (version != kFormatVersion) {
    reader->Fail("a capture of format version " + std::to_string(version) +
                 ", but this program reads version " + std::to_string(kFormatVersion) +
                 "; use the program that recorded it");
  }
  it->utc_ns = reader->U64();
  it->recording = reader->U64();
  it->part = reader->U32();
  it->version = reader->Text();
  it->config = reader->Text();
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    LinkInfo link;
    link.name = reader->Text();
    link.gap_timeout_ms = reader->U16();
    link.datagrams = reader->Flag();
    it->links.push_back(std::move(link));
  }
  it->under_way = DecodeSents(reader);
  it->state_bytes = reader->U64();
}

void Encode(const State& it, ByteWriter* writer) {
  writer->Text(it.bytes);
}

void Decode(ByteReader* reader, State* it) {
  it->bytes = reader->Text();
}

void Encode(const PartialFrame& it, ByteWriter* writer) {
  writer->U16(it.link);
  writer->U32(it.connection);
  writer->U32(it.read_ms);
  writer->Text(it.bytes);
}

void Decode(ByteReader* reader, PartialFrame* it) {
  it->link = reader->U16();
  it->connection = reader->U32();
  it->read_ms = reader->U32();
  it->bytes = reader->Text();
}

void Encode(const Batch& it, ByteWriter* writer) {
  writer->U64(it.number);
  writer->U16(it.link);
  EncodeStamp(it.stamp, writer);
  writer->Count(it.messages.size());
  for (const Handled& handled : it.messages) {
    EncodeFields(handled.message, writer);
    writer->U64(handled.sequence);
    writer->U8(static_cast<uint8_t>(handled.refused));
  }
}

void Decode(ByteReader* reader, Batch* it) {
  it->number = reader->U64();
  it->link = reader->U16();
  it->stamp = DecodeStamp(reader);
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    Handled handled;
    DecodeFields(reader, &handled.message);
    handled.sequence = reader->U64();
    handled.refused = DecodeReason(reader);
    it->messages.push_back(handled);
  }
}

void Encode(const EventApplied& it, ByteWriter* writer) {
  writer->U64(it.sequence);
  EncodeStamp(it.stamp, writer);
  engine::EncodeEvent(it.event, writer);
}

void Decode(ByteReader* reader, EventApplied* it) {
  it->sequence = reader->U64();
  it->stamp = DecodeStamp(reader);
  it->event = engine::DecodeEvent(reader);
}

void Encode(const Rejected& it, ByteWriter* writer) {
  writer->U16(it.link);
  EncodeFields(it.message, writer);
  writer->U8(static_cast<uint8_t>(it.answer));
}

void Decode(ByteReader* reader, Rejected* it) {
  it->link = reader->U16();
  DecodeFields(reader, &it->message);
  it->answer = DecodeReason(reader);
}

void Encode(const Dropped& it, ByteWriter* writer) {
  writer->U16(it.sent.link);
  EncodeFields(it.sent.message, writer);
}

void Decode(ByteReader* reader, Dropped* it) {
  it->sent = DecodeSent(reader);
}

void Encode(const FromBefore& it, ByteWriter* writer) {
  writer->U16(it.sent.link);
  EncodeFields(it.sent.message, writer);
}

void Decode(ByteReader* reader, FromBefore* it) {
  it->sent = DecodeSent(reader);
}

void Encode(const Gap& it, ByteWriter* writer) {
  writer->U64(it.utc_ns);
  writer->U64(it.records);
}

void Decode(ByteReader* reader, Gap* it) {
  it->utc_ns = reader->U64();
  it->records = reader->U64();
}

void Encode(const End& it, ByteWriter* writer) {
  writer->U64(it.utc_ns);
  writer->U64(it.sequence);
  writer->U64(it.state_hash);
  EncodeSents(it.under_way, writer);
}

void Decode(ByteReader* reader, End* it) {
  it->utc_ns = reader->U64();
  it->sequence = reader->U64();
  it->state_hash = reader->U64();
  it->under_way = DecodeSents(reader);
}

void Encode(const Unlogged& it, ByteWriter* writer) {
  writer->U16(it.sent.link);
  EncodeFields(it.sent.message, writer);
}

void Decode(ByteReader* reader, Unlogged* it) {
  it->sent = DecodeSent(reader);
}

// Packets have a block type of their own (format.cc).
void Encode(const Packet& /*it*/, ByteWriter* /*writer*/) {}

template <typename T>
Record DecodeAs(ByteReader* reader) {
  T it;
  Decode(reader, &it);
  return it;
}

}  // namespace

void EncodePayload(const Record& record, ByteWriter* writer) {
  std::visit([writer](const auto& it) { Encode(it, writer); }, record);
}

Record DecodePayload(size_t kind, ByteReader* reader) {
  // In the order of Record; packets have blocks of their own.
  static constexpr std::array<Record (*)(ByteReader*), std::variant_size_v<Record>> kDecoders = {
      DecodeAs<Start>,        DecodeAs<State>,   nullptr,
      DecodeAs<PartialFrame>, DecodeAs<Batch>,   DecodeAs<EventApplied>,
      DecodeAs<Rejected>,     DecodeAs<Dropped>, DecodeAs<FromBefore>,
      DecodeAs<Gap>,          DecodeAs<End>,     DecodeAs<Unlogged>};
  return kDecoders[kind](reader);
}

}  // namespace pheromone::capture
