// The server on a radio channel, in virtual time: the engine's service as one more station of the
// medium, by the same radio::Channel as the daemon's links.
//
//   ServerStation server(&service, 0, config.links[0], &medium, timing);
//   server.AdvanceTo(medium.now_ns() + 1'000'000);      // advances the medium, too
//
// One thread. Same calls, same bytes.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "server/core/engine/service/service.h"
#include "server/robots/radio/channel.h"
#include "server/robots/signing/signing.h"

namespace pheromone::swarm {

struct ServerTiming {
  int64_t delay_ns = 2'000'000;  ///< from reading a request until its answer is there
  int64_t adapter_ns = 0;        ///< for how long received bytes are held back
  bool keyed = false;            ///< the server's modem is keyed by a line, not by the first byte
  int64_t lead_ns = 0;           ///< keyed: from keying to the first byte
  int64_t tail_ns = 0;           ///< keyed: from the last bit to unkeying
  /// If set: when a change that was read then is on disk, before which it is not answered.
  std::function<int64_t(int64_t read_ns)> durable_at{};
};

/// What a simulated server draws nonces and keys from.
signing::Signing::Random SeededRandom(uint64_t seed);

class ServerStation final : public sim::Station {
 public:
  /// The server's modem joins `medium` as its next station, for the engine's link `link`, which
  /// announces `announced`. `service` and `medium` outlive the station, and the station the
  /// medium's last event. `signing`: of this link; null: it is not signed.
  ServerStation(engine::Service* service, engine::LinkIndex link,
                const engine::LinkSettings& announced, sim::RadioMedium* medium,
                const ServerTiming& timing, signing::Signing* signing = nullptr);

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t /*time_ns*/) override {}

  /// Advances the medium, and sends what is due meanwhile.
  void AdvanceTo(int64_t time_ns);

  /// Queues messages that the engine sends without a request on this link.
  void Queue(const engine::Outgoing& outgoing);

  /// Its number on the medium.
  int station() const { return number_; }
  radio::ChannelCounters counters() const { return channel_.counters(); }
  const protocol::DecoderCounters& decoder_counters() const {
    return channel_.decoder().counters();
  }

 private:
  struct Pending {
    int64_t at_ns;  ///< when the answer is there
    radio::Time asked_at;
    protocol::Message message;
  };

  int64_t AnswerAt(const protocol::Message& answer) const;
  void NoteChanges(const std::vector<protocol::Message>& messages);
  int64_t NextStep();
  void Act();
  void Transmit(radio::Time begin);
  void Read();

  engine::Service* service_;
  sim::RadioMedium* medium_;
  ServerTiming timing_;
  radio::Channel channel_;
  std::vector<uint8_t> held_;  // by the adapter
  int64_t read_at_ns_ = sim::RadioMedium::kNever;
  std::deque<Pending> pending_;  // by at_ns
  struct Change {
    uint8_t opcode = 0;
    uint16_t crc = 0;
    int64_t durable_ns = 0;
  };
  std::map<uint8_t, Change> changes_;               // the last one of each robot, with durable_at
  int64_t look_at_ns_ = 0;                          // at the carrier, again
  std::optional<radio::Time> keyed_;                // when, before the first byte
  int64_t unkey_at_ns_ = sim::RadioMedium::kNever;  // after the last one
  int number_;
  engine::LinkIndex link_;
};

}  // namespace pheromone::swarm
