#include "protocol/frame_parser.h"

#include "protocol/crc16.h"

namespace pheromone {
namespace protocol {

FrameParser::Result FrameParser::Push(uint8_t byte) {
  if (!escaped_) {
    if (byte == kDle) {
      escaped_ = true;
      return kNothing;
    }
    return open_ ? Take(byte) : kIgnored;
  }
  if (!open_ && byte == kDle) {
    return kIgnored;  // no stuffing out here: this DLE may begin a frame just as well
  }
  escaped_ = false;
  const bool was_open = open_;
  open_ = false;
  if (byte == kStx) {
    open_ = true;
    size_ = 0;
    return was_open ? kRestart : kNothing;
  }
  if (!was_open) {
    return kIgnoredPair;
  }
  if (byte == kDle) {
    open_ = true;
    return Take(byte);
  }
  return byte == kEtx ? Judge() : kBadEscape;
}

FrameParser::Result FrameParser::Take(uint8_t byte) {
  if (size_ == kMaxBody) {
    open_ = false;
    return kOversize;
  }
  body_[size_++] = byte;
  return kNothing;
}

FrameParser::Result FrameParser::Judge() const {
  if (size_ < 4) {
    return kRunt;
  }
  if (Crc16(body_, size_) != 0) {
    return kCrcError;
  }
  return body_[0] == 0 || body_[1] == 0 ? kRefused : kFrame;
}

}  // namespace protocol
}  // namespace pheromone
