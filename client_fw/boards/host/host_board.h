// The board of robots that run on a host: two rings of bytes and a clock set from outside. The same
// object serves the simulation (virtual time, radio medium) and live programs (a socket or a pty).
//
// The robot's side is the Board concept of client_fw/core/robot.h. The other side belongs to the
// host program, in the same thread:
//
//   board.set_millis(now);
//   board.Receive(bytes, size);                             // what came in
//   robot.Step();
//   size = board.TakeTransmission(buffer, sizeof buffer);   // what is to go out, if not 0
//   ... later, when it is out: board.OnTransmitted();
#pragma once

#include <stddef.h>
#include <stdint.h>

#include <vector>

#include "client_fw/core/base/moment.h"
#include "client_fw/core/steering/diagnostics.h"

namespace pheromone {
namespace client {

/// A ring of `kCapacity` bytes. Not for use across threads.
template <size_t kCapacity>
class ByteRing {
 public:
  bool Put(uint8_t byte) {
    if (size_ == kCapacity) {
      return false;
    }
    bytes_[(first_ + size_) % kCapacity] = byte;
    ++size_;
    return true;
  }

  /// The oldest byte, or -1.
  int Get() {
    if (size_ == 0) {
      return -1;
    }
    const uint8_t byte = bytes_[first_];
    first_ = (first_ + 1) % kCapacity;
    --size_;
    return byte;
  }

  size_t size() const { return size_; }

 private:
  size_t first_ = 0;
  size_t size_ = 0;
  uint8_t bytes_[kCapacity] = {};
};

class HostBoard {
 public:
  // The robot's side.
  int radio_get() { return received_.Get(); }
  bool radio_put(uint8_t byte) { return outgoing_.Put(byte); }
  bool radio_tx_idle() const { return !leaving_ && outgoing_.size() == 0; }
  bool channel_busy() const { return carrier_ || !radio_tx_idle(); }
  Moment millis() const { return now_ms_; }
  void set_load(bool load) { load_ = load; }
  void set_led(bool on) { led_ = on; }
  uint16_t diagnostic(uint8_t id) const {
    return id == kRadioOverruns ? static_cast<uint16_t>(overruns_) : uint16_t{0};
  }
  void save_settings(const uint8_t* bytes, uint8_t size) { settings_.assign(bytes, bytes + size); }

  // The host's side.
  void set_millis(Moment now_ms) { now_ms_ = now_ms; }
  /// Carrier detect; always false if the link has none.
  void set_carrier(bool carrier) { carrier_ = carrier; }

  /// Bytes that do not fit are lost and counted, as on a UART that is not read.
  void Receive(uint8_t byte) {
    if (!received_.Put(byte)) {
      ++overruns_;
    }
  }
  void Receive(const uint8_t* bytes, size_t size) {
    for (size_t i = 0; i < size; ++i) {
      Receive(bytes[i]);
    }
  }

  /// Moves the bytes that the robot wants to send to `to` and returns their number, at most
  /// `capacity`. From then on until OnTransmitted the radio is not idle; meanwhile, no more bytes
  /// are returned.
  size_t TakeTransmission(uint8_t* to, size_t capacity) {
    size_t size = 0;
    if (!leaving_) {
      while (size < capacity && outgoing_.size() != 0) {
        to[size++] = static_cast<uint8_t>(outgoing_.Get());
      }
      leaving_ = size != 0;
    }
    return size;
  }
  void OnTransmitted() { leaving_ = false; }

  uint32_t overruns() const { return overruns_; }
  /// Whether the robot holds its load.
  bool load() const { return load_; }
  bool led() const { return led_; }
  /// Packed client::Settings as last saved; empty if never.
  const std::vector<uint8_t>& settings() const { return settings_; }

 private:
  ByteRing<4096> received_;
  ByteRing<256> outgoing_;
  Moment now_ms_ = 0;
  uint32_t overruns_ = 0;
  bool carrier_ = false;
  bool leaving_ = false;
  bool load_ = false;
  bool led_ = false;
  std::vector<uint8_t> settings_;
};

}  // namespace client
}  // namespace pheromone
