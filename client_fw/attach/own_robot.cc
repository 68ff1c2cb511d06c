// A robot of your own, on a computer that reaches the server: give Wheels your motors and your
// encoders. As it is, it drives on paper.
//
//   own_robot udp:127.0.0.1:4951 7         the server's UDP link, and the robot's ID; if the link
//                                          has security, also the file with its key: robot-7.key
//   pheromonectl command LINK 7 resume     until then it stands
//
// Ctrl-C stops the wheels, and then the program.
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "client_fw/attach/connection.h"
#include "client_fw/boards/host/host_board.h"
#include "client_fw/boards/host/real_time.h"
#include "client_fw/core/robot.h"
#include "client_fw/keys/robot_key.h"
#include "server/base/say_line.h"

using namespace pheromone::client;

class Wheels {
 public:
  // Since power-up: millimetres, and an angle whose whole turn is 65536. False: not known.
  bool odometry(Odometry* to) {
    *to = {static_cast<int32_t>(x_mm_), static_cast<int32_t>(y_mm_),
           static_cast<BinaryAngle>(std::lround(heading_rad_ / (2 * M_PI) * 65536))};
    return true;
  }
  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s) {
    left_mm_s_ = left_mm_s, right_mm_s_ = right_mm_s;
  }
  void emergency_stop() { set_wheel_speeds(0, 0); }
  const DriveStatus& status() { return kNothingToTell; }  // bumpers, battery, a stop button

  void Turn(double seconds) {  // your motors do that
    const double forward_mm = (left_mm_s_ + right_mm_s_) / 2.0 * seconds;
    heading_rad_ += (right_mm_s_ - left_mm_s_) / kTrackMm * seconds;
    x_mm_ += forward_mm * std::cos(heading_rad_), y_mm_ += forward_mm * std::sin(heading_rad_);
  }
  std::string Text() const {
    return fmt::format("{:.0f} {:.0f} mm, {:.2f} rad, {} {} mm/s", x_mm_, y_mm_, heading_rad_,
                       left_mm_s_, right_mm_s_);
  }

 private:
  static constexpr double kTrackMm = 330;
  double x_mm_ = 0, y_mm_ = 0, heading_rad_ = 0;
  int16_t left_mm_s_ = 0, right_mm_s_ = 0;
};

int main(int argc, char** argv) {
  auto address = pheromone::attach::ParseAddress(argc > 1 ? argv[1] : "udp:127.0.0.1:4951", 9600);
  if (!address.ok()) {
    std::fprintf(stderr, "own_robot: %s\n", address.error().c_str());
    return 2;
  }
  const int id = argc > 2 ? std::atoi(argv[2]) : 1;
  if (id < 1 || id > 254) {
    std::fprintf(stderr, "own_robot: %s: a robot's ID is 1 to 254\n", argv[2]);
    return 2;
  }
  Parameters parameters;  // the firmware's settings, and:
  parameters.id = static_cast<uint8_t>(id);
  parameters.boot_counter = static_cast<uint16_t>(std::random_device{}());  // another one each time
  parameters.buffered_link = true, parameters.gap_timeout_ms = 0, parameters.rounds = false;
  parameters.type = 2;                          // the pheromone "path"
  parameters.start = Pose{5000, 3000, 0xF800};  // on the map: mm, and the angle
  pheromone::keys::RobotKey key;
  if (argc > 3) {
    auto taken = pheromone::keys::TakeKey(argv[3]);
    if (!taken.ok()) {
      std::fprintf(stderr, "own_robot: %s\n", taken.error().c_str());
      return 2;
    }
    key = taken.value();
    parameters.key = key.bytes.data(), parameters.boot_counter = key.start;
  }

  pheromone::attach::Connection server(address.value());
  HostBoard board;
  Wheels wheels;
  RequestMemory memory{};
  Robot<HostBoard, Wheels> robot(&board, &wheels, parameters, &memory);
  uint8_t frame[kMaxClientFrame];
  std::signal(SIGPIPE, SIG_IGN);
  const volatile std::sig_atomic_t* const stop = pheromone::StopOnSignals();
  const int64_t begin_ns = pheromone::MonotonicNs();
  int64_t now_ms = 0;
  for (int64_t last_ms = 0; *stop == 0; last_ms = now_ms) {
    usleep(1000);
    now_ms = (pheromone::MonotonicNs() - begin_ns) / 1'000'000;
    server.Advance(now_ms);
    for (auto bytes = server.Read(now_ms); !bytes.empty(); bytes = server.Read(now_ms)) {
      board.Receive(bytes.data(), bytes.size());
    }
    board.set_millis(static_cast<Moment>(now_ms));
    robot.Step();
    if (const size_t size = board.TakeTransmission(frame, sizeof frame); size != 0) {
      server.Write({frame, size}, now_ms);
      board.OnTransmitted();
    }
    wheels.Turn(static_cast<double>(now_ms - last_ms) / 1e3);
    if (now_ms / 1000 != last_ms / 1000) {
      pheromone::SayLine(now_ms, wheels.Text());  // never waits for whoever reads
    }
  }
  wheels.emergency_stop();
  pheromone::SayLine(now_ms, wheels.Text());
}
