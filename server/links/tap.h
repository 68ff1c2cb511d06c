// Where a link shows what passes: the bytes as they are read and written, and what is never
// written. For recordings; without a tap it costs nothing.
//
//   const Tap::Reading reading(tap);          // ends with its scope
//   if (tap != nullptr) tap->Read(&line, bytes, now_ms, decoder);
//
// Functions of one line are called on its strand; those of different lines at the same time.
#pragma once

#include <cstdint>
#include <span>

#include "protocol/decoder.h"
#include "server/engine/event.h"

namespace pheromone::links {

/// A conversation, as a tap knows it.
struct Line {
  engine::LinkIndex link = 0;
  uint32_t connection = 0;  ///< counts from 1 on each link
  uint64_t mark = 0;        ///< the tap's own
};

class Tap {
 public:
  Tap() = default;
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;
  virtual ~Tap() = default;

  /// Between these, on one thread, is what is read at once, and all that comes of it up to what the
  /// engine does. Not nested.
  virtual void BeginRead() = 0;
  virtual void EndRead() = 0;

  /// Bytes were read and are about to be pushed into `decoder` at its time `now_ms`. Once in a
  /// read; of datagrams, once for each.
  virtual void Read(Line* line, std::span<const uint8_t> bytes, uint32_t now_ms,
                    const protocol::FrameDecoder& decoder) = 0;

  /// Whole frames are about to be written.
  virtual void Wrote(const Line& line, std::span<const uint8_t> bytes) = 0;

  /// A message for this link will never be written.
  virtual void LeftOut(engine::LinkIndex link, const protocol::Message& message) = 0;

  /// A message is not handed to the engine. `answer`: the reason of the ERROR that the link gives
  /// by itself; kNone: it gives none. During a read, before what is left of it goes to the engine.
  virtual void TurnedAway(engine::LinkIndex link, const protocol::Message& message,
                          protocol::Reason answer) = 0;

  /// BeginRead and EndRead, unless there is no tap.
  class Reading {
   public:
    explicit Reading(Tap* tap) : tap_(tap) {
      if (tap_ != nullptr) {
        tap_->BeginRead();
      }
    }
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;
    ~Reading() {
      if (tap_ != nullptr) {
        tap_->EndRead();
      }
    }

   private:
    Tap* const tap_;
  };
};

/// A line with its tap, if it has one.
struct TappedLine {
  Tap* tap = nullptr;  ///< outlives the line
  Line line;
};

}  // namespace pheromone::links
