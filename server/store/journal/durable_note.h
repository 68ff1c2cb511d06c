// The durability mark, in the file `durable` beside the log: a periodically updated sequence number
// up to which the log is durable. It detects a missing segment, or one truncated between two
// records, although the remaining segments look complete.
//
//   std::optional<DurableNote> note = ReadDurableNote(folder);
//   if (note && note->sequence > last_that_was_found) ...     // changes are missing
//
// It is written after the events are durable, so it never claims too much; it may lag by one
// second. Two slots of 512 bytes are written alternately, so that a torn write leaves the other one
// intact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/store/journal/folder.h"

namespace pheromone::journal {

constexpr std::string_view kDurableName = "durable";
constexpr size_t kNoteBytes = 512;

struct DurableNote {
  uint64_t count = 0;     ///< the number of marks written, which identifies the newer slot
  uint64_t sequence = 0;  ///< everything up to here was durable
  int64_t utc_ms = 0;     ///< of that event
  bool operator==(const DurableNote&) const = default;
};

/// kNoteBytes; its place in the file is NotePlace.
std::string EncodeNote(const DurableNote& note);
constexpr uint64_t NotePlace(const DurableNote& note) {
  return note.count % 2 * kNoteBytes;
}

/// The newest valid mark; empty if there is none, or no such file.
std::optional<DurableNote> ReadDurableNote(const Folder& folder);

}  // namespace pheromone::journal
