// Lets a recording observe the traffic of a link: the bytes that are read and written, and the
// messages that are never written. Without a tap it costs nothing.
//
//   const Tap::Reading reading(tap);          // ends with its scope
//   if (tap != nullptr) tap->Read(&line, bytes, now_ms, decoder);
//
// The functions for one line are called on its strand; those for different lines run concurrently.
#pragma once

#include <cstdint>
#include <span>

#include "protocol/decoder.h"
#include "server/core/engine/event.h"

namespace pheromone::links {

/// A session as seen by a tap.
struct Connection {
  engine::LinkIndex link = 0;
  uint32_t connection = 0;  ///< counts from 1 on each link
  uint64_t mark = 0;        ///< for the use of the tap
};

class Tap {
 public:
  Tap() = default;
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;
  virtual ~Tap() = default;

  /// These enclose, on one thread, the bytes of one read and their processing, up to and including
  /// the engine. Not nested.
  virtual void BeginRead() = 0;
  virtual void EndRead() = 0;

  /// Bytes were read and are about to be pushed into `decoder` at its time `now_ms`. Called once in
  /// each read; with datagrams, once for each datagram.
  virtual void Read(Connection* line, std::span<const uint8_t> bytes, uint32_t now_ms,
                    const protocol::FrameDecoder& decoder) = 0;

  /// Complete frames were written. Of a transmission that was cut off, what is not a whole frame is
  /// not told.
  virtual void Wrote(const Connection& line, std::span<const uint8_t> bytes) = 0;

  /// A message for this link will never be written.
  virtual void Dropped(engine::LinkIndex link, const protocol::Message& message) = 0;

  /// A message is rejected by the link and not passed to the engine. `answer`: the reason of the
  /// ERROR sent by the link; kNone: none is sent. Called during a read, before the other messages
  /// go to the engine.
  virtual void Rejected(engine::LinkIndex link, const protocol::Message& message,
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

/// A line with its tap, if any.
struct TappedLine {
  Tap* tap = nullptr;  ///< outlives the line
  Connection line;
};

}  // namespace pheromone::links
