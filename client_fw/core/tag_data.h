// Where the fields of TAG's messages are in DATA (protocol/README.md, section 4), for firmware that
// writes and reads them in place: the structs of protocol/tag_messages.h cost an AVR 2 KiB more.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

// Requests. x and y are the conversation's.
enum ScanField : uint8_t { kScanAfter = 8, kScanSize = 10 };
enum ReadField : uint8_t { kReadTag = 8, kReadSlot = 10, kReadSize = 11 };
enum WriteField : uint8_t {
  kWriteTag = 9,
  kWriteSlot = 11,
  kWriteFlags = 12,
  kWriteExpected = 13,
  kEraseSize = 15,  ///< ERASE has no more
  kWriteLease = 15,
  kWriteTime = 17,
  kWriteWords = 21,
  kWriteSize = 45
};
enum SymbolField : uint8_t { kSymbolKind = 1, kSymbolNumber = 2, kSymbolText = 6 };
enum ResolveField : uint8_t {
  kResolveKind = 0,
  kResolveRobot = 1,
  kResolveNumber = 5,
  kResolveOffset = 9,
  kResolveSize = 10
};

// Answers.
enum ScannedField : uint8_t { kScannedMore = 0, kScannedRows = 1, kScannedRowSize = 8 };
enum RowField : uint8_t { kRowTag = 0, kRowDx = 2, kRowDy = 4, kRowGeneration = 6 };
enum BlockField : uint8_t {
  kBlockTag = 0,
  kBlockSlot = 2,
  kBlockNext = 3,
  kBlockTagGeneration = 5,
  kBlockSlotGeneration = 7,
  kBlockLease = 9,
  kBlockWords = 12,
  kBlockStatement = 20,  ///< its words without author and time
  kBlockSize = 44
};
enum WrittenField : uint8_t { kWrittenSlot = 3, kWrittenSlotGeneration = 4, kWrittenSize = 8 };
enum DefinedField : uint8_t { kDefinedNumber = 2, kDefinedSize = 6 };
enum ResolvedField : uint8_t { kResolvedLength = 13, kResolvedText = 14 };

}  // namespace client
}  // namespace pheromone
