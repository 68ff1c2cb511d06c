// UART 0 of an mps2-an385.
#include "proto_tests/conformance/port.h"

#include "client_fw/boards/cortex_m/registers.h"

namespace pheromone {
namespace conformance {

// Interrupts stay disabled; one that is pending ends the wait all the same. Sleeping rather than
// looking again and again leaves QEMU the time to bring the byte: it is several times faster.
void StartPort() {
  client::DisableInterrupts();
  client::EnableUartInterrupts();
  client::Uart(0).divisor = 16;  // the least that it takes; QEMU does not pace
  client::Uart(0).control =
      client::kUartSend | client::kUartReceive | client::kUartReceiveInterrupt;
}

uint8_t Receive() {
  while ((client::Uart(0).state & client::kReceiveFull) == 0) {
    client::WaitForInterrupt();
  }
  const uint8_t byte = static_cast<uint8_t>(client::Uart(0).data & 0xFFu);
  client::Uart(0).interrupt = client::kReceiveFull;
  client::ForgetUartInterrupts();
  return byte;
}

void Send(uint8_t byte) {
  while ((client::Uart(0).state & client::kSendFull) != 0) {
  }
  client::Uart(0).data = byte;
}

}  // namespace conformance
}  // namespace pheromone
