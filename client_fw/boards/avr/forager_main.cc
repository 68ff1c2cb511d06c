// The image of a robot with a net (client_fw/core/tasks/forager.h) for the ATmega1284P. Another
// net: client_fw/README.md, "Another net".
#include "client_fw/boards/avr/avr_board.h"
#include "client_fw/boards/firmware.h"
#include "client_fw/core/tasks/forager.h"
#include "client_fw/core/tasks/robot_net.h"

namespace pheromone {
namespace client {
namespace {

// Not cleared by start-up, so that they survive a warm reset.
WarmMemory memory __attribute__((section(".noinit")));
NetMemory net_memory __attribute__((section(".noinit")));

struct ForagingTask : Forager {
  explicit ForagingTask(const Parameters& parameters)
      : Forager(kRobotNet, Rules(), parameters.id, parameters.boot_counter, &net_memory) {}

  static NetRobotParameters Rules() {
    NetRobotParameters rules;
    rules.rule = PHEROMONE_DEPOSIT_BURN != 0 ? DepositRule::kScaled : DepositRule::kEqual;
    rules.burn_per_s = PHEROMONE_DEPOSIT_BURN;
    rules.explore_percent = PHEROMONE_EXPLORE_PERCENT;
    rules.capacity = PHEROMONE_CAPACITY;
    rules.capture_mm = PHEROMONE_CAPTURE_MM;
    return rules;
  }
  static void Prepare(Parameters* parameters) { PrepareForForaging(kRobotNet, parameters); }
};

AvrBoard board;

}  // namespace
}  // namespace client
}  // namespace pheromone

// OS_main: it never returns, so it need not save the registers of a caller.
__attribute__((OS_main)) int main() {
  using namespace pheromone::client;
  board.Start();
  RunFirmware<ForagingTask>(&board, &memory);
}
