// Reads a capture file, record by record.
//
//   CaptureReader reader(source, "lab.pcapng");        // source: ByteReader::Source
//   while (auto next = reader.Next(); next.ok() && next.value()) Use(next.value()->record);
//
// A file is read to where it is whole: after what is missing or damaged Next gives an error, which
// names file, block and byte, and goes on giving it. Records that are missing, or in another order
// than that in which they were written, are such an error too ("not replayable from here").
//
// Takes any bytes. Memory: one block, at most kMaxBlock. One thread at a time.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/capture/format.h"

namespace pheromone::capture {

/// A record and where it stands.
struct Found {
  uint64_t number = 0;  ///< counts the records of the file from 1
  uint64_t packet = 0;  ///< of a packet: counts the packets from 1, as Wireshark does; else of the
                        ///< last one before
  uint64_t byte = 0;    ///< where its block begins
  Record record;
};

class CaptureReader {
 public:
  /// `name` stands for the file in messages.
  CaptureReader(ByteReader::Source source, std::string name);

  /// The next record; nothing at the end of the file. The first one is a Start.
  Result<std::optional<Found>> Next();

  const std::string& name() const { return name_; }

 private:
  Result<std::optional<Found>> Read();
  Error Wrong(const std::string& what) const;

  ByteReader reader_;
  const std::string name_;
  uint64_t offset_ = 0;  // of the block that is read
  uint64_t block_ = 0;
  uint64_t packet_ = 0;
  uint64_t number_ = 0;
  uint64_t interfaces_ = 0;
  uint8_t version_ = kFormatVersion;  // as its Start says
  std::string error_;
  bool ended_ = false;
};

/// Portions of a file, for a reader. Errors: it cannot be opened, or is a folder; a read that fails
/// later looks like the end of the file.
Result<ByteReader::Source> OpenFile(const std::string& path);

}  // namespace pheromone::capture
