#include "client_fw/attach/reporter.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "client_fw/boards/host/stop_text.h"
#include "server/base/say_line.h"

namespace pheromone::attach {
namespace {

struct BitText {
  uint8_t bit;
  const char* text;
};

constexpr std::array<BitText, 5> kAlarmTexts = {
    {{client::kStallAlarm, "wheels stalled"},
     {client::kBumperAlarm, "bumper pressed"},
     {client::kStopButtonAlarm, "STOP button pressed"},
     {client::kMotorsOffAlarm, "motors were switched off"},
     {client::kPoseLostAlarm, "odometry was lost"}}};

// The texts of the bits that are set, each behind `separator` but the first behind `first`.
std::string Join(uint8_t bits, std::span<const BitText> texts, const std::string& first,
                 const std::string& separator) {
  std::string joined;
  for (const BitText& known : texts) {
    if ((bits & known.bit) != 0) {
      joined += (joined.empty() ? first : separator) + known.text;
    }
  }
  return joined;
}

void SayIfNew(int64_t now_ms, std::string text, std::string* last) {
  if (text != *last && !text.empty()) {
    SayLine(now_ms, text);
    *last = std::move(text);
  }
}

}  // namespace

std::string MotionText(uint8_t flags, bool trail_lost, bool stands) {
  if (flags == 0) {
    return trail_lost ? "drives, trail lost" : "drives";
  }
  return (stands ? "stands: " : "stops: ") + client::StopText(flags);
}

std::string AlarmText(uint8_t alarms) {
  return Join(alarms, kAlarmTexts, ", ", ", ");
}

int64_t Silences::OnAnswer(int64_t now_ms) {
  const int64_t ended_ms = now_ms - answered_ms_.value_or(now_ms);
  longest_ms_ = longest_ms(now_ms);
  answered_ms_ = now_ms;
  return ended_ms;
}

int64_t Silences::longest_ms(int64_t now_ms) const {
  return std::max(longest_ms_, now_ms - answered_ms_.value_or(now_ms));
}

// When a connection is back, the link to the Pioneer may not have noticed yet that its session is
// gone: "session open" is told once it has.
std::string Reporter::RobotText() {
  const std::string prefix = "robot " + robot_port_->address().text + ": ";
  stale_ = robot_->pioneer().known() && (stale_ || !robot_port_->up());
  if (!robot_port_->up()) {
    return robot_port_->trouble().empty() ? "" : prefix + robot_port_->trouble() + "; trying again";
  }
  const client::Pioneer& pioneer = robot_->pioneer();
  if (!pioneer.known() || stale_) {
    return prefix + "connected, no session yet";
  }
  std::string text = prefix + "session open, motors ";
  text += (pioneer.flags() & client::kMotorsOn) != 0 ? "on" : "off";
  text += AlarmText(robot_->conversation().state().drive.alarms);
  return text;
}

// When answers stop, HELLO is said again and again: what the operator has to know then is that the
// robot stands.
std::string Reporter::ServerText() {
  const Connection& modem = servers_->connection();
  const std::string prefix = "server " + modem.address().text + ": ";
  const client::Conversation& conversation = robot_->conversation();
  if (moved_ || (greeted_ && moves_ != 0 && conversation.counters().hello_answers == hellos_)) {
    return "";  // it goes on without a HELLO
  }
  if (!modem.up()) {
    greeted_ = false;
    return modem.trouble().empty() ? "" : prefix + modem.trouble() + "; trying again";
  }
  if (!conversation.requests().greeted) {
    return greeted_ ? server_text_ : prefix + "no answer yet; HELLO is repeated";
  }
  greeted_ = true;
  const protocol::HelloAnswer hello = conversation.server();
  return fmt::format("{}HELLO answered, protocol version {}, epoch {}", prefix,
                     hello.protocol_version, hello.epoch);
}

// The silence is what counts for the robot: from one answer that it steers by to the next.
void Reporter::LookForAnswers(int64_t now_ms) {
  const client::Counters counters = robot_->conversation().counters();
  if (moves_ != servers_->all_moves()) {
    moves_ = servers_->all_moves();
    hellos_ = counters.hello_answers;
    moved_ = true;
    SayIfNew(now_ms,
             servers_->all_silent() ? "no server of the list answers; they are tried in turn"
                                    : "server " + servers_->left() + "; trying " +
                                          servers_->connection().address().text,
             &move_text_);
  }
  if (answers_ == counters.answers) {
    return;
  }
  const int64_t silence_ms = silences_.OnAnswer(now_ms);
  if (moved_ && answers_ != 0) {
    SayLine(now_ms, fmt::format("server {}: answers, {:.3f} s after the answer before",
                                servers_->connection().address().text,
                                static_cast<double>(silence_ms) / 1000));
  }
  moved_ = false;
  move_text_.clear();
  answers_ = counters.answers;
}

// Nothing before its first session: whether it stands then, nobody has seen.
std::string Reporter::MotionTextNow() {
  if (!robot_->pioneer().known() || stale_) {
    return motion_text_.empty() ? ""
                                : "the robot is not heard: if it drives, its own watchdog stops it";
  }
  const client::BehaviourState& state = robot_->conversation().state();
  const bool stands = robot_->stands();
  driven_ = state.flags == 0 || (driven_ && !stands);
  return driven_ || stands ? MotionText(state.flags, state.trail_lost, stands) : "";
}

void Reporter::Look(int64_t now_ms) {
  SayIfNew(now_ms, RobotText(), &robot_text_);
  LookForAnswers(now_ms);
  SayIfNew(now_ms, ServerText(), &server_text_);
  SayIfNew(now_ms, MotionTextNow(), &motion_text_);
}

std::string Reporter::Status() const {
  const client::Conversation& conversation = robot_->conversation();
  const client::Pose pose = robot_->pose();
  const client::WheelSpeeds wheels = robot_->wheels();
  const std::string place =
      robot_->pioneer().known()
          ? fmt::format("pose {:.2f} {:.2f} m {:.0f}°", pose.x_mm / 1000.0, pose.y_mm / 1000.0,
                        std::remainder(pose.heading * 360.0 / 65'536, 360.0))
          : "pose unknown";
  return fmt::format("{}, P {:.2f} {:.2f}, wheels {} {} mm/s", place,
                     conversation.state().p_left / 4096.0, conversation.state().p_right / 4096.0,
                     wheels.left_mm_s, wheels.right_mm_s);
}

std::string Reporter::Summary(int64_t now_ms) const {
  const client::Counters& counters = robot_->conversation().counters();
  return fmt::format(
      "{} requests, {} answers, {} timeouts, {} late answers, {} forged, {} errors, {} fail-safe "
      "stops; lost "
      "the robot {} times and the modem {} times; longest time without an answer {:.3f} s",
      counters.requests, counters.answers, counters.timeouts, counters.late_answers,
      counters.forged, counters.errors, counters.fail_safe_stops, robot_port_->losses(),
      servers_->connection().losses(), static_cast<double>(silences_.longest_ms(now_ms)) / 1000);
}

}  // namespace pheromone::attach
