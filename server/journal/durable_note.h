// The file `durable` beside the log: up to which sequence the disk had it, as noted now and then.
// It shows that a segment is missing, or was cut off between two records, where the segments that
// are there look complete.
//
//   std::optional<DurableNote> note = ReadDurableNote(folder);
//   if (note && note->sequence > last_that_was_found) ...     // changes are missing
//
// It is written after the events are on the disk, so it never says too much; it may be a second
// behind. Two places of 512 bytes are written in turn, so that a torn write leaves the other one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/journal/folder.h"

namespace pheromone::journal {

constexpr std::string_view kDurableName = "durable";
constexpr size_t kNoteBytes = 512;

struct DurableNote {
  uint64_t count = 0;     ///< of the notes written, to tell the newer one
  uint64_t sequence = 0;  ///< all up to here was on the disk
  int64_t utc_ms = 0;     ///< of that event
  bool operator==(const DurableNote&) const = default;
};

/// kNoteBytes; its place in the file is NotePlace.
std::string EncodeNote(const DurableNote& note);
constexpr uint64_t NotePlace(const DurableNote& note) {
  return note.count % 2 * kNoteBytes;
}

/// The newest that is whole; nothing if there is none, or no such file.
std::optional<DurableNote> ReadDurableNote(const Folder& folder);

/// "2026-11-22T11:00:00Z".
std::string InUtc(int64_t utc_ms);

}  // namespace pheromone::journal
