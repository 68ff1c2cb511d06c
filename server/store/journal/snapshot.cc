#include "server/store/journal/snapshot.h"

#include <memory>
#include <utility>

#include "server/store/journal/crc32c.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::journal {
namespace {

// The portions of a snapshot's file, one after the other.
class Portions {
 public:
  Portions(const Folder& folder, const std::string& name) : folder_(folder), name_(name) {}

  // Empty at the end, and after an error.
  std::string_view Next() {
    if (ended_) {
      return {};
    }
    const Result<std::string> header = folder_.Read(name_, at_, kPortionHeaderBytes);
    if (!header.ok()) {
      return Fail(header.error());
    }
    ByteReader reader(header.value());
    const uint32_t length = reader.U32();
    const uint32_t checksum = reader.U32();
    if (!reader.ok() || length > 2 * ByteWriter::kPortionBytes) {
      return Fail(reader.ok() ? "invalid block length" : "is cut off");
    }
    Result<std::string> bytes = folder_.Read(name_, at_ + kPortionHeaderBytes, length);
    if (!bytes.ok()) {
      return Fail(bytes.error());
    }
    portion_ = std::move(bytes).value();
    ByteWriter number;
    number.U32(number_++);
    if (portion_.size() < length || Crc32c(portion_, Crc32c(number.bytes())) != checksum) {
      return Fail(portion_.size() < length ? "is cut off" : "block checksum mismatch");
    }
    at_ += kPortionHeaderBytes + length;
    ended_ = length == 0;
    return portion_;
  }

  // Whether the last portion was read, and nothing follows.
  Status AtEnd() {
    while (!ended_) {
      Next();
    }
    const Result<std::string> more = folder_.Read(name_, at_, 1);
    if (error_.empty() && more.ok() && !more.value().empty()) {
      Fail("has extra bytes at the end");
    }
    return error_.empty() ? Ok() : Status(Error{error_});
  }

  uint64_t at() const { return at_; }

 private:
  std::string_view Fail(const std::string& what) {
    error_ = what;
    ended_ = true;
    return {};
  }

  const Folder& folder_;
  const std::string& name_;
  uint64_t at_ = kSnapshotHeaderBytes;
  uint32_t number_ = 0;
  std::string portion_;
  std::string error_;
  bool ended_ = false;
};

}  // namespace

Status WriteSnapshot(const engine::Engine& engine, const engine::Stamp& stamp, Folder* folder) {
  PHEROMONE_TRY(std::unique_ptr<SnapshotWriter> begun,
                SnapshotWriter::Begin({engine.sequence(), stamp, engine.StateHash()}, folder));
  SnapshotWriter& file = *begun;
  Status status = Ok();
  ByteWriter writer([&](std::string_view portion) {
    if (status.ok()) {
      status = file.Append(portion);
    }
  });
  engine.Save(&writer);
  writer.Flush();
  if (status.ok()) {
    status = file.End();
  }
  return status.ok() ? file.GiveName() : status;
}

Result<Snapshot> ReadSnapshot(const Folder& folder, const std::string& name, uint64_t* byte,
                              const std::function<void(uint64_t)>& read) {
  *byte = 0;
  PHEROMONE_TRY(const std::string head, folder.Read(name, 0, kSnapshotHeaderBytes));
  const Result<SnapshotHeader> header = DecodeSnapshotHeader(head);
  if (!header.ok()) {
    return header.error();
  }
  Portions portions(folder, name);
  ByteReader reader([&] {
    const uint64_t before = portions.at();
    const std::string_view portion = portions.Next();
    if (read) {
      read(portions.at() - before);
    }
    return portion;
  });
  Result<engine::Engine> engine = engine::Engine::Restore(&reader);
  reader.ExpectEnd();
  const Status ended = portions.AtEnd();
  *byte = portions.at();
  if (!ended.ok()) {
    return ended.error();
  }
  if (!engine.ok() || !reader.ok()) {
    return Error{engine.ok() ? reader.error() : engine.error()};
  }
  if (engine.value().sequence() != header.value().sequence ||
      engine.value().StateHash() != header.value().state_hash) {
    return Error{"state hash does not match the header"};
  }
  return Snapshot{std::move(engine).value(), header.value().stamp};
}

}  // namespace pheromone::journal
