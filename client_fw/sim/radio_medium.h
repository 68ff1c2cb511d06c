// A half-duplex radio channel shared by all stations, in virtual time: bytes with their exact end
// times, collisions as received by each listener, hidden stations, deafness while sending, carrier,
// and seeded damage.
//
//   RadioMedium medium(config);
//   const int a = medium.AddStation(&station);
//   medium.Transmit(a, bytes);               // goes on the air after the turnaround
//   medium.AdvanceTo(medium.now_ns() + 1'000'000);
//
// Rules:
//  * a block given to Transmit is on the air from the station's turnaround later, ten bits a byte,
//    without gaps; what is given while the station is still sending follows directly;
//  * everything arrives `propagation_ns` after it left, at every listener alike;
//  * from Transmit until its last byte is sent, and while it is keyed, a station receives nothing,
//    not even a byte of which it missed a part;
//  * a transmitter that is keyed by a line is on the air from Key to Key, whatever it sends;
//  * a byte arrives mangled at a listener if another station in its range was on the air meanwhile,
//    however briefly. Two stations hidden from each other may thus collide at a third without
//    noticing. There is no capture effect: the nearer of two stations is not received either,
//    unlike with many real FM receivers;
//  * the carrier of others shows, and vanishes, `carrier_delay_ns` after the bits themselves.
//
// Time is int64_t nanoseconds. Byte k of a block ends at start + (k + 1) * 10 / baud, rounded down:
// no drift. At the same time carriers change first, then bytes arrive, then stations continue to
// send, in the order of their numbers. Everything is determined by the calls and the seed. One
// thread. Callbacks may call Transmit and Busy.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <optional>
#include <random>
#include <span>
#include <vector>

namespace pheromone::sim {

/// Of a simulated swarm. Robots have IDs of their own, whatever their channel.
constexpr int kMaxRobots = 254;
constexpr int kMaxChannels = 16;

/// A station with a modem on the channel.
class Station {
 public:
  virtual ~Station() = default;
  /// A byte ended at `time_ns`; it may be damaged.
  virtual void OnByte(uint8_t byte, int64_t time_ns) = 0;
  /// The last byte of everything given to Transmit was sent.
  virtual void OnTransmitted(int64_t time_ns) = 0;
};

/// A transmitter that is keyed by a line.
struct KeyedModem {
  int64_t rise_ns = 0;  ///< from being keyed until it can send
  int64_t hold_ns = 0;  ///< a bit leaves so long after it came
};

struct RadioConfig {
  int64_t baud = 9600;
  int64_t turnaround_ns = 2'000'000;  ///< from Transmit to the first bit
  int64_t propagation_ns = 0;         ///< from a sender's bit to a listener's
  bool carrier_detect = true;         ///< Busy reports others on the air
  int64_t carrier_delay_ns = 0;       ///< until a modem reports that they are, or no longer are
  double byte_error = 0;              ///< probability that a listener gets a byte wrong
  double bit_error = 0;    ///< probability that a listener gets a data bit of a byte wrong
  double burst_bytes = 1;  ///< mean length of the runs of bytes that byte_error damages
  double block_loss = 0;   ///< probability that a listener misses a block altogether
  /// Besides, if set: the probability that a byte from one station arrives wrong at another.
  std::function<double(int from, int to, int64_t time_ns)> path_error{};
  uint64_t seed = 1;
};

struct RadioCounters {
  uint64_t blocks = 0;           ///< that went on the air
  uint64_t bytes = 0;            ///< that went on the air
  uint64_t collided_blocks = 0;  ///< of the blocks: overlapped by another, whoever hears both
  uint64_t collided_bytes = 0;
  uint64_t damaged_bytes = 0;  ///< by byte_error and bit_error, per listener
  uint64_t lost_blocks = 0;    ///< by block_loss, per listener
  int64_t airtime_ns = 0;      ///< sum over the blocks' bytes that have ended
};

class RadioMedium {
 public:
  static constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

  explicit RadioMedium(const RadioConfig& config);

