// A radio modem on a UART.
//
//   PheromoneSerial link(Serial1, 9600);            // a modem that keys itself
//   PheromoneSerial link(Serial1, 9600, 4);         // pin 4 keys it (PTT), high
//   void setup() { Serial1.begin(9600); ... }       // 8N1, before robot.begin
//
// Nothing else may be written to it. The UART must send by itself and say how much it can take
// (availableForWrite), as HardwareSerial does. SoftwareSerial does not: it masks interrupts for the
// time of a byte, and encoders lose ticks.
//
// An Arduino core does not say when the last stop bit has left. Its ring is empty when the last
// byte has gone to the UART, which holds two at most; so the end is two bytes' time later.
#pragma once

#include <Arduino.h>

#include "client_fw/boards/arduino/link.h"

namespace pheromone {
namespace arduino {

// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): it is never deleted
class PheromoneSerial final : public PheromoneLink {
 public:
  /// `key_pin`: -1, none. The stream must outlive the link.
  constexpr PheromoneSerial(Stream& stream, uint32_t baud, int8_t key_pin = -1)
      : stream_(&stream), baud_(baud), key_pin_(key_pin) {}

  void begin(client::Parameters* parameters) override;
  void set_keying(uint16_t lead_ms, uint16_t tail_ms) override;
  int get() override { return stream_->read(); }
  bool put(uint8_t byte) override;
  bool idle() override { return !busy(); }
  bool busy() override;

 private:
  enum State : uint8_t {
    kSilent,
    kLead,     // keyed, nothing sent yet
    kSending,  // the ring is not empty
    kEnding,   // the UART is not, and the tail
  };

  void Key(bool on);
  uint16_t Passed() const {
    return static_cast<uint16_t>(static_cast<uint16_t>(millis()) - since_ms_);
  }
  void Enter(State state);

  Stream* stream_;
  uint32_t baud_;
  int room_ = 0;  // of the empty ring
  uint16_t lead_ms_ = 0;
  uint16_t end_ms_ = 0;  // from the empty ring to the end of the tail
  uint16_t since_ms_ = 0;
  State state_ = kSilent;
  int8_t key_pin_;
};

}  // namespace arduino
}  // namespace pheromone
