#include "server/cluster/state_receiver.h"

#include <utility>

#include "server/store/journal/format.h"
#include "server/store/journal/snapshot.h"
#include "server/store/journal/snapshot_writer.h"

namespace pheromone::cluster {

using journal::SnapshotWriter;

// Used aside while something is written, and then on the executor.
struct StateReceiver::File {
  journal::Folder* const folder;
  const std::function<void()> end_snapshots;
  const uint64_t least;
  std::unique_ptr<SnapshotWriter> writer{};  // null: the header is not whole
  std::string head{};
  uint64_t sequence = 0;

  Status Write(std::string_view bytes) {
    if (writer == nullptr) {
      head += bytes;
      if (head.size() < journal::kSnapshotHeaderBytes) {
        return Ok();
      }
      PHEROMONE_TRY(const journal::SnapshotHeader header, journal::DecodeSnapshotHeader(head));
      sequence = header.sequence;
      if (sequence < least) {
        return Error{"its state is that after event " + std::to_string(sequence) +
                     ", expected one after event " + std::to_string(least) + " or later"};
      }
      end_snapshots();
      PHEROMONE_TRY(writer, SnapshotWriter::Begin(header, folder));
      bytes = std::string_view(head).substr(journal::kSnapshotHeaderBytes);
    }
    return writer->Append(bytes);
  }

  Status End() {
    if (writer == nullptr) {
      return Error{"its state ends before it begins"};
    }
    PHEROMONE_TRY_STATUS(writer->End());
    uint64_t byte = 0;
    const std::string unfinished = writer->name() + std::string(journal::kUnfinished);
    const Result<journal::Snapshot> read = journal::ReadSnapshot(*folder, unfinished, &byte);
    if (!read.ok()) {
      return Error{"its state, as it came here: byte " + std::to_string(byte) + ": " +
                   read.error()};
    }
    return writer->GiveName();
  }
};

void StateReceiver::Begin(const std::string& from, uint64_t least, uint64_t now_ms) {
  ++number_;
  from_ = from;
  offset_ = 0;
  file_ = std::make_shared<File>(File{parts_.folder, parts_.end_snapshots, least});
  Ask(now_ms);
}

void StateReceiver::Ask(uint64_t now_ms) {
  waits_ = true;
  asked_ms_ = now_ms;
  parts_.send(from_, {number_, offset_});
}

void StateReceiver::OnPortion(const std::string& from, const StatePortion& portion,
                              uint64_t now_ms) {
  if (from != from_ || portion.number != number_ || !waits_ || portion.offset != offset_) {
    return;  // of an earlier transfer
  }
  if (!portion.error.empty()) {
    Fail(portion.error);
    return;
  }
  waits_ = false;
  now_ms_ = now_ms;
  offset_ += portion.bytes.size();
  const auto status = std::make_shared<Status>(Ok());
  parts_.aside(
      [file = file_, status, portion] {
        *status = file->Write(portion.bytes);
        if (status->ok() && portion.is_last) {
          *status = file->End();
        }
      },
      [this, file = file_, status, is_last = portion.is_last] {
        if (file != file_) {
          return;
        }
        if (!status->ok()) {
          Fail(status->error());
        } else if (is_last) {
          from_.clear();
          file_.reset();
          parts_.done(file->sequence);
        } else {
          Ask(now_ms_);
        }
      });
}

void StateReceiver::Continue(uint64_t now_ms) {
  now_ms_ = now_ms;
  if (is_busy() && waits_ && now_ms - asked_ms_ >= kPatienceMs) {
    Fail("no answer for " + std::to_string(kPatienceMs / 1000) + " s");
  }
}

void StateReceiver::OnDown(const std::string& node) {
  if (node == from_) {
    Fail("the connection ended");
  }
}

void StateReceiver::Stop() {
  from_.clear();
  file_.reset();
}

void StateReceiver::Fail(const std::string& why) {
  const std::string from = std::exchange(from_, "");
  file_.reset();
  parts_.done(Error{"node " + from + ": " + why});
}

}  // namespace pheromone::cluster