  /// `station` must outlive the medium. Returns its number. `turnaround_ns`, if given, is that of
  /// this station's modem.
  int AddStation(Station* station, std::optional<int64_t> turnaround_ns = std::nullopt);

  /// From now on these two neither receive each other nor detect each other's carrier.
  void Hide(int station, int from);

  /// Sends `bytes`, which are copied; none is a no-op.
  void Transmit(int station, std::span<const uint8_t> bytes);

  /// Keys the station's transmitter, or ends that; with bytes on the air, after these.
  void Key(int station, bool on);

  /// Processes all events up to and including `time_ns`, which is not before now.
  void AdvanceTo(int64_t time_ns);

  int64_t now_ns() const { return now_ns_; }
  /// The time of the next event, kNever if there is none.
  int64_t NextEventTime() const;

  /// Carrier as reported by the station's modem: another station in its range is on the air (with
  /// carrier detect), or the station itself is sending or keyed.
  bool Busy(int station) const;
  /// From Transmit to the last byte.
  bool Sending(int station) const;

  int64_t turnaround_ns(int station) const;
  /// Of stations that do not have one of their own.
  int64_t default_turnaround_ns() const { return config_.turnaround_ns; }
  int64_t baud() const { return config_.baud; }
  int64_t byte_ns() const;
  const RadioCounters& counters() const { return counters_; }
  /// The share of the time since 0 in which at least one station was on the air.
  double Utilisation() const;

 private:
  using Stations = std::vector<bool>;  // by number

  struct Block {
    std::vector<uint8_t> bytes;
    Stations lost_for;
  };
  struct Transmitter {
    Station* station = nullptr;
    int64_t turnaround_ns = 0;
    Stations hidden;           // from it
    std::deque<Block> blocks;  // the first is on the air, or will be
    bool keyed = false;
    bool on_air = false;
    int64_t start_ns = 0;       // of the first block
    int64_t byte_start_ns = 0;  // of the byte in progress
    size_t byte = 0;            // in progress
    Stations met;               // others on the air during the byte in progress
    bool block_collides = false;
    int64_t deaf_until_ns = -1;  // end of its last transmission
    bool in_burst = false;       // of damaged bytes that it receives
    bool carrier = false;        // as others see it
  };
  struct CarrierEdge {
    int64_t time_ns;
    size_t station;
    bool on;
  };
  struct Arrival {
    int64_t begin_ns;  // at the listener
    int64_t end_ns;
    size_t from;
    uint8_t byte;
    uint8_t mangled;  // what those hear who heard another too
    Stations met;
    Stations lost_for;
  };

  int64_t EventTimeOf(const Transmitter& transmitter) const;
  bool GoesOn(const Transmitter& transmitter) const;
  void GoOnAir(size_t number);
  void Radiate(size_t number);
  void FallSilent(size_t number);
  void EndByte(size_t number);
  void BeginBlock(Transmitter* transmitter, int64_t start_ns);
  void StartBlock(size_t number);
  void MeetOthers(size_t number);
  void ShowCarrier(size_t number, bool on);
  void Deliver(const Arrival& arrival);
  bool Hears(size_t listener, size_t speaker) const;
  bool Collides(const Arrival& arrival, size_t listener) const;
  uint8_t Damaged(uint8_t byte, size_t from, size_t listener);
  bool HappensInBursts(bool* in_burst);
  bool Happens(double probability);
  uint8_t Mangle(uint8_t byte);

  RadioConfig config_;
  std::vector<Transmitter> transmitters_;
  std::deque<CarrierEdge> edges_;  // in the order of time, as the delay is the same for all
  std::deque<Arrival> arrivals_;   // likewise
  RadioCounters counters_;
  std::mt19937_64 random_;
  int64_t now_ns_ = 0;
  int64_t busy_ns_ = 0;        // in completed spells of a used channel
  int64_t busy_since_ns_ = 0;  // start of the spell in progress, if on_air_ > 0
  int on_air_ = 0;
};

}  // namespace pheromone::sim
