// The firmware's image for the ATmega1284P.
#include "client_fw/boards/avr/avr_board.h"
#include "client_fw/boards/firmware.h"

namespace {

// Left alone by start-up, so that it outlives a warm reset.
pheromone::client::RequestMemory memory __attribute__((section(".noinit")));

pheromone::client::AvrBoard board;

}  // namespace

// OS_main: it never returns, so it need not put aside the registers of a caller.
__attribute__((OS_main)) int main() {
  board.Start();
  pheromone::client::RunFirmware(&board, &memory);
}
