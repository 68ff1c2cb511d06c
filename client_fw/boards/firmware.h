// A robot's firmware from power-up on, the same on every chip.
//
//   WarmMemory memory __attribute__((section(".noinit")));   // outlives a warm reset
//   MyBoard board;
//   int main() {
//     board.Start();
//     RunFirmware(&board, &memory);
//   }
//
// Board is what client_fw/core/robot.h and pioneer_drive.h ask for, and
//   uint8_t id();                                   what the robot is called, 1-254
//   uint32_t radio_baud();                          bit rate of the radio
//   void set_keying(uint16_t lead_ms, uint16_t tail_ms);   of the radio's transmitter, once
//   bool ram_was_kept();                            the last reset was warm
//   bool load_settings(uint8_t* to, uint8_t size);  as they were saved last; false if never. To be
//                                                   called once, before save_settings.
//   bool load_key(uint8_t* to);                     16 bytes, the robot's key for signed frames;
//                                                   false: it signs nothing. Not called by images
//                                                   with PHEROMONE_SIGNING=0
//   uint16_t diagnostic(kResetCause);               a set of ResetCause
//   bool saved();                                   what was to be saved is
//   uint16_t saves();                               counts what was ever saved on this board
//   void EndTurn();                                 of the loop: feeds the watchdog, writes what is
//                                                   to be saved, sleeps until something happens
//
// Task is one of robot.h that also has
//   explicit Task(const Parameters&);               as they are after start-up
//   static void Prepare(Parameters*);               other defaults than those of Settings
//
// A warm reset with its memory intact goes on: same nonce, same place on the map, same odometry in
// the Pioneer's session. When power was switched on, the robot is where its odometry starts. After
// everything else, such as a sagging supply, it does not know where it is, says so, and stands.
#pragma once

#include <stdint.h>

#include "client_fw/boards/boot.h"
#include "client_fw/core/pioneer/pioneer_drive.h"
#include "client_fw/core/requests/request_memory.h"
#include "client_fw/core/robot.h"
#include "client_fw/core/steering/parameters.h"
#include "protocol/crc16.h"

namespace pheromone {
namespace client {

/// What a board keeps in RAM that a reset does not clear. Plain memory.
struct WarmMemory {
  RequestMemory requests;
  PioneerTrack track;
  bool has_track;      ///< false: the Pioneer has not reported since power-up
  uint16_t track_crc;  ///< of both
};

inline uint16_t CheckOfTrack(const WarmMemory& memory) {
  const uint16_t check = protocol::Check(&memory.track, sizeof(memory.track));
  return static_cast<uint16_t>(memory.has_track ? check : check ^ 0xAAAAu);
}

/// The client that follows pheromones.
struct FollowTask : NoTask {
  explicit FollowTask(const Parameters& /*parameters*/) {}
  static void Prepare(Parameters* /*parameters*/) {}
};

template <class Task = FollowTask, class Board>
__attribute__((noreturn)) void RunFirmware(Board* board, WarmMemory* memory) {
  static Parameters parameters;
  Task::Prepare(&parameters);
  uint8_t packed[kSettingsSize];
  if (board->load_settings(packed, sizeof(packed))) {
    UnpackSettings(packed, &parameters);
  }
  RequestMemory* const requests = &memory->requests;
  if (!board->ram_was_kept() || !Restore(requests)) {
    parameters.pose_lost = (board->diagnostic(kResetCause) & kPowerOnReset) == 0;
    memory->track = PioneerTrack();
    memory->has_track = false;
    memory->track_crc = CheckOfTrack(*memory);
    StartCold(board, parameters, requests);
  } else if (memory->track_crc != CheckOfTrack(*memory)) {
    parameters.pose_lost = true;
    memory->has_track = false;
  }
  parameters.boot_counter = requests->nonce;
#if PHEROMONE_SIGNING
  static uint8_t key[protocol::kAesBlock];
  parameters.key = board->load_key(key) ? key : nullptr;
#endif
  parameters.id = board->id();
  parameters.baud = board->radio_baud();
  board->set_keying(parameters.ptt_lead_ms, parameters.ptt_tail_ms);
  // In static memory, so that the budget counts them; constructed here, because they need
  // arguments.
  using Drive = PioneerDrive<Board>;
  alignas(Drive) static uint8_t drive_memory[sizeof(Drive)];
  using ThisRobot = Robot<Board, Drive, Task>;
  alignas(ThisRobot) static uint8_t robot_memory[sizeof(ThisRobot)];
  Drive* const drive = new (Place{drive_memory})
      Drive(board, static_cast<int16_t>(parameters.drive_scale), parameters.sonar);
  if (memory->has_track) {
    drive->Continue(memory->track);
  }
  auto* const robot =
      new (Place{robot_memory}) ThisRobot(board, drive, parameters, requests, Task(parameters));
  uint8_t sips = drive->pioneer().sips();
  for (;;) {
    drive->Step();
    if (sips != drive->pioneer().sips()) {
      sips = drive->pioneer().sips();
      memory->track = drive->pioneer().track();
      memory->has_track = true;
      memory->track_crc = CheckOfTrack(*memory);
    }
    robot->Step();
    board->EndTurn();
  }
}

}  // namespace client
}  // namespace pheromone
