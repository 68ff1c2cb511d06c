// A robot's whole core, client_fw/core, with its inputs and outputs encoded as bytes: the inputs of
// one turn of the main loop go in, its outputs come out. Compiled for the host and for the AVR, so
// that the two can be compared turn by turn.
//
//   CoreTurn core;
//   const uint16_t size = core.Run(request, request_size, reply);
//
// A request, integers little-endian:
//   'S'  start: keep RequestMemory u8, id u8, boot counter u16, wide u8, start x, y i32,
//        heading u16, then pairs of setting id u8 and value u16
//   'T'  turn: time in ms u32, kIdle and kCarrier u8, bytes from the radio and bytes from the
//        Pioneer, each as length u8 and bytes
// The reply to a start is empty, and that to a turn:
//   bytes to the radio, bytes to the Pioneer, settings to be saved (kMaxBytes at most, each as
//   length u8 and bytes), wheel speeds i16, i16, StopFlags u8, load u8, intensities i16, i16
// The reply to a malformed request is the single byte '?'.
#pragma once

#include <stdint.h>

#include "client_fw/core/pioneer/pioneer_drive.h"
#include "client_fw/core/robot.h"
#include "protocol/byte_order.h"

namespace pheromone {
namespace core_boundary {

constexpr uint8_t kStart = 'S';
constexpr uint8_t kTurn = 'T';
constexpr uint8_t kRefused = '?';

enum TurnFlag : uint8_t {
  kIdle = 1,     ///< everything given to the radio has left
  kCarrier = 2,  ///< the radio hears a carrier
};

constexpr uint8_t kMaxBytes = 128;
constexpr uint16_t kMaxRequest = 2 * (kMaxBytes + 1) + 6;
constexpr uint16_t kMaxReply = 3 * (kMaxBytes + 1) + 10;

/// Bytes of one kind in one turn.
class Bytes {
 public:
  bool Put(uint8_t byte) {
    if (size_ == kMaxBytes) {
      return false;
    }
    bytes_[size_++] = byte;
    return true;
  }
  int Get() { return taken_ < size_ ? bytes_[taken_++] : -1; }
  void Clear() { size_ = taken_ = 0; }
  uint8_t size() const { return size_; }
  const uint8_t* data() const { return bytes_; }

 private:
  uint8_t size_ = 0;
  uint8_t taken_ = 0;
  uint8_t bytes_[kMaxBytes];
};

/// The Board of robot.h and pioneer_drive.h.
struct TurnBoard {
  int radio_get() { return from_radio.Get(); }
  bool radio_put(uint8_t byte) { return to_radio.Put(byte); }
  bool radio_tx_idle() const { return (flags & kIdle) != 0 && to_radio.size() == 0; }
  bool channel_busy() const { return (flags & kCarrier) != 0 || !radio_tx_idle(); }
  int robot_get() { return from_robot.Get(); }
  bool robot_put(uint8_t byte) { return to_robot.Put(byte); }
  static void set_robot_rate(uint8_t /*number*/) {}
  client::Moment millis() const { return static_cast<client::Moment>(now_ms); }
  void set_load(bool hold) { load = hold; }
  static void set_led(bool /*on*/) {}
  static uint16_t diagnostic(uint8_t id) { return id; }
  void save_settings(const uint8_t* from, uint8_t size) {
    saved.Clear();
    for (uint8_t i = 0; i < size; ++i) {
      saved.Put(from[i]);
    }
  }

  uint32_t now_ms = 0;
  uint8_t flags = kIdle;
  bool load = false;
  Bytes from_radio;
  Bytes to_radio;
  Bytes from_robot;
  Bytes to_robot;
  Bytes saved;
};

class CoreTurn {
 public:
  CoreTurn();
  CoreTurn(const CoreTurn&) = delete;
  CoreTurn& operator=(const CoreTurn&) = delete;

  /// `reply` has room for kMaxReply bytes. Returns the size of the reply.
  uint16_t Run(const uint8_t* request, uint16_t size, uint8_t* reply);

  const client::Conversation& conversation() const { return robot_.conversation(); }

 private:
  using Drive = client::PioneerDrive<TurnBoard>;

  bool Start(const uint8_t* from, uint16_t size);
  bool Turn(const uint8_t* from, uint16_t size);
  uint16_t Tell(uint8_t* reply) const;

  TurnBoard board_;
  client::RequestMemory memory_;
  client::Parameters parameters_;
  Drive drive_;
  client::Robot<TurnBoard, Drive> robot_;
};

}  // namespace core_boundary
}  // namespace pheromone
