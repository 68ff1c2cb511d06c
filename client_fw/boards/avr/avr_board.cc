#include "client_fw/boards/avr/avr_board.h"

#include <avr/interrupt.h>

#include "protocol/byte_order.h"
#include "protocol/crc16.h"

namespace pheromone {
namespace client {

void AvrBoard::Start() {
  const uint8_t cause = MCUSR;
  reset_cause_ = cause;
  MCUSR = 0;  // first after a watchdog reset, or the watchdog keeps its 16 ms
  wdt_enable(WDTO_250MS);
  // A bootloader that clears MCUSR hides the cause: then RAM is not trusted.
  ram_was_kept_ =
      (cause & (1u << EXTRF | 1u << WDRF)) != 0 && (cause & (1u << PORF | 1u << BORF)) == 0;
  PORTA = 0xFF;
  PORTD = kRadioRxd | kRobotRxd | kCarrier;  // pull-ups: unconnected inputs are idle
  DDRD = kPtt | kLed;
  StartUarts();
  StartClock();
  sei();
}

uint16_t AvrBoard::diagnostic(uint8_t id) const {
  const Uart& uart = uarts[id < kRobotFramingErrors ? kRadio : kRobot];
  return id == kResetCause                                        ? reset_cause_
         : id == kRadioFramingErrors || id == kRobotFramingErrors ? uart.framing_errors
                                                                  : uart.overruns;
}

bool AvrBoard::load_key(uint8_t* to) {
  enum : uint8_t { kKeySize = 16, kSize = kKeySize + 2 };
  uint8_t record[kSize];
  for (uint8_t i = 0; i < kSize; ++i) {
    record[i] = Eeprom::ReadFar(kKeyAddress + i);
  }
  for (uint8_t i = 0; i < kKeySize; ++i) {
    to[i] = record[i];
  }
  return protocol::GetU16(record + kKeySize) == protocol::Check(record, kKeySize);
}

uint8_t AvrBoard::id() const {
  uint8_t id = static_cast<uint8_t>(~PINA);
  if (id == 0 || id == 0xFFu) {
    id = Eeprom::Read(kIdAddress);
  }
  return id == 0 || id == 0xFFu ? uint8_t{1} : id;
}

}  // namespace client
}  // namespace pheromone
