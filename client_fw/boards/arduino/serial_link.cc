#include "client_fw/boards/arduino/serial_link.h"

namespace pheromone {
namespace arduino {

void PheromoneSerial::begin(client::Parameters* parameters) {
  parameters->baud = baud_;
  room_ = stream_->availableForWrite();
  if (key_pin_ >= 0) {
    Key(false);
    pinMode(static_cast<uint8_t>(key_pin_), OUTPUT);
  }
}

void PheromoneSerial::set_keying(uint16_t lead_ms, uint16_t tail_ms) {
  const bool keyed = key_pin_ >= 0;
  lead_ms_ = keyed ? lead_ms : uint16_t{0};
  // A millisecond more: the ring was seen empty somewhere within one.
  end_ms_ = static_cast<uint16_t>(client::BytesMs(2, baud_) + 1u + (keyed ? tail_ms : 0u));
}

bool PheromoneSerial::put(uint8_t byte) {
  if (state_ == kSilent || state_ == kEnding) {
    Key(true);
    Enter(kLead);
  }
  if (state_ == kLead) {
    if (Passed() < lead_ms_) {
      return false;
    }
    state_ = kSending;
  }
  return stream_->availableForWrite() > 0 && stream_->write(byte) == 1;
}

bool PheromoneSerial::busy() {
  if (state_ == kSending && stream_->availableForWrite() >= room_) {
    Enter(kEnding);
  }
  if (state_ == kEnding && Passed() >= end_ms_) {
    state_ = kSilent;
    Key(false);
  }
  return state_ != kSilent;
}

void PheromoneSerial::Key(bool on) {
  if (key_pin_ >= 0) {
    digitalWrite(static_cast<uint8_t>(key_pin_), on ? HIGH : LOW);
  }
}

void PheromoneSerial::Enter(State state) {
  state_ = state;
  since_ms_ = static_cast<uint16_t>(millis());
}

}  // namespace arduino
}  // namespace pheromone
