// Reads the records of a segment file sequentially in bounded memory: a file may have any size,
// even if something has extended it to 20 GB.
//
// Fragmented events are returned as complete events, kEvent.
//
//   SegmentReader reader(folder, "00000042.segment");
//   Record record;
//   while (reader.Next(&record) == RecordReader::Found::kRecord) ...
//
// One thread; the folder outlives the reader.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/base/result.h"
#include "server/store/journal/folder.h"
#include "server/store/journal/format.h"

namespace pheromone::journal {

class SegmentReader {
 public:
  /// Reads up to the present end of the file, which may be being written.
  SegmentReader(const Folder& folder, std::string name);

  /// The data that the record points to is valid until the next call. Also returns kBad if the file
  /// cannot be read: then status() is an error.
  RecordReader::Found Next(Record* record);

  uint64_t at() const { return at_; }
  uint64_t size() const { return size_; }
  const std::string& why() const { return why_; }
  /// Errors: the file could not be read.
  const Status& status() const { return status_; }

 private:
  RecordReader::Found NextAsWritten(Record* record);
  std::string TakePiece(const Record& record);
  std::string JoinPieces(Record* record);
  bool Fill(uint64_t bytes);
  bool HasItsChecksum(uint64_t bytes);
  RecordReader::Found Bad(std::string why);

  const Folder& folder_;
  const std::string name_;
  uint64_t at_ = kSegmentHeaderBytes;
  uint64_t size_ = 0;
  std::string window_;
  uint64_t window_at_ = 0;
  std::string event_;  // the record of an event in pieces, as far as it was read; empty: of none
  bool is_whole_ = false;
  std::string why_;
  Status status_ = Ok();
};

/// Like DurableIn of format.h, for a file of any size. `read` is called periodically with the
/// number of bytes read since the last call. What a server has written from `end` on is not read.
Result<uint64_t> DurableIn(const Folder& folder, const std::string& name, uint64_t at,
                           const std::function<void(uint64_t)>& read, uint64_t end = UINT64_MAX);

}  // namespace pheromone::journal
