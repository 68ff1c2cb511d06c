// The server on a radio channel, in virtual time: the engine as one more station of the medium,
// answering through the same service as the daemon's links do, by the rules of medium access of
// protocol/README.md ("Half-duplex channels").
//
//   EngineStation server(&service, 0, &medium, timing);
//   medium.AdvanceTo(...); server.Step();             // every millisecond
//
// Its rules, with B the time of a byte and T_t its modem's turnaround:
//  * an answer is begun `delay_ns` after its request's end, or B if that is longer, so that its
//    first bit follows the request by T_t + B at least and the asking station has turned round;
//  * an answer whose first bit cannot be sent within `response_window_ns` of the request's end is
//    not sent; the client asks again;
//  * a COMMAND rides directly on an answer to the same client; otherwise it waits until the channel
//    is free, nobody's answer is due, and the last COMMAND's window for its ACK is over;
//  * at most one ERROR goes out in a window: garbled requests must not fill the channel.
//
// One thread. Same calls, same bytes.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "protocol/decoder.h"
#include "server/engine/service.h"

namespace pheromone::swarm {

struct ServerTiming {
  int64_t delay_ns = 2'000'000;             ///< from the request's end to the modem's key (D_s)
  int64_t response_window_ns = 50'000'000;  ///< from the request's end to the first bit (W)
};

class EngineStation final : public sim::Station {
 public:
  /// The server's modem joins `medium` as its next station, for the engine's link `link`. `service`
  /// and `medium` outlive the station, and the station the medium's last event.
  EngineStation(engine::Service* service, engine::LinkIndex link, sim::RadioMedium* medium,
                const ServerTiming& timing);

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t time_ns) override;

  /// To be called every millisecond: sends what is due.
  void Step();

  /// Queues messages that the engine sends without a request on this link.
  void Queue(const engine::Outgoing& outgoing);

  /// Answers that could not start within the response window.
  uint64_t late_answers() const { return late_answers_; }
  uint64_t suppressed_errors() const { return suppressed_errors_; }
  uint64_t commands_sent() const { return commands_sent_; }
  const protocol::DecoderCounters& decoder_counters() const { return decoder_.counters(); }

 private:
  struct Answer {
    int64_t not_before_ns = 0;
    int64_t not_after_ns = 0;
    protocol::Message message;
  };

  void QueueAnswer(const protocol::Message& message, int64_t request_end_ns);
  void QueueCommand(const protocol::Message& message);
  void SendAnswers();
  void SendCommand();
  void SendRider(uint8_t id);
  void Send(const protocol::Message& message);
  bool ChannelFree() const;

  engine::Service* service_;
  sim::RadioMedium* medium_;
  ServerTiming timing_;
  protocol::FrameDecoder decoder_;
  std::deque<Answer> answers_;
  std::deque<protocol::Message> commands_;  // at most one a robot
  int64_t last_byte_ns_;
  int64_t ack_until_ns_ = 0;   // a client may be about to acknowledge a COMMAND
  int64_t no_error_until_ns_;  // one was queued a short while ago
  bool command_leaving_ = false;
  uint64_t late_answers_ = 0;
  uint64_t suppressed_errors_ = 0;
  uint64_t commands_sent_ = 0;
  int number_;
  engine::LinkIndex link_;
};

}  // namespace pheromone::swarm
