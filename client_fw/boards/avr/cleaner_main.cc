// The image of a cleaning robot (client_fw/core/tasks/cleaner.h) for the ATmega1284P.
#include "client_fw/boards/avr/avr_board.h"
#include "client_fw/boards/firmware.h"
#include "client_fw/core/tasks/cleaner.h"

namespace pheromone {
namespace client {
namespace {

struct CleaningTask : Cleaner {
  explicit CleaningTask(const Parameters& parameters)
      : Cleaner(Timing(), parameters.id, parameters.boot_counter) {}

  static CleanerParameters Timing() {
    CleanerParameters timing;
    timing.cleaning_ms = PHEROMONE_CLEANING_MS;
    timing.lease_s = PHEROMONE_CLAIM_S;
    return timing;
  }
  static void Prepare(Parameters* parameters) { PrepareForCleaning(parameters); }
};

// Not cleared by start-up, so that it survives a warm reset.
WarmMemory memory __attribute__((section(".noinit")));

AvrBoard board;

}  // namespace
}  // namespace client
}  // namespace pheromone

// OS_main: it never returns, so it need not save the registers of a caller.
__attribute__((OS_main)) int main() {
  using namespace pheromone::client;
  board.Start();
  RunFirmware<CleaningTask>(&board, &memory);
}
