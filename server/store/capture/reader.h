// Reads a capture file, record by record.
//
//   CaptureReader reader(source, "lab.pcapng");        // source: ByteReader::Source
//   while (auto next = reader.Next(); next.ok() && next.value()) Use(next.value()->record);
//
// A file is read up to the first missing or damaged block: from there on, Next returns an error
// that names the file, block and byte. Records that are missing or out of order are also such an
// error
// ("not replayable from here").
//
// Safe for untrusted input. Memory: one block, at most kMaxBlock; so much, or kMaxFileHeader, is
// also the most that one call reads. One thread at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/store/capture/format.h"

namespace pheromone::capture {

/// A record and its position.
struct Found {
  uint64_t number = 0;  ///< counts the records of the file from 1
  uint64_t packet = 0;  ///< the number of the packet, counted from 1 as in Wireshark; for other
                        ///< records, that of the last packet before
  uint64_t byte = 0;    ///< the offset of its block
  Record record;
};

class CaptureReader {
 public:
  /// Where it is in a file, for another reader of the same file to continue from there.
  struct Position {
    uint64_t byte = 0;    ///< of the next block
    uint64_t block = 0;   ///< the number of the last block
    uint64_t packet = 0;  ///< and of the last packet
    uint64_t number = 0;  ///< and record
    uint64_t interfaces = 0;
  };

  /// `name` is the name of the file in messages. `source` begins at `from.byte`.
  CaptureReader(ByteReader::Source source, std::string name);
  CaptureReader(ByteReader::Source source, std::string name, const Position& from);

  /// The next record; nothing at the end of the file. The first one is a Start.
  Result<std::optional<Found>> Next();

  const std::string& name() const { return name_; }
  /// After the last record that was returned.
  const Position& position() const { return at_; }

 private:
  Result<std::optional<Found>> Read();
  Error Wrong(const std::string& what) const;

  ByteReader reader_;
  const std::string name_;
  Position at_;
  std::string error_;
  bool ended_ = false;
};

/// Reads a file in portions, for a CaptureReader, from an offset on. Errors: it cannot be opened,
/// or is a folder; a later read error looks like the end of the file.
Result<ByteReader::Source> OpenFile(const std::string& path, uint64_t from = 0);

}  // namespace pheromone::capture
