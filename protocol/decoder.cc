#include "protocol/decoder.h"

#include "protocol/crc16.h"

namespace pheromone {
namespace protocol {

void FrameDecoder::Expire(uint32_t now_ms) {
  if (state_ == State::kIdle || gap_timeout_ms_ == kNoGapTimeout) {
    return;
  }
  const uint32_t gap_ms = now_ms - last_byte_ms_;
  if (gap_ms <= gap_timeout_ms_) {
    return;
  }
  if (frame_open()) {
    Discard(&counters_.timeouts);
  } else {
    ++counters_.ignored_bytes;  // a lone DLE
    state_ = State::kIdle;
  }
}

bool FrameDecoder::Push(uint8_t byte, uint32_t now_ms) {
  Expire(now_ms);
  last_byte_ms_ = now_ms;
  switch (state_) {
    case State::kIdle:
      if (byte == kDle) {
        state_ = State::kIdleDle;
      } else {
        ++counters_.ignored_bytes;
      }
      return false;
    case State::kIdleDle:
      if (byte == kStx) {
        Start();
      } else if (byte == kDle) {
        // Outside of a frame there is no stuffing: this DLE may begin a frame just as well.
        ++counters_.ignored_bytes;
      } else {
        counters_.ignored_bytes += 2;
        state_ = State::kIdle;
      }
      return false;
    case State::kBody:
      if (byte == kDle) {
        state_ = State::kBodyDle;
      } else {
        Append(byte);
      }
      return false;
    case State::kBodyDle:
      if (byte == kDle) {
        state_ = State::kBody;
        Append(byte);
      } else if (byte == kStx) {
        ++counters_.restarts;
        Start();
      } else if (byte == kEtx) {
        return Finish();
      } else {
        Discard(&counters_.bad_escapes);
      }
      return false;
  }
  return false;
}

void FrameDecoder::Start() {
  state_ = State::kBody;
  size_ = 0;
  crc_ = 0;
}

// Keeps the last two bytes aside, because only the end of the frame tells that they were the CRC.
void FrameDecoder::Append(uint8_t byte) {
  if (size_ == kMaxBody) {
    Discard(&counters_.oversize);
    return;
  }
  if (size_ >= 2) {
    const uint8_t settled = crc_bytes_[0];
    if (size_ == 2) {
      message_.id = settled;
    } else if (size_ == 3) {
      message_.opcode = settled;
    } else {
      message_.data[size_ - 4] = settled;
    }
  }
  crc_bytes_[0] = crc_bytes_[1];
  crc_bytes_[1] = byte;
  crc_ = Crc16Update(crc_, byte);
  ++size_;
}

bool FrameDecoder::Finish() {
  if (size_ < 4) {
    Discard(&counters_.runts);
    return false;
  }
  if (crc_ != 0) {
    Discard(&counters_.crc_errors);
    return false;
  }
  if (message_.id == 0 || message_.opcode == 0) {
    Discard(&counters_.refused);
    return false;
  }
  message_.length = static_cast<uint8_t>(size_ - 4);
  state_ = State::kIdle;
  ++counters_.frames;
  return true;
}

void FrameDecoder::Discard(uint32_t* counter) {
  ++*counter;
  state_ = State::kIdle;
}

}  // namespace protocol
}  // namespace pheromone
