// Encodes all records except packets: the fields in the order of their declaration.
//
//   ByteWriter writer;
//   EncodePayload(record, &writer);
//   ByteReader reader(writer.bytes());
//   Record same = DecodePayload(record.index(), &reader);
//
// Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/base/bytes.h"
#include "server/store/capture/record.h"

namespace pheromone::capture {

void EncodePayload(const Record& record, ByteWriter* writer);

/// `kind` is the index of the record in the variant, but not that of a packet. Invalid
/// bytes, and a Start of another format version, fail the reader; the result is then meaningless.
Record DecodePayload(size_t kind, ByteReader* reader);

}  // namespace pheromone::capture
