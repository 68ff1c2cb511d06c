#include "client_fw/core/pioneer/pioneer_packet.h"

#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kFirst = 0xFA;
constexpr uint8_t kSecond = 0xFB;
constexpr uint8_t kNotNegative = 0x3B;
constexpr uint8_t kNegative = 0x1B;
constexpr uint8_t kMaxWheelUnits = 127;

PHEROMONE_OUTLINED uint16_t Magnitude(int16_t value) {
  const uint16_t bits = static_cast<uint16_t>(value);
  return value < 0 ? static_cast<uint16_t>(0u - bits) : bits;
}

uint16_t HighByte(uint8_t byte) {
  return static_cast<uint16_t>(static_cast<uint16_t>(byte) << 8);
}

void Begin(PioneerCommand command, uint8_t count, uint8_t* packet) {
  packet[0] = kFirst;
  packet[1] = kSecond;
  packet[2] = count;
  packet[3] = static_cast<uint8_t>(command);
}

// One byte of the argument of VEL2.
uint8_t WheelByte(int16_t mm_s) {
  const uint16_t rounded = static_cast<uint16_t>(Magnitude(mm_s) + kWheelUnitMmS / 2u);
  const uint16_t units = rounded / kWheelUnitMmS;
  const uint8_t size = units > kMaxWheelUnits ? kMaxWheelUnits : static_cast<uint8_t>(units);
  return static_cast<uint8_t>(mm_s < 0 ? 0u - size : size);
}

}  // namespace

uint8_t EncodeCommand(PioneerCommand command, uint8_t* packet) {
  Begin(command, 3, packet);
  packet[4] = 0;  // the command is a byte left over
  packet[5] = packet[3];
  return 6;
}

uint8_t EncodeCommand(PioneerCommand command, int16_t argument, uint8_t* packet) {
  Begin(command, 6, packet);
  packet[4] = argument < 0 ? kNegative : kNotNegative;
  protocol::PutU16(packet + 5, Magnitude(argument));
  const uint16_t sum =
      static_cast<uint16_t>(HighByte(packet[3]) + HighByte(packet[5]) + packet[4] + packet[6]);
  packet[7] = static_cast<uint8_t>(sum >> 8);
  packet[8] = static_cast<uint8_t>(sum & 0xFFu);
  return 9;
}

int16_t WheelWord(int16_t left_mm_s, int16_t right_mm_s) {
  const uint8_t bytes[2] = {WheelByte(right_mm_s), WheelByte(left_mm_s)};
  return protocol::GetI16(bytes);
}

PHEROMONE_BY_POINTER bool PioneerReceiver::Push(uint8_t byte, uint16_t now_ms) {
  if (static_cast<uint16_t>(now_ms - last_byte_ms_) > kPacketGapMs) {
    header_ = 0;
    left_ = 0;
  }
  last_byte_ms_ = now_ms;
  if (left_ == 0) {
    PushHeader(byte);
    return false;
  }
  --left_;
  if (left_ == 0) {
    return sum_ == byte;
  }
  if (left_ == 1) {
    sum_ = static_cast<uint16_t>(sum_ - HighByte(byte));
    return false;
  }
  const uint8_t at = static_cast<uint8_t>(length_ - 1 - left_);
  if (at < 7) {
    kept_[at] = byte;
  } else if (at >= 11 && at < 17) {
    kept_[at - 4] = byte;
  } else if (at == 19) {
    readings_ = byte;
  } else if (at > 19 && readings_ != 0) {
    PushSonar(byte);
  }
  if ((at & 1u) != 0) {
    sum_ = static_cast<uint16_t>(sum_ + byte);
  } else if (left_ == 2) {  // left over
    sum_ = static_cast<uint16_t>(sum_ ^ byte);
  } else {
    sum_ = static_cast<uint16_t>(sum_ + HighByte(byte));
  }
  if (byte == 0) {
    ++strings_;
  } else if (strings_ == 2) {
    subclass_end_ = static_cast<uint16_t>((subclass_end_ & 0xFFu) << 8 | byte | 0x20u);
  }
  return false;
}

// Number, range low, range high.
void PioneerReceiver::PushSonar(uint8_t byte) {
  if (reading_at_ == 0) {
    reading_number_ = static_cast<uint8_t>(byte - kFirstFrontSonar);
  } else if (reading_at_ == 1) {
    reading_low_ = byte;
  } else {
    const uint16_t range = static_cast<uint16_t>(HighByte(byte) | reading_low_);
    if (reading_number_ < kFrontSonars && range < front_) {
      front_ = range;
    }
    --readings_;
  }
  reading_at_ = static_cast<uint8_t>(reading_at_ == 2 ? 0 : reading_at_ + 1);
}

PHEROMONE_BY_POINTER void PioneerReceiver::PushHeader(uint8_t byte) {
  if (header_ == 2) {
    header_ = 0;
    if (byte >= 3) {  // a type and a checksum at the least
      length_ = byte;
      left_ = byte;
      strings_ = 0;
      sum_ = 0;
      subclass_end_ = 0;
      readings_ = 0;
      reading_at_ = 0;
      front_ = kNoRange;
    }
  } else if (header_ == 1 && byte == kSecond) {
    header_ = 2;
  } else {
    header_ = byte == kFirst ? 1 : 0;
  }
}

}  // namespace client
}  // namespace pheromone
