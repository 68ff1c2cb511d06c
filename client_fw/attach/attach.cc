#include "client_fw/attach/attach.h"

#include <fmt/format.h>
#include <poll.h>

#include <array>
#include <span>
#include <utility>
#include <vector>

#include "client_fw/attach/adapter.h"
#include "client_fw/attach/adapter_measurement.h"
#include "client_fw/attach/attached_robot.h"
#include "client_fw/attach/connection.h"
#include "client_fw/attach/reporter.h"
#include "client_fw/attach/servers.h"
#include "client_fw/boards/host/real_time.h"
#include "server/base/say_line.h"

namespace pheromone::attach {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
// For CLOSE to leave and, over a network, to arrive.
constexpr int64_t kPartingMs = 50;
constexpr int64_t kLongestPartingMs = 300;
constexpr int kMaxReads = 16;  // whoever never pauses must not stop the robot's time

class Attachment {
 public:
  explicit Attachment(const AttachOptions& options)
      : options_(options),
        port_(options.robot),
        servers_(options.servers, options.client.id),
        robot_(options.client),
        rates_(PioneerRates(options.robot.baud)),
        adapter_(options.servers.front().baud, options.client.adapter_ms),
        reporter_(&port_, &servers_, &robot_) {}

  // What is not there may come; whoever has it does not expect us.
  Status Open() {
    port_.Advance(now_ms_);
    servers_.Advance(now_ms_);
    for (const Connection* connection : {&std::as_const(port_), &servers_.connection()}) {
      if (connection->in_use()) {
        return Error{connection->address().text + ": " + connection->trouble()};
      }
    }
    return Ok();
  }

  bool Run(const volatile std::sig_atomic_t* stop) {
    while (*stop == 0 && (options_.duration_ms == 0 || now_ms_ < options_.duration_ms)) {
      Turn();
      reporter_.Look(now_ms_);
      if (options_.status_every_ms != 0 && now_ms_ >= next_status_ms_) {
        next_status_ms_ = now_ms_ + options_.status_every_ms;
        SayLine(now_ms_, reporter_.Status());
      }
    }
    return Leave();
  }

 private:
  // What has come, a step, and what goes out; then until the next millisecond or until something
  // comes.
  void Turn() {
    now_ms_ = (MonotonicNs() - start_ns_) / kNsPerMs;
    port_.Advance(now_ms_);
    servers_.Advance(now_ms_);
    if (openings_ != port_.openings()) {
      openings_ = port_.openings();
      robot_.OnRobotConnected(static_cast<uint32_t>(now_ms_),
                              port_.address().kind == Address::Kind::kSerial);
      counted_rates_ = robot_.pioneer().rate();
    }
    for (int i = 0; i < kMaxReads; ++i) {
      const std::span<const uint8_t> bytes = port_.Read(now_ms_);
      if (bytes.empty()) {
        break;
      }
      robot_.OnRobotBytes(bytes);
    }
    for (int i = 0; i < kMaxReads; ++i) {
      const std::span<const uint8_t> bytes = servers_.Read(now_ms_);
      if (bytes.empty()) {
        break;
      }
      robot_.OnModemBytes(bytes);
      Measure(bytes);
    }
    servers_.Choose(now_ms_);
    if (servers_.TakeNewEpoch()) {
      robot_.GreetAgain();
    }
    if (sending_ && servers_.connection().drained(now_ms_)) {
      sending_ = false;
      robot_.OnFrameSent();
    }
    robot_.Step(static_cast<uint32_t>(now_ms_));
    FollowRate();
    port_.Write(robot_.TakeCommands(), now_ms_);
    if (const std::vector<uint8_t> frame = robot_.TakeFrame(); !frame.empty()) {
      servers_.Write(frame, now_ms_);
      sending_ = true;
    }
    std::array<pollfd, 2> waited = {
        {{port_.descriptor(), port_.poll_events(), 0},
         {servers_.connection().descriptor(), servers_.connection().poll_events(), 0}}};
    poll(waited.data(), waited.size(), 1);
  }

  // The adapter of a modem on a port with a bit rate.
  void Measure(std::span<const uint8_t> bytes) {
    const Connection& modem = servers_.connection();
    if (modem.address().kind != Address::Kind::kSerial || !modem.paced()) {
      return;
    }
    adapter_.OnBytes(bytes, MonotonicNs());
    if (adapter_.TakeNews()) {
      robot_.SetAdapter(adapter_.latency_ms(), adapter_.rounds());
      SayLine(now_ms_,
              fmt::format("modem {}: measured, its adapter holds bytes back for {:.1f} ms; the "
                          "robot {}",
                          modem.address().text, static_cast<double>(adapter_.measured_ns()) / 1e6,
                          AccessText(adapter_.rounds())));
    }
  }

  // To the next rate, if the port was open at this one.
  void FollowRate() {
    if (port_.address().kind != Address::Kind::kSerial || !port_.up() ||
        counted_rates_ == robot_.pioneer().rate()) {
      return;
    }
    counted_rates_ = robot_.pioneer().rate();
    const uint32_t before = rates_[rate_];
    rate_ = (rate_ + 1) % rates_.size();
    SayLine(now_ms_, fmt::format("robot {}: no answer at {} baud, trying {}", port_.address().text,
                                 before, rates_[rate_]));
    port_.SetBaud(rates_[rate_]);
  }

  bool Leave() {
    const int64_t ended_ms = now_ms_;  // from here on it asks nothing
    SayLine(now_ms_, "ending: stops the robot and closes its session");
    robot_.Leave();
    while (!robot_.left()) {
      Turn();
    }
    const int64_t left_ms = now_ms_;
    while (now_ms_ < left_ms + kPartingMs ||
           (!port_.drained(now_ms_) && now_ms_ < left_ms + kLongestPartingMs)) {
      Turn();
    }
    const bool stands = robot_.stands();
    SayLine(now_ms_, stands ? "the robot stands" : "the robot did not confirm that it stands");
    SayLine(now_ms_, reporter_.Summary(ended_ms));
    return stands;
  }

  const AttachOptions& options_;
  Connection port_;
  Servers servers_;
  AttachedRobot robot_;
  std::vector<uint32_t> rates_;
  AdapterMeasurement adapter_;
  Reporter reporter_;
  int64_t start_ns_ = MonotonicNs();
  int64_t now_ms_ = 0;
  int64_t next_status_ms_ = 0;
  uint64_t openings_ = 0;      // of the robot's port
  size_t rate_ = 0;            // that it has, of rates_
  uint8_t counted_rates_ = 0;  // without an answer, since the port was opened or before
  bool sending_ = false;       // a frame is on its way through the modem
};

}  // namespace

Result<bool> Attach(const AttachOptions& options, const volatile std::sig_atomic_t* stop) {
  Attachment attachment(options);
  PHEROMONE_TRY_STATUS(attachment.Open());
  return attachment.Run(stop);
}

}  // namespace pheromone::attach
