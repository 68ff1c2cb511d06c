// What happens to an attached robot, as lines for its operator: a line whenever something changes,
// with the seconds since the start in front.
//
//      0.4 s  robot 192.168.1.7:8101: session open, motors on
//      0.5 s  server: HELLO answered, protocol version 1, epoch 7
//      0.5 s  stands: halted
//
//   Reporter reporter(&robot_port, &servers, &robot);
//   reporter.Look(now_ms);                  // every millisecond
//
// One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client_fw/attach/attached_robot.h"
#include "client_fw/attach/connection.h"
#include "client_fw/attach/servers.h"

namespace pheromone::attach {

/// Why a robot with these client::StopFlags stands, or stops while it was not seen to stand;
/// "drives" if there are none.
std::string MotionText(uint8_t flags, bool trail_lost, bool stands);

/// What these client::Alarms are, each behind a comma.
std::string AlarmText(uint8_t alarms);

/// The times from one answer to the next; the last one lasts until now.
class Silences {
 public:
  /// The silence that this answer ends, ms; 0 for the first one.
  int64_t OnAnswer(int64_t now_ms);
  int64_t longest_ms(int64_t now_ms) const;

 private:
  std::optional<int64_t> answered_ms_;
  int64_t longest_ms_ = 0;
};

class Reporter {
 public:
  /// All must outlive the reporter.
  Reporter(const Connection* robot_port, const Servers* servers, const AttachedRobot* robot)
      : robot_port_(robot_port), servers_(servers), robot_(robot) {}

  void Look(int64_t now_ms);

  /// Pose, intensities and wheel speeds.
  std::string Status() const;
  /// What happened in all.
  std::string Summary(int64_t now_ms) const;

 private:
  std::string RobotText();
  std::string ServerText();
  std::string MotionTextNow();
  void LookForAnswers(int64_t now_ms);

  const Connection* robot_port_;
  const Servers* servers_;
  const AttachedRobot* robot_;
  std::string robot_text_;
  std::string server_text_;
  std::string motion_text_;
  std::string move_text_;
  bool greeted_ = false;  // since the modem is up
  bool stale_ = false;    // the session that the robot's client knows of is of before a loss
  bool driven_ = false;   // since it was last seen to stand
  uint64_t moves_ = 0;    // of the servers, as told
  unsigned hellos_ = 0;   // answered before the last of them
  bool moved_ = false;    // and nothing to steer by has come since
  uint32_t answers_ = 0;
  Silences silences_;
};

}  // namespace pheromone::attach
