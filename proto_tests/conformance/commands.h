// The protocol between the test on the host and the image on the microcontroller.
//
//   request:  size (u16)  command (u8)  payload     size counts the command and the payload
//   reply:    size (u16)  status (u8)   payload     size counts the status and the payload
//
// One reply per request, in order; after power-up the image sends one empty reply without a
// request. Integers are little-endian. Everything is tested through these few commands, so that the
// vectors stay files on the host: the image contains none of them. C++14 without its library: both
// sides include this.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace conformance {

constexpr uint16_t kMaxRequest = 1024;
constexpr uint16_t kMaxReply = 2560;

enum Command : uint8_t {
  /// -> sizeof(int), sizeof(void*): u8 each.
  kIdentify = 'I',
  /// Bytes -> Crc16 of them, u16.
  kCrc = 'C',
  /// Capacity (u16, at most kMaxFrame), ID, OPCODE, length, at most kMaxData bytes
  /// -> what EncodeFrame wrote; nothing if it refused.
  kEncodeFrame = 'E',
  /// Gap timeout (u16), time of power-up (u32), then for each byte a pause in ms (u8) and the byte
  /// -> the number of frames (u8), each as ID, OPCODE, length and data; the nine DecoderCounters in
  /// their order (u32); frame_open (u8).
  kDecodeStream = 'D',
  /// -> for each opcode: known, least, most; then for each code CommandArgumentLength. All u8.
  kLengths = 'L',
  /// ID, OPCODE, data -> for each message as which Decode takes it: its number in ForEachMessage
  /// (u8), its fields as ForEachField lists them (i32), Encode's success (u8), and the message that
  /// Encode makes of it: length (u8), ID, OPCODE, data.
  kDecodeMessage = 'M',
  /// Any number of: law (u8), left, right, K (i16), gain (u8) -> left and right wheel (i16) of
  /// each.
  kSteer = 'S',
  /// Any number of: FuzzyState, left, right, K (i16) -> SteerFuzzy's left and right wheel, and the
  /// FuzzyState after it (i16), of each; with kTunedFuzzy.
  kFuzzy = 'F',
  /// Any number of: CarefulState as plateau (i16), course, turn (u16), mode, aside, stronger, clear
  /// (u8);
  /// left, right (i16), heading (u16), K (i16) -> after Notice, SteerCareful's left and right
  /// wheel,
  /// Search's left and right wheel (i16), and the CarefulState, of each.
  kCareful = 'B',
  /// Number of transitions (u8, at most kMaxNetTransitions), each as takes, gives, inhibited_by
  /// (u32);
  /// marking (u32); then any number of transitions (u8) to fire one after the other -> Firing (u8)
  /// of each and, if it was fired, the marking after it (u32).
  kFireNet = 'N',
  /// Any number of angles (u16) -> SinQ14 and CosQ14 (i16) of each.
  kSine = 'A',
  /// Any number of: start, odometry, each as x, y (i32), heading (u16) -> StartPose::Place of each.
  kPlace = 'P',
  /// Any number of: mm (i32), unit (u16) -> success (u8) and units (i32, 0 without success) of
  /// each.
  kToPoseUnits = 'U',
};

enum Status : uint8_t {
  kDone = 'K',
  kRefused = '?',  ///< no such command, or a payload that is not as described: the test is wrong
};

}  // namespace conformance
}  // namespace pheromone
