#include "server/store/capture/format.h"

#include <optional>
#include <utility>

#include "server/base/bytes.h"
#include "server/store/capture/crc32.h"
#include "server/store/capture/payload.h"

namespace pheromone::capture {
namespace {

// Types of blocks for local use have the highest bit set. The rest of the type is "PH" and a kind,
// which is the record's index in the variant.
constexpr uint32_t kLocal = 0x80504800;
constexpr uint32_t kByteOrderMagic = 0x1A2B3C4D;

constexpr uint16_t kEndOfOptions = 0;
constexpr uint16_t kUserApplication = 4;  // of a section
constexpr uint16_t kInterfaceName = 2;
constexpr uint16_t kTimeResolution = 9;
constexpr uint16_t kPacketFlags = 2;
constexpr uint16_t kPacketId = 5;
constexpr uint16_t kPacketSeal = 0x8001;  // for local use: the decoder's time, a CRC

constexpr uint16_t kLinkTypeUser0 = 147;
constexpr uint8_t kNanoseconds = 9;  // 10^-9 s
constexpr size_t kPacketHeader = 8;

constexpr size_t kPacketKind = 2;  // its place in the variant
static_assert(std::is_same_v<std::variant_alternative_t<kPacketKind, Record>, Packet>);

void Pad(ByteWriter* writer) {
  while (writer->bytes().size() % 4 != 0) {
    writer->U8(0);
  }
}

std::string Block(uint32_t type, std::string_view body) {
  ByteWriter writer;
  const auto length = static_cast<uint32_t>(body.size() + 12);
  writer.U32(type);
  writer.U32(length);
  writer.Raw(body);
  writer.U32(length);
  return writer.Take();
}

void Option(uint16_t code, std::string_view value, ByteWriter* writer) {
  writer->U16(code);
  writer->U16(static_cast<uint16_t>(value.size()));
  writer->Raw(value);
  Pad(writer);
}

std::string EncodeLocal(const Record& record, uint64_t number) {
  ByteWriter sealed;  // the bytes covered by the CRC
  sealed.U64(number);
  EncodePayload(record, &sealed);
  ByteWriter body;
  body.U32(Crc32(sealed.bytes()));
  body.Text(sealed.bytes());
  Pad(&body);
  return Block(kLocal | static_cast<uint32_t>(record.index()), body.bytes());
}

Result<Numbered> DecodeLocal(uint32_t type, std::string_view body) {
  ByteReader outer(body);
  const uint32_t crc = outer.U32();
  const std::string sealed = outer.Text();
  if (!outer.ok()) {
    return Error{"a record that " + outer.error()};
  }
  if (Crc32(sealed) != crc) {
    return Error{"a damaged record: checksum mismatch"};
  }
  ByteReader reader(sealed);
  Numbered numbered;
  numbered.number = reader.U64();
  numbered.record = DecodePayload(type & 0xFF, &reader);
  reader.ExpectEnd();
  if (!reader.ok()) {
    return Error{"an invalid record: " + reader.error()};
  }
  return numbered;
}

// --- Packets.

std::string EncodePacket(const Packet& it, uint64_t number) {
  ByteWriter body;
  const auto size = static_cast<uint32_t>(kPacketHeader + it.bytes.size());
  body.U32(it.link);
  body.U32(static_cast<uint32_t>(it.utc_ns >> 32));
  body.U32(static_cast<uint32_t>(it.utc_ns));
  body.U32(size);  // captured
  body.U32(size);  // on the wire
  body.U16(it.link);
  body.U32(it.connection);
  body.U8(static_cast<uint8_t>(it.direction));
  body.U8(0);
  body.Raw(it.bytes);
  Pad(&body);
  ByteWriter flags;
  flags.U32(static_cast<uint32_t>(it.direction));
  Option(kPacketFlags, flags.bytes(), &body);
  ByteWriter id;
  id.U64(number);
  Option(kPacketId, id.bytes(), &body);
  ByteWriter seal;
  seal.U32(it.read_ms);
  seal.U32(Crc32(body.bytes() + seal.bytes()));
  Option(kPacketSeal, seal.bytes(), &body);
  Option(kEndOfOptions, "", &body);
  return Block(kEnhancedPacket, body.bytes());
}

Result<Numbered> DecodePacket(std::string_view body) {
  ByteReader reader(body);
  Packet packet;
  const uint32_t interface = reader.U32();
  packet.utc_ns = uint64_t{reader.U32()} << 32;
  packet.utc_ns |= reader.U32();
  const uint32_t size = reader.U32();
  const uint32_t wire_size = reader.U32();
  packet.link = reader.U16();
  packet.connection = reader.U32();
  const uint8_t direction = reader.U8UpTo(2, "a packet's direction");
  reader.U8();
  if (!reader.ok() || size < kPacketHeader || size != wire_size || interface != packet.link ||
      direction == 0) {
    return Error{reader.ok() ? "a packet with an invalid header"
                             : "a packet that " + reader.error()};
  }
  packet.direction = static_cast<Direction>(direction);
  for (size_t left = size - kPacketHeader; left > 0 && reader.ok(); --left) {
    packet.bytes += static_cast<char>(reader.U8());
  }
  const auto skip_padding = [&reader](size_t used) {
    for (size_t i = used; i % 4 != 0; ++i) {
      reader.U8();
    }
  };
  skip_padding(size);
  size_t at = 20 + (size_t{size} + 3) / 4 * 4;
  std::optional<uint64_t> number;
  bool sealed = false;
  while (reader.ok() && !sealed) {
    const uint16_t code = reader.U16();
    const uint16_t length = reader.U16();
    if (code == kEndOfOptions) {
      break;
    }
    if (code == kPacketId && length == 8) {
      number = reader.U64();
    } else if (code == kPacketSeal && length == 8) {
      packet.read_ms = reader.U32();
      const uint32_t crc = reader.U32();
      ByteWriter time;
      time.U32(packet.read_ms);
      sealed = reader.ok() && Crc32(std::string(body.substr(0, at)) + time.bytes()) == crc;
      if (!sealed) {
        break;
      }
    } else {
      for (size_t i = 0; i < length && reader.ok(); ++i) {
        reader.U8();
      }
      skip_padding(length);
    }
    at += 4 + (size_t{length} + 3) / 4 * 4;
  }
  if (!reader.ok() || !sealed || !number) {
    return Error{"a packet that is damaged or was not written by pheromoned: checksum mismatch"};
  }
  return Numbered{*number, std::move(packet)};
}

}  // namespace

std::string EncodeFileHeader(const std::vector<LinkInfo>& links, std::string_view version) {
  ByteWriter section;
  section.U32(kByteOrderMagic);
  section.U16(1);  // version 1.0
  section.U16(0);
  section.I64(-1);  // of unknown length
  Option(kUserApplication, "pheromoned " + std::string(version), &section);
  Option(kEndOfOptions, "", &section);
  std::string header = Block(kSectionHeader, section.bytes());
  for (const LinkInfo& link : links) {
    ByteWriter interface;
    interface.U16(kLinkTypeUser0);
    interface.U16(0);
    interface.U32(0);  // packets of any length
    Option(kInterfaceName, link.name, &interface);
    Option(kTimeResolution, std::string(1, static_cast<char>(kNanoseconds)), &interface);
    Option(kEndOfOptions, "", &interface);
    header += Block(kInterface, interface.bytes());
  }
  return header;
}

std::string EncodeRecord(const Record& record, uint64_t number) {
  const auto* packet = std::get_if<Packet>(&record);
  return packet != nullptr ? EncodePacket(*packet, number) : EncodeLocal(record, number);
}

bool IsRecord(uint32_t type) {
  return type == kEnhancedPacket ||
         ((type & ~0xFFu) == kLocal && (type & 0xFF) < std::variant_size_v<Record> &&
          (type & 0xFF) != kPacketKind);
}

Result<Numbered> DecodeRecord(uint32_t type, std::string_view body) {
  if (!IsRecord(type)) {
    return Error{"unexpected block type"};
  }
  return type == kEnhancedPacket ? DecodePacket(body) : DecodeLocal(type, body);
}

}  // namespace pheromone::capture
