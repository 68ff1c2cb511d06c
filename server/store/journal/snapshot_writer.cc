#include "server/store/journal/snapshot_writer.h"

#include <utility>

#include "server/base/bytes.h"

namespace pheromone::journal {
namespace {

// Syncing a whole snapshot at once would delay the log's syncs on the same disk.
constexpr uint64_t kSyncBytes = uint64_t{1} << 20;

}  // namespace

CopiedState::CopiedState(const engine::Engine& engine, const engine::Stamp& stamp)
    : header_{engine.sequence(), stamp, engine.StateHash()} {
  ByteWriter writer;
  engine.Save(&writer);
  bytes_ = writer.Take();
}

Result<std::string> CopiedState::Next() {
  return std::exchange(bytes_, {});
}

SnapshotWriter::SnapshotWriter(uint64_t sequence, Folder* folder)
    : folder_(folder),
      sequence_(sequence),
      name_(SnapshotName(sequence)),
      unfinished_(name_ + std::string(kUnfinished)) {}

SnapshotWriter::~SnapshotWriter() {
  file_.reset();
  if (is_there_) {
    (void)folder_->Remove(unfinished_);
  }
}

Result<std::unique_ptr<SnapshotWriter>> SnapshotWriter::Begin(const SnapshotHeader& header,
                                                              Folder* folder) {
  std::unique_ptr<SnapshotWriter> writer(new SnapshotWriter(header.sequence, folder));
  (void)folder->Remove(writer->unfinished_);  // possibly left by an earlier attempt
  PHEROMONE_TRY(std::unique_ptr<AppendFile> file, folder->Create(writer->unfinished_));
  writer->is_there_ = true;
  writer->file_ = std::move(file);
  PHEROMONE_TRY_STATUS(writer->file_->Append(EncodeHeader(header)));
  return writer;
}

Status SnapshotWriter::Append(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::string_view portion = bytes.substr(0, ByteWriter::kPortionBytes);
    bytes.remove_prefix(portion.size());
    std::string record;
    AppendPortion(portions_++, portion, &record);
    Status status = file_->Append(record);
    unsynced_bytes_ += record.size();
    if (status.ok() && unsynced_bytes_ >= kSyncBytes) {
      unsynced_bytes_ = 0;
      status = file_->Sync();
    }
    if (!status.ok()) {
      return status;
    }
  }
  return Ok();
}

Status SnapshotWriter::End() {
  std::string last;
  AppendPortion(portions_++, {}, &last);
  Status status = file_->Append(last);
  if (status.ok()) {
    status = file_->Sync();
  }
  file_.reset();
  return status;
}

Result<std::unique_ptr<SnapshotWriter>> SnapshotWriter::Write(StateSource* source, Folder* folder) {
  Result<std::unique_ptr<SnapshotWriter>> begun = Begin(source->header(), folder);
  if (!begun.ok()) {
    return begun;
  }
  SnapshotWriter& writer = *begun.value();
  for (;;) {
    PHEROMONE_TRY(const std::string portion, source->Next());
    PHEROMONE_TRY_STATUS(portion.empty() ? writer.End() : writer.Append(portion));
    if (portion.empty()) {
      return begun;
    }
  }
}

Status SnapshotWriter::GiveName() {
  PHEROMONE_TRY_STATUS(folder_->Rename(unfinished_, name_));
  is_there_ = false;
  return folder_->Sync();
}

}  // namespace pheromone::journal
