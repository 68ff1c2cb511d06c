// The firmware's image for the ATmega1284P.
#include "client_fw/boards/avr/avr_board.h"
#include "client_fw/boards/firmware.h"

namespace {

// Not cleared by start-up, so that it survives a warm reset.
pheromone::client::WarmMemory memory __attribute__((section(".noinit")));

pheromone::client::AvrBoard board;

}  // namespace

// OS_main: it never returns, so it need not save the registers of a caller.
__attribute__((OS_main)) int main() {
  board.Start();
  pheromone::client::RunFirmware(&board, &memory);
}
