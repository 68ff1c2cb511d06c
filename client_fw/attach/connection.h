// A connection to a robot or to a modem: bytes in both directions, without blocking. It opens
// itself, and again whenever it is lost.
//
//   Connection robot(address);
//   for (;;) {
//     robot.Advance(now_ms);                    // opens it when that is due
//     for (auto bytes = robot.Read(now_ms); !bytes.empty(); bytes = robot.Read(now_ms)) ...
//     robot.Write(command, now_ms);
//     ... poll(robot.descriptor(), robot.poll_events()), at most a millisecond ...
//   }
//
// Lost is: a serial port that was unplugged, a TCP connection that was closed, and a TCP or UDP
// connection on which nothing was received for kSilentMs, since a cut network tells nobody.
// Attempts are kRetryMs apart. Bytes that cannot be written at once are lost, as on a cable without
// a robot: what is old must not reach a robot later.
//
// A serial port sends at its bit rate. A network or a pseudo-terminal has none, unless the address
// says that a real line follows behind it (Address::paced).
//
// Times are milliseconds of any clock that begins at 0 or later. One thread.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client_fw/attach/address.h"
#include "server/base/descriptor.h"
#include "server/base/result.h"

namespace pheromone::attach {

/// Between attempts to open, and how long an attempt may take.
constexpr int64_t kRetryMs = 500;
constexpr int64_t kConnectMs = 2000;
/// Without a byte for so long, TCP and UDP are connected again. Robots and servers speak more
/// often.
constexpr int64_t kSilentMs = 3000;

/// The bit rates of a serial port.
std::span<const uint32_t> SerialRates();

class Connection {
 public:
  explicit Connection(Address address);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void Advance(int64_t now_ms);

  /// What was received, valid until the next call; empty if nothing is left.
  std::span<const uint8_t> Read(int64_t now_ms);
  /// All in one call of the system: on UDP, one datagram.
  void Write(std::span<const uint8_t> bytes, int64_t now_ms);
  /// Changes the rate of an open serial port, and of the next one. False: it cannot have this rate.
  bool SetBaud(uint32_t baud);
  /// From now on with another place; what has not left for the one before is forgotten.
  void MoveTo(const Address& address, int64_t now_ms);
  /// Everything written has left, at the bit rate of the line if it has one.
  bool drained(int64_t now_ms) const;

  /// Bytes come one by one at the bit rate of the address.
  bool paced() const { return paced_; }
  /// Open. After a silence not before a byte was received, so that one that is silent again and
  /// again is not reported each time.
  bool up() const { return descriptor_.valid() && !connecting_ && !doubtful_; }
  /// Why it is not up; empty before the first attempt has ended.
  const std::string& trouble() const { return trouble_; }
  /// It is a terminal that another program has, whom `trouble` names.
  bool in_use() const { return in_use_; }
  /// How often it was opened.
  uint64_t openings() const { return openings_; }
  /// How often it was lost.
  uint64_t losses() const { return losses_; }
  /// How often a network said that nobody is there, or that the connection has ended; also of UDP,
  /// which is up nevertheless: its server may come.
  uint64_t refusals() const { return refusals_; }
  const Address& address() const { return address_; }

  /// For poll(2); the descriptor is -1 while there is none.
  int descriptor() const { return descriptor_.get(); }
  short poll_events() const;

 private:
  void Open(int64_t now_ms);
  Status OpenSerial();
  Status OpenSocket();
  void FinishConnect(int64_t now_ms);
  void Lose(const std::string& why, int64_t now_ms);
  void Refuse(const std::string& why, int64_t now_ms);
  void Close();

  Address address_;
  Descriptor descriptor_;
  bool connecting_ = false;
  bool doubtful_ = false;
  bool in_use_ = false;
  bool paced_ = false;  // a line with a bit rate
  std::string trouble_;
  uint64_t openings_ = 0;
  uint64_t losses_ = 0;
  uint64_t refusals_ = 0;
  int64_t next_try_ms_ = 0;
  int64_t since_ms_ = 0;  // the attempt began, or something was received
  int64_t drained_ms_ = 0;
  std::array<uint8_t, 512> buffer_{};
};

}  // namespace pheromone::attach
