// What the records say that are no packets, as bytes: the fields in the order of their declaration.
//
//   ByteWriter writer;
//   EncodePayload(record, &writer);
//   ByteReader reader(writer.bytes());
//   Record same = DecodePayload(record.index(), kFormatVersion, &reader);
//
// Each version that was ever written is read: its decoders are looked up in one place, by the
// number that stands in the file's Start (DecodersOf). Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/base/bytes.h"
#include "server/capture/record.h"

namespace pheromone::capture {

void EncodePayload(const Record& record, ByteWriter* writer);

/// `kind` is the record's place in the variant, and not a packet's. A Start has its version in it;
/// for the others it is `version`. Fails the reader for what no such record says; what is returned
/// then is of no use.
Record DecodePayload(size_t kind, uint8_t version, ByteReader* reader);

/// Whether files of that version are read.
bool IsKnownVersion(uint8_t version);

}  // namespace pheromone::capture
