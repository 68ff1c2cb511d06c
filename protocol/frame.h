// The frame: what travels between DLE STX and DLE ETX, and how a message becomes one.
//
//   DLE STX | CLIENT_ID | OPCODE | DATA ... | CRC low | CRC high | DLE ETX
//
// Every 0x10 between the delimiters is sent twice (Susnea et al. 2009, "Notes on the Communication
// Protocol"). Freestanding C++11: the same source serves the server and the robots.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace pheromone {
namespace protocol {

constexpr uint8_t kDle = 0x10;
constexpr uint8_t kStx = 0x02;
constexpr uint8_t kEtx = 0x03;

/// DATA holds at most this many bytes.
constexpr uint8_t kMaxData = 64;
/// ID, OPCODE, DATA and CRC, before stuffing.
constexpr uint8_t kMaxBody = kMaxData + 4;
/// The longest frame on the wire: delimiters and a body of nothing but DLE.
constexpr uint8_t kMaxFrame = 4 + 2 * kMaxBody;

/// The client ID of messages to all robots; never a robot's own.
constexpr uint8_t kBroadcastId = 0xFF;
/// An inter-byte gap on a link without gaps: never times out.
constexpr uint16_t kNoGapTimeout = 0;

/// ID, OPCODE and DATA, unstuffed and without CRC: what a frame says.
struct Message {
  uint8_t id = 0;
  uint8_t opcode = 0;
  uint8_t length = 0;  ///< bytes of `data` in use, at most kMaxData
  uint8_t data[kMaxData] = {};
};

/// The CRC over ID, OPCODE and DATA, as sent in the frame.
uint16_t MessageCrc(const Message& message);

/// Writes a frame byte by byte: stuffs, and adds delimiters and CRC.
///
///   FrameWriter writer(wire);
///   writer.Put(id); writer.Put(opcode); ... writer.Put(last byte of DATA);
///   size = writer.Finish() - wire;
///
/// `wire` must have room for 8 bytes and two for each Put.
class FrameWriter {
 public:
  explicit FrameWriter(uint8_t* wire);

  void Put(uint8_t byte);
  /// CRC and end; returns where the frame ends. Nothing may follow.
  uint8_t* Finish();

 private:
  uint8_t* at_;
  uint16_t crc_ = 0;
};

/// Writes the whole frame of `message` to `wire`, which has room for `capacity` bytes (kMaxFrame is
/// always enough). Returns the number of bytes written, or 0 if they do not fit or `length` is over
/// kMaxData; then the contents of `wire` are unspecified.
size_t EncodeFrame(const Message& message, uint8_t* wire, size_t capacity);

}  // namespace protocol
}  // namespace pheromone
