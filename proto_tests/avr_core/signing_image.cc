// The image for the ATmega1284P: one robot's end of a signed link. Reads a request of
// signing_turn.h from UART0 as length u16 and bytes, and sends the reply in the same way. Polled.
#include <avr/io.h>
#include <stdint.h>

#include "client_fw/core/signing/signing.h"
#include "proto_tests/avr_core/polled_uart.h"
#include "proto_tests/avr_core/signing_turn.h"
#include "protocol/byte_order.h"

namespace pheromone {
namespace core_boundary {
namespace {

const uint8_t kKey[16] = {PHEROMONE_TEST_KEY};

client::Signing signing(kKey);
uint8_t request[kMaxSigningRequest];
uint8_t reply[2 + client::Signing::kLongest];

// Bytes of the result after the time.
uint8_t Obey(const client::FrameView& frame) {
  uint8_t* const result = reply + 2;
  switch (request[0]) {
    case kSignHello:
      return signing.SignHello(frame, protocol::GetU16(request + 1), result);
    case kTakeAnswer:
      result[0] = signing.TakeAnswer(frame) ? 1 : 0;
      return 1;
    case kDerive:
      result[0] = signing.Derive() ? 1 : 0;
      return 1;
    case kSign:
      return signing.Sign(frame, result);
    default:
      result[0] = signing.Verify(frame);
      return 1;
  }
}

void Serve() {
  const uint8_t size = Receive();
  Receive();
  for (uint8_t i = 0; i < size; ++i) {
    request[i] = Receive();
  }
  const client::FrameView frame = {request[3], request[4], request + kSigningHead,
                                   static_cast<uint8_t>(size - kSigningHead)};
  TCNT1 = 0;
  const uint8_t length = static_cast<uint8_t>(2 + Obey(frame));
  protocol::PutU16(reply, TCNT1);
  Send(length);
  Send(0);
  for (uint8_t i = 0; i < length; ++i) {
    Send(reply[i]);
  }
}

}  // namespace
}  // namespace core_boundary
}  // namespace pheromone

int main() {
  pheromone::core_boundary::SetUpUart();
  TCCR1B = 1u << CS11;  // kCyclesATick
  for (;;) {
    pheromone::core_boundary::Serve();
  }
}
