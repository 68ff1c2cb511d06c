// The server's UDP link, by Wi-Fi or Ethernet.
//
//   WiFiUDP udp;
//   PheromoneUdp<WiFiUDP> link(udp, IPAddress(192, 168, 4, 1), 4950);
//
// `Udp` is a class like Arduino's UDP. The network is the sketch's to join, before robot.begin;
// while it is away, frames are lost, the robot stands, and then goes on.
//
// A frame is a datagram; those of others than the server are dropped. Ours ends when the robot asks
// whether all it put has left, which it does after the last byte of a frame only.
#pragma once

#include <Arduino.h>
#include <IPAddress.h>

#include "client_fw/boards/arduino/link.h"

namespace pheromone {
namespace arduino {

template <class Udp>
// NOLINTNEXTLINE(cppcoreguidelines-virtual-class-destructor): it is never deleted
class PheromoneUdp final : public PheromoneLink {
 public:
  /// `udp` must outlive the link.
  PheromoneUdp(Udp& udp, IPAddress server, uint16_t port, uint16_t own_port = 4951)
      : udp_(&udp), server_(server), port_(port), own_port_(own_port) {}

  void begin(client::Parameters* parameters) override {
    parameters->buffered_link = true;
    parameters->gap_timeout_ms = 0;
    parameters->rounds = false;
    udp_->begin(own_port_);
  }

  int get() override {
    // What is left of a datagram comes first.
    if (udp_->available() <= 0 && (udp_->parsePacket() <= 0 || !IsFromServer())) {
      while (udp_->available() > 0) {  // an ESP32 has no next one before
        udp_->read();
      }
      return -1;  // the next turn of the loop has the next one
    }
    return udp_->read();
  }

  bool put(uint8_t byte) override {
    if (!open_) {
      open_ = true;
      udp_->beginPacket(server_, port_);
    }
    udp_->write(byte);  // one that does not fit makes a damaged frame, which is repeated
    return true;
  }

  bool idle() override {
    if (open_) {
      open_ = false;
      udp_->endPacket();
    }
    return true;
  }

  bool busy() override { return false; }

 private:
  bool IsFromServer() { return udp_->remoteIP() == server_ && udp_->remotePort() == port_; }

  Udp* udp_;
  IPAddress server_;
  uint16_t port_;
  uint16_t own_port_;
  bool open_ = false;
};

}  // namespace arduino
}  // namespace pheromone
