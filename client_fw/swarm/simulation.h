// The engine on a radio channel, in virtual time: the server as one more station of the medium,
// answering through the same service as the daemon's links do.
//
// One thread; the time is the medium's. The same seed gives the same bytes.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "client_fw/sim/simulated_robot.h"
#include "protocol/decoder.h"
#include "server/engine/ordered_log.h"
#include "server/engine/service.h"

namespace pheromone::swarm {

struct ServerTiming {
  int64_t delay_ns = 2'000'000;             ///< from the request's end to the answer's start (D_s)
  int64_t response_window_ns = 50'000'000;  ///< an answer that cannot start in it is not sent
};

/// The server's modem on the medium. Answers leave no earlier than one byte time after the request,
/// so that the asking station has turned to receiving.
class EngineStation final : public sim::Station {
 public:
  /// `service` and `medium` outlive the station, and the station the medium's last event.
  EngineStation(engine::Service* service, sim::RadioMedium* medium, int64_t baud,
                const ServerTiming& timing);

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t time_ns) override;

  /// To be called every millisecond: lets the engine do what is due, and sends.
  void Step();

  /// Answers that could not start within the response window.
  uint64_t late_answers() const { return late_answers_; }
  const protocol::DecoderCounters& decoder_counters() const { return decoder_.counters(); }

 private:
  struct Pending {
    int64_t not_before_ns;
    int64_t not_after_ns;
    std::vector<uint8_t> frame;
  };

  void Queue(const std::vector<engine::Outgoing>& out, int64_t time_ns);

  engine::Service* service_;
  sim::RadioMedium* medium_;
  ServerTiming timing_;
  int64_t byte_ns_;
  protocol::FrameDecoder decoder_;
  std::deque<Pending> pending_;
  uint64_t late_answers_ = 0;
  int number_;
};

struct SimulationConfig {
  engine::EngineConfig engine;
  sim::RadioConfig radio;
  ServerTiming server;
  sim::SimulatedRobotConfig robot;
};

/// One robot, one channel, one server.
class Simulation {
 public:
  explicit Simulation(const SimulationConfig& config);

  /// Lets virtual time pass up to `ms` since the start.
  void RunTo(int64_t ms);

  int64_t now_ms() const { return medium_.now_ns() / 1'000'000; }
  const sim::SimulatedRobot& robot() const { return robot_; }
  const sim::RadioMedium& medium() const { return medium_; }
  const EngineStation& server() const { return station_; }
  uint64_t state_hash() const { return service_.StateHash(); }

 private:
  sim::RadioMedium medium_;
  engine::VolatileLog log_;
  engine::Service service_;
  EngineStation station_;
  sim::SimulatedRobot robot_;
};

}  // namespace pheromone::swarm
