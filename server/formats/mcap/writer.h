// Writes MCAP files, the recordings that Foxglove, Lichtblick, ROS 2 and their libraries read: in
// chunks, with an index, and with a CRC-32 over each part. Format: https://mcap.dev/spec, version
// 0.
//
//   Writer writer([&](std::string_view bytes) { return file.Write(bytes); });
//   const uint16_t robots = writer.AddChannel({.topic = "/robots", ...});
//   writer.Write(robots, utc_ns, message);       // in the order of their times
//   const Status written = writer.Finish();
//
// Chunks are not compressed. Memory: one chunk, and 24 bytes of index for each message in it; of
// the chunks before, what the summary says of them.
//
// Errors are the sink's; after one, nothing more is passed to it, and Finish returns it. One thread
// at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/result.h"

namespace pheromone::mcap {

struct Channel {
  std::string topic = {};
  std::string encoding = {};         ///< of messages: "protobuf", "json", "cdr"
  std::string schema_name = {};      ///< empty: there is no schema
  std::string schema_encoding = {};  ///< "protobuf", "ros2msg"
  std::string schema = {};           ///< in bytes
};

class Writer {
 public:
  /// Takes the next bytes of the file.
  using Sink = std::function<Status(std::string_view)>;
  static constexpr size_t kChunkBytes = size_t{1} << 20;

  /// `library` names the program; `profile` is "ros2" of a bag, else empty. A chunk ends with the
  /// message that makes it `chunk_bytes` long.
  explicit Writer(Sink sink, const std::string& library, const std::string& profile = "",
                  size_t chunk_bytes = kChunkBytes);
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  /// Returns the channel's number. At most 65535 channels.
  uint16_t AddChannel(const Channel& channel);

  /// `time_ns` since 1970.
  Status Write(uint16_t channel, uint64_t time_ns, std::string_view message);

  /// Writes the last chunk and the summary. To be called once, last.
  Status Finish();

  uint64_t messages() const { return messages_; }

 private:
  struct ChunkFacts {
    uint64_t first_ns = 0;
    uint64_t last_ns = 0;
    uint64_t offset = 0;  // in the file
    uint64_t bytes = 0;   // of its record
    std::map<uint16_t, uint64_t> index_offsets;
    uint64_t index_bytes = 0;
    uint64_t content_bytes = 0;
  };

  void Put(std::string_view bytes);
  void EndChunk();

  const Sink sink_;
  const size_t chunk_bytes_;
  Status status_ = Ok();
  uint64_t offset_ = 0;
  uint32_t crc_ = 0;
  std::string schema_records_;  // all of them, for the summary
  std::string channel_records_;
  uint16_t schemas_ = 0;
  uint16_t channels_ = 0;
  std::string chunk_;
  ChunkFacts present_;
  std::map<uint16_t, std::vector<std::pair<uint64_t, uint64_t>>> index_;  // time and place
  std::vector<ChunkFacts> chunks_;
  std::map<uint16_t, uint64_t> counts_;  // messages of each channel
  uint64_t messages_ = 0;
};

}  // namespace pheromone::mcap
