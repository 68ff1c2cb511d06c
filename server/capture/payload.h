// Encodes all records except packets: the fields in the order of their declaration.
//
//   ByteWriter writer;
//   EncodePayload(record, &writer);
//   ByteReader reader(writer.bytes());
//   Record same = DecodePayload(record.index(), kFormatVersion, &reader);
//
// Every version ever written can be read: DecodersOf selects the decoders by the version in the
// file's Start. Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/base/bytes.h"
#include "server/capture/record.h"

namespace pheromone::capture {

void EncodePayload(const Record& record, ByteWriter* writer);

/// `kind` is the index of the record in the variant, but not that of a packet. A Start contains its
/// version; for the others it is `version`. Invalid bytes fail the reader; the result is then
/// meaningless.
Record DecodePayload(size_t kind, uint8_t version, ByteReader* reader);

/// Whether files of that version can be read.
bool IsKnownVersion(uint8_t version);

}  // namespace pheromone::capture
