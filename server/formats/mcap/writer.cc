#include "server/formats/mcap/writer.h"

#include <zlib.h>

#include <algorithm>

namespace pheromone::mcap {
namespace {

constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum Opcode : uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

// Little-endian.
template <typename T>
void Append(std::string* to, T number) {
  for (size_t i = 0; i < sizeof(T); ++i) {
    to->push_back(static_cast<char>((uint64_t{number} >> (8 * i)) & 0xFF));
  }
}

void AppendString(std::string* to, std::string_view text) {
  Append(to, static_cast<uint32_t>(text.size()));
  to->append(text);
}

// Of pairs of fixed size.
void AppendMap(std::string* to, const std::map<uint16_t, uint64_t>& map) {
  Append(to, static_cast<uint32_t>(map.size() * (sizeof(uint16_t) + sizeof(uint64_t))));
  for (const auto& [key, value] : map) {
    Append(to, key);
    Append(to, value);
  }
}

std::string Record(Opcode opcode, std::string_view content) {
  std::string record(1, static_cast<char>(opcode));
  Append(&record, uint64_t{content.size()});
  return record.append(content);
}

uint32_t Crc(uint32_t crc, std::string_view bytes) {
  return static_cast<uint32_t>(
      crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace

Writer::Writer(Sink sink, const std::string& library, const std::string& profile,
               size_t chunk_bytes)
    : sink_(std::move(sink)), chunk_bytes_(chunk_bytes) {
  std::string header;
  AppendString(&header, profile);
  AppendString(&header, library);
  Put(kMagic);
  Put(Record(kHeader, header));
}

void Writer::Put(std::string_view bytes) {
  if (status_.ok()) {
    status_ = sink_(bytes);
  }
  offset_ += bytes.size();
  crc_ = Crc(crc_, bytes);
}

uint16_t Writer::AddChannel(const Channel& channel) {
  uint16_t schema = 0;
  if (!channel.schema_name.empty()) {
    schema = ++schemas_;
    std::string content;
    Append(&content, schema);
    AppendString(&content, channel.schema_name);
    AppendString(&content, channel.schema_encoding);
    AppendString(&content, channel.schema);
    const std::string record = Record(kSchema, content);
    schema_records_ += record;
    chunk_ += record;
  }
  const uint16_t id = ++channels_;
  std::string content;
  Append(&content, id);
  Append(&content, schema);
  AppendString(&content, channel.topic);
  AppendString(&content, channel.encoding);
  AppendString(&content, "");  // no metadata: a map of no bytes
  const std::string record = Record(kChannel, content);
  channel_records_ += record;
  chunk_ += record;
  return id;
}

Status Writer::Write(uint16_t channel, uint64_t time_ns, std::string_view message) {
  if (index_.empty()) {
    present_.first_ns = time_ns;
    present_.last_ns = time_ns;
  }
  present_.first_ns = std::min(present_.first_ns, time_ns);
  present_.last_ns = std::max(present_.last_ns, time_ns);
  index_[channel].emplace_back(time_ns, chunk_.size());
  ++messages_;
  const auto count = static_cast<uint32_t>(++counts_[channel]);
  std::string content;
  content.reserve(message.size() + 32);
  Append(&content, channel);
  Append(&content, count);
  Append(&content, time_ns);  // when it was recorded, and when it was published
  Append(&content, time_ns);
  content += message;
  chunk_ += Record(kMessage, content);
  if (chunk_.size() >= chunk_bytes_) {
    EndChunk();
  }
  return status_;
}

void Writer::EndChunk() {
  if (chunk_.empty()) {
    return;
  }
  std::string content;
  content.reserve(chunk_.size() + 64);
  Append(&content, present_.first_ns);
  Append(&content, present_.last_ns);
  Append(&content, uint64_t{chunk_.size()});
  Append(&content, Crc(0, chunk_));
  AppendString(&content, "");  // not compressed
  Append(&content, uint64_t{chunk_.size()});
  content += chunk_;
  present_.content_bytes = chunk_.size();
  present_.offset = offset_;
  const std::string record = Record(kChunk, content);
  present_.bytes = record.size();
  Put(record);
  const uint64_t begin = offset_;
  for (const auto& [channel, entries] : index_) {
    present_.index_offsets[channel] = offset_;
    std::string index;
    Append(&index, channel);
    Append(&index, static_cast<uint32_t>(entries.size() * 2 * sizeof(uint64_t)));
    for (const auto& [time_ns, place] : entries) {
      Append(&index, time_ns);
      Append(&index, place);
    }
    Put(Record(kMessageIndex, index));
  }
  present_.index_bytes = offset_ - begin;
  chunks_.push_back(std::move(present_));
  present_ = {};
  index_.clear();
  chunk_.clear();
}

Status Writer::Finish() {
  EndChunk();
  std::string end;
  Append(&end, crc_);  // of all before
  Put(Record(kDataEnd, end));
  const uint64_t summary = offset_;
  crc_ = 0;
  struct Group {
    Opcode opcode;
    uint64_t begin;
    uint64_t bytes;
  };
  std::vector<Group> groups;
  const auto put = [&](Opcode opcode, const std::string& records) {
    if (!records.empty()) {
      groups.push_back({opcode, offset_, records.size()});
      Put(records);
    }
  };
  put(kSchema, schema_records_);
  put(kChannel, channel_records_);
  std::string statistics;
  Append(&statistics, messages_);
  Append(&statistics, schemas_);
  Append(&statistics, uint32_t{channels_});
  Append(&statistics, uint32_t{0});  // attachments
  Append(&statistics, uint32_t{0});  // metadata
  Append(&statistics, static_cast<uint32_t>(chunks_.size()));
  uint64_t first_ns = UINT64_MAX;
  uint64_t last_ns = 0;
  std::string indexes;
  for (const ChunkFacts& chunk : chunks_) {
    if (!chunk.index_offsets.empty()) {  // otherwise it has only definitions
      first_ns = std::min(first_ns, chunk.first_ns);
      last_ns = std::max(last_ns, chunk.last_ns);
    }
    std::string index;
    Append(&index, chunk.first_ns);
    Append(&index, chunk.last_ns);
    Append(&index, chunk.offset);
    Append(&index, chunk.bytes);
    AppendMap(&index, chunk.index_offsets);
    Append(&index, chunk.index_bytes);
    AppendString(&index, "");
    Append(&index, chunk.content_bytes);
    Append(&index, chunk.content_bytes);
    indexes += Record(kChunkIndex, index);
  }
  Append(&statistics, messages_ != 0 ? first_ns : 0);
  Append(&statistics, last_ns);
  AppendMap(&statistics, counts_);
  put(kStatistics, Record(kStatistics, statistics));
  put(kChunkIndex, indexes);
  const uint64_t offsets = offset_;
  for (const Group& group : groups) {
    std::string content(1, static_cast<char>(group.opcode));
    Append(&content, group.begin);
    Append(&content, group.bytes);
    Put(Record(kSummaryOffset, content));
  }
  std::string footer(1, static_cast<char>(kFooter));
  Append(&footer, uint64_t{2 * sizeof(uint64_t) + sizeof(uint32_t)});
  Append(&footer, summary);
  Append(&footer, offsets);
  Put(footer);
  std::string crc;
  Append(&crc, crc_);
  Put(crc);
  Put(kMagic);
  return status_;
}

}  // namespace pheromone::mcap
