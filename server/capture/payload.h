// What the records say that are no packets, as bytes: the fields in the order of their declaration.
//
//   ByteWriter writer;
//   EncodePayload(record, &writer);
//   ByteReader reader(writer.bytes());
//   Record same = DecodePayload(record.index(), &reader);
//
// Pure; any thread.
#pragma once

#include <cstddef>

#include "server/base/bytes.h"
#include "server/capture/record.h"

namespace pheromone::capture {

void EncodePayload(const Record& record, ByteWriter* writer);

/// `kind` is the record's place in the variant, and not a packet's. Fails the reader for what no
/// such record says; what is returned then is of no use.
Record DecodePayload(size_t kind, ByteReader* reader);

}  // namespace pheromone::capture
