// What a robot really sends, whoever's ID is in it: an ear beside its modem, which hears nobody
// else, so that nothing collides there.
//
//   Observer observer(/*is_signed=*/true);
//   observer.Join(&medium);
//   medium.Hide(observer.station(), ...);          // from all but the robot
//   observer.changes(); observer.acks();
//
// A change counts as acknowledged when the robot's next one has the next number and there was no
// HELLO in between (protocol/README.md, section 7); before that its outcome is unknown. Of signed
// frames the signature is left out, and not looked at. One thread.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "protocol/decoder.h"
#include "protocol/messages.h"

namespace pheromone::attack {

/// The corner of a cell: column and row from the origin of coordinates, 100 mm apart.
struct Node {
  int column = 0;
  int row = 0;
  auto operator<=>(const Node&) const = default;
};
Node NodeNear(int64_t x_mm, int64_t y_mm);

/// TRACEs with different numbers, by where they leave something.
struct Changes {
  int64_t made = 0;
  int64_t acknowledged = 0;  ///< of them
};

class Observer final : public sim::Station {
 public:
  explicit Observer(bool is_signed) : is_signed_(is_signed) {}
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  void Join(sim::RadioMedium* medium) { station_ = medium->AddStation(this); }
  int station() const { return station_; }

  void OnByte(uint8_t byte, int64_t time_ns) override;
  void OnTransmitted(int64_t /*time_ns*/) override {}

  const std::map<Node, Changes>& changes() const { return changes_; }
  /// Those of one command in succession count once.
  const std::vector<protocol::CommandAck>& acks() const { return acks_; }

 private:
  void OnFrame(protocol::Message message);
  void OnChange(const protocol::Message& message);

  bool is_signed_;
  int station_ = -1;
  protocol::FrameDecoder decoder_{20};
  std::optional<protocol::Message> last_;  // the last mutating request, and where that is
  std::optional<Node> node_;
  bool said_hello_ = false;  // since
  std::map<Node, Changes> changes_;
  std::vector<protocol::CommandAck> acks_;
};

}  // namespace pheromone::attack
