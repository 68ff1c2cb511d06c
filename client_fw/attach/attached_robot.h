// A real robot with a client beside it: the firmware's own code (client_fw/core) on a host's board,
// which drives a Pioneer over ARCOS and converses with the server. Without any I/O: bytes and the
// time go in, bytes come out.
//
//   AttachedRobot robot(parameters);
//   robot.OnRobotBytes(from_the_pioneer);
//   robot.OnModemBytes(from_the_server);
//   robot.Step(now_ms);                                 // every millisecond
//   Write(robot_port, robot.TakeCommands());
//   Write(modem_port, robot.TakeFrame());               // ... and when it has left:
//   robot.OnFrameSent();
//   ...
//   robot.Leave();                                      // keep on stepping until left()
//
// What the server sent while the program was held up (kPauseMs without a Step) is discarded: an
// answer that was waiting must not steer a robot that is elsewhere by now. The server repeats its
// commands.
//
// One thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client_fw/boards/host/host_board.h"
#include "client_fw/core/pioneer/pioneer_drive.h"
#include "client_fw/core/robot.h"

namespace pheromone::attach {

/// Longer than this between two Steps is a pause.
constexpr uint32_t kPauseMs = 100;
/// Leave() waits for so long until the robot stands.
constexpr uint32_t kLongestStopMs = 3000;

class AttachedRobot {
 public:
  explicit AttachedRobot(const client::Parameters& parameters);
  AttachedRobot(const AttachedRobot&) = delete;
  AttachedRobot& operator=(const AttachedRobot&) = delete;

  /// A new connection to the Pioneer, now. On a serial port (`close_first`) somebody may have left
  /// it in a session; over TCP, it is taken to have ended with the connection before, and MobileSim
  /// would take CLOSE for the beginning of one.
  void OnRobotConnected(uint32_t now_ms, bool close_first);
  void OnRobotBytes(std::span<const uint8_t> bytes);
  void OnModemBytes(std::span<const uint8_t> bytes);
  /// The server is another one, which does not know this robot.
  void GreetAgain() { robot_.GreetAgain(); }
  /// The modem's adapter was measured (AdapterMeasurement).
  void SetAdapter(uint8_t adapter_ms, bool rounds) { robot_.SetAdapter(adapter_ms, rounds); }

  /// Milliseconds of a clock that may wrap.
  void Step(uint32_t now_ms);

  /// Whole commands to the Pioneer, to be written at once; empty: none.
  std::vector<uint8_t> TakeCommands();
  /// A whole frame to the server, to be written at once; empty: none, or the last one has not left.
  std::vector<uint8_t> TakeFrame();
  void OnFrameSent() { board_.OnTransmitted(); }

  /// Stops the robot and closes its session; the server is not answered any more.
  void Leave();
  /// That is done, or there is no session to close.
  bool left() const { return leaving_ == Leaving::kLeft; }
  /// The robot is heard, and has reported the same pose again and again.
  bool stands() const { return drive_.pioneer().known() && equal_poses_ >= kEqualPoses; }

  const client::Conversation& conversation() const { return robot_.conversation(); }
  const client::Pioneer& pioneer() const { return drive_.pioneer(); }
  /// The last speeds given to the Pioneer.
  client::WheelSpeeds wheels() const { return robot_.wheels(); }
  /// Where the robot believes to be on the map; meaningful while pioneer().known().
  client::Pose pose() const;

 private:
  // A host board with a second UART.
  class Board : public client::HostBoard {
   public:
    int robot_get() { return reports.Get(); }
    bool robot_put(uint8_t byte) { return commands.Put(byte); }
    static void set_robot_rate(uint8_t /*number*/) {}  // whoever has the port asks pioneer()

    client::ByteRing<4096> reports;  // from the Pioneer
    client::ByteRing<64> commands;   // to it
  };
  enum class Leaving { kNo, kStopping, kLeft };
  // So many times after another.
  static constexpr int kEqualPoses = 3;

  void WatchPose();
  void StepLeaving(uint32_t now_ms);

  Board board_;
  client::PioneerDrive<Board> drive_;
  client::RequestMemory memory_{};
  client::Robot<Board, client::PioneerDrive<Board>> robot_;
  std::vector<uint8_t> from_modem_;
  uint32_t last_step_ms_ = 0;
  Leaving leaving_ = Leaving::kNo;
  uint32_t leave_ms_ = 0;
  // The last reported pose, and how many reports before had the same.
  client::Odometry odometry_{};
  int equal_poses_ = 0;
  uint8_t sips_ = 0;
};

}  // namespace pheromone::attach
