// A robot's firmware from power-up on, the same on every chip.
//
//   RequestMemory memory __attribute__((section(".noinit")));   // outlives a warm reset
//   MyBoard board;
//   int main() {
//     board.Start();
//     RunFirmware(&board, &memory);
//   }
//
// Board is what client_fw/core/robot.h and pioneer_drive.h ask for, and
//   uint8_t id();                                   what the robot is called, 1-254
//   uint32_t radio_baud();                          bit rate of the radio
//   bool ram_was_kept();                            the last reset was warm
//   bool load_settings(uint8_t* to, uint8_t size);  as they were saved last; false if never. To be
//                                                   called once, before save_settings.
//   bool saved();                                   what was to be saved is
//   uint16_t saves();                               counts what was ever saved on this board
//   void EndTurn();                                 of the loop: feeds the watchdog, writes what is
//                                                   to be saved, sleeps until something happens
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "client_fw/core/parameters.h"
#include "client_fw/core/pioneer_drive.h"
#include "client_fw/core/request_memory.h"
#include "client_fw/core/robot.h"

namespace pheromone {
namespace client {

struct Place {
  void* at;
};

}  // namespace client
}  // namespace pheromone

/// Constructs an object in existing memory. (There is no <new> without a C++ library.)
inline void* operator new(size_t /*size*/, pheromone::client::Place place) noexcept {
  return place.at;
}

namespace pheromone {
namespace client {

template <class Board>
__attribute__((noreturn)) void RunFirmware(Board* board, RequestMemory* memory) {
  static Parameters parameters;
  uint8_t* const settings = reinterpret_cast<uint8_t*>(static_cast<Settings*>(&parameters));
  board->load_settings(settings, sizeof(Settings));
  if (!board->ram_was_kept() || !Trusted(*memory)) {
    *memory = RequestMemory();
    // Saving them once more gives a number that no boot has used before: our nonce.
    board->save_settings(settings, sizeof(Settings));
    while (!board->saved()) {
      board->EndTurn();
    }
    memory->nonce = board->saves();
    Seal(memory);
  }
  parameters.boot_counter = memory->nonce;
  parameters.id = board->id();
  parameters.baud = board->radio_baud();
  // In static memory, so that the budget counts them; constructed here, because they need
  // arguments.
  using Drive = PioneerDrive<Board>;
  alignas(Drive) static uint8_t drive_memory[sizeof(Drive)];
  alignas(Robot<Board, Drive>) static uint8_t robot_memory[sizeof(Robot<Board, Drive>)];
  Drive* const drive =
      new (Place{drive_memory}) Drive(board, static_cast<int16_t>(parameters.drive_scale));
  auto* const robot =
      new (Place{robot_memory}) Robot<Board, Drive>(board, drive, parameters, memory);
  for (;;) {
    drive->Step();
    robot->Step();
    board->EndTurn();
  }
}

}  // namespace client
}  // namespace pheromone
