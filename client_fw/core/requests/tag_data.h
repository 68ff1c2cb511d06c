// Where the fields of TAG's messages are in DATA, by the lists of their fields, for firmware that
// writes and reads them in place: the structs of protocol/tag_messages.h cost an AVR 2 KiB more.
#pragma once

#include <stdint.h>

#include "protocol/fields.h"

namespace pheromone {
namespace client {

// Requests. x and y are the conversation's.
enum ScanField : uint8_t {
  kScanAfter = protocol::OffsetOf(&protocol::ScanRequest::after),
  kScanSize = protocol::SizeOf<protocol::ScanRequest>().least
};
enum ReadField : uint8_t {
  kReadTag = protocol::OffsetOf(&protocol::TagReadRequest::tag),
  kReadSlot = protocol::OffsetOf(&protocol::TagReadRequest::slot),
  kReadSize = protocol::SizeOf<protocol::TagReadRequest>().least
};
enum WriteField : uint8_t {
  kWriteTag = protocol::OffsetOf(&protocol::TagWriteRequest::tag),
  kWriteSlot = protocol::OffsetOf(&protocol::TagWriteRequest::slot),
  kWriteFlags = protocol::OffsetOf(&protocol::TagWriteRequest::flags),
  kWriteExpected = protocol::OffsetOf(&protocol::TagWriteRequest::expected),
  kEraseSize = protocol::SizeOf<protocol::TagEraseRequest>().least,  ///< ERASE has no more
  kWriteLease = protocol::OffsetOf(&protocol::TagWriteRequest::lease_s),
  kWriteTime = protocol::OffsetOf(&protocol::TagWriteRequest::time),
  kWriteWords = protocol::OffsetOf(&protocol::TagWriteRequest::words, 0),
  kWriteSize = protocol::SizeOf<protocol::TagWriteRequest>().least
};
enum SymbolField : uint8_t {
  kSymbolKind = protocol::OffsetOf(&protocol::SymbolRequest::kind),
  kSymbolNumber = protocol::OffsetOf(&protocol::SymbolRequest::number),
  kSymbolText = protocol::OffsetOf(&protocol::SymbolRequest::text, 0)
};
enum ResolveField : uint8_t {
  kResolveKind = protocol::OffsetOf(&protocol::ResolveRequest::kind),
  kResolveRobot = protocol::OffsetOf(&protocol::ResolveRequest::robot),
  kResolveNumber = protocol::OffsetOf(&protocol::ResolveRequest::number),
  kResolveOffset = protocol::OffsetOf(&protocol::ResolveRequest::offset),
  kResolveSize = protocol::SizeOf<protocol::ResolveRequest>().least
};

// Answers.
enum ScannedField : uint8_t {
  kScannedMore = protocol::OffsetOf(&protocol::ScanAnswer::more),
  kScannedRows = protocol::OffsetOf(&protocol::ScanAnswer::rows, 0),
  kScannedRowSize = protocol::SizeOf<protocol::TagInRange>().least
};
enum RowField : uint8_t {
  kRowTag = protocol::OffsetOf(&protocol::TagInRange::tag),
  kRowDx = protocol::OffsetOf(&protocol::TagInRange::dx),
  kRowDy = protocol::OffsetOf(&protocol::TagInRange::dy),
  kRowGeneration = protocol::OffsetOf(&protocol::TagInRange::generation)
};
enum BlockField : uint8_t {
  kBlockTag = protocol::OffsetOf(&protocol::TagReadAnswer::tag),
  kBlockSlot = protocol::OffsetOf(&protocol::TagReadAnswer::slot),
  kBlockNext = protocol::OffsetOf(&protocol::TagReadAnswer::next),
  kBlockTagGeneration = protocol::OffsetOf(&protocol::TagReadAnswer::tag_generation),
  kBlockSlotGeneration = protocol::OffsetOf(&protocol::TagReadAnswer::slot_generation),
  kBlockLease = protocol::OffsetOf(&protocol::TagReadAnswer::lease_s),
  kBlockWords = protocol::OffsetOf(&protocol::TagReadAnswer::words, 0),
  /// Its words without author and time.
  kBlockStatement =
      protocol::OffsetOf(&protocol::TagReadAnswer::words, protocol::kWordSubjectNamespace),
  kBlockSize = protocol::SizeOf<protocol::TagReadAnswer>().least
};
enum WrittenField : uint8_t {
  kWrittenSlot = protocol::OffsetOf(&protocol::TagWritten::slot),
  kWrittenSlotGeneration = protocol::OffsetOf(&protocol::TagWritten::slot_generation),
  kWrittenSize = protocol::SizeOf<protocol::TagWritten>().least
};
enum DefinedField : uint8_t {
  kDefinedNumber = protocol::OffsetOf(&protocol::SymbolAnswer::number),
  kDefinedSize = protocol::SizeOf<protocol::SymbolAnswer>().least
};
enum ResolvedField : uint8_t {
  kResolvedLength = protocol::OffsetOf(&protocol::ResolveAnswer::length),
  kResolvedText = protocol::OffsetOf(&protocol::ResolveAnswer::text, 0)
};

}  // namespace client
}  // namespace pheromone
