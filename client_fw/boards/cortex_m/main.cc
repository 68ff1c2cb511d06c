// The firmware's image for the mps2-an385.
#include "client_fw/boards/cortex_m/cortex_m_board.h"
#include "client_fw/boards/firmware.h"

namespace {

pheromone::client::WarmMemory memory __attribute__((section(".noinit")));
pheromone::client::CortexMBoard board;

}  // namespace

extern "C" {

void SysTickHandler() {
  board.OnMillisecond();
}
void Uart0ReceiveHandler() {
  board.OnReceived(board.radio());
}
void Uart0SendHandler() {
  board.OnSent(board.radio());
}
void Uart1ReceiveHandler() {
  board.OnReceived(board.robot());
}
void Uart1SendHandler() {
  board.OnSent(board.robot());
}

}  // extern "C"

int main() {
  board.Start();
  pheromone::client::RunFirmware(&board, &memory);
}
