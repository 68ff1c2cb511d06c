#include "client_fw/sim/radio_medium.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace pheromone::sim {
namespace {

constexpr int64_t kBitsAByte = 10;  // start, eight, stop
constexpr int64_t kSecond = 1'000'000'000;

}  // namespace

RadioMedium::RadioMedium(const RadioConfig& config) : config_(config), random_(config.seed) {
  assert(config.baud > 0 && config.turnaround_ns >= 0);
  assert(config.propagation_ns >= 0 && config.carrier_delay_ns >= 0);
}

int RadioMedium::AddStation(Station* station, std::optional<int64_t> turnaround_ns) {
  transmitters_.emplace_back();
  transmitters_.back().station = station;
  transmitters_.back().turnaround_ns = turnaround_ns.value_or(config_.turnaround_ns);
  for (Transmitter& transmitter : transmitters_) {
    transmitter.hidden.resize(transmitters_.size());
    transmitter.met.resize(transmitters_.size());
  }
  return static_cast<int>(transmitters_.size()) - 1;
}

void RadioMedium::Hide(int station, int from) {
  const auto a = static_cast<size_t>(station);
  const auto b = static_cast<size_t>(from);
  transmitters_[a].hidden[b] = true;
  transmitters_[b].hidden[a] = true;
}

void RadioMedium::Transmit(int station, std::span<const uint8_t> bytes) {
  if (bytes.empty()) {
    return;
  }
  Transmitter& transmitter = transmitters_[static_cast<size_t>(station)];
  transmitter.blocks.push_back(Block{{bytes.begin(), bytes.end()}, {}});
  if (transmitter.blocks.size() == 1) {
    BeginBlock(&transmitter, now_ns_ + transmitter.turnaround_ns);
  }
}

void RadioMedium::Key(int station, bool on) {
  const auto number = static_cast<size_t>(station);
  Transmitter& transmitter = transmitters_[number];
  if (transmitter.keyed == on) {
    return;
  }
  transmitter.keyed = on;
  if (!transmitter.on_air) {
    if (on) {
      Radiate(number);
    } else {
      FallSilent(number);
    }
  }
}

void RadioMedium::AdvanceTo(int64_t time_ns) {
  assert(time_ns >= now_ns_);
  for (;;) {
    const int64_t earliest = NextEventTime();
    if (earliest > time_ns) {
      now_ns_ = time_ns;
      return;
    }
    now_ns_ = earliest;
    if (!edges_.empty() && edges_.front().time_ns == now_ns_) {
      transmitters_[edges_.front().station].carrier = edges_.front().on;
      edges_.pop_front();
    } else if (!arrivals_.empty() && arrivals_.front().end_ns == now_ns_) {
      const Arrival arrival = std::move(arrivals_.front());
      arrivals_.pop_front();
      Deliver(arrival);
    } else {
      const auto next = std::find_if(transmitters_.begin(), transmitters_.end(),
                                     [&](const auto& t) { return EventTimeOf(t) == now_ns_; });
      const auto number = static_cast<size_t>(next - transmitters_.begin());
      if (next->on_air) {
        EndByte(number);
      } else {
        GoOnAir(number);
      }
    }
  }
}

int64_t RadioMedium::NextEventTime() const {
  int64_t earliest = kNever;
  if (!edges_.empty()) {
    earliest = edges_.front().time_ns;
  }
  if (!arrivals_.empty()) {
    earliest = std::min(earliest, arrivals_.front().end_ns);
  }
  for (const Transmitter& transmitter : transmitters_) {
    earliest = std::min(earliest, EventTimeOf(transmitter));
  }
  return earliest;
}

bool RadioMedium::Busy(int station) const {
  if (Sending(station) || transmitters_[static_cast<size_t>(station)].keyed) {
    return true;
  }
  if (config_.carrier_detect) {
    for (size_t i = 0; i < transmitters_.size(); ++i) {
      if (transmitters_[i].carrier && Hears(static_cast<size_t>(station), i)) {
        return true;
      }
    }
  }
  return false;
}

bool RadioMedium::Sending(int station) const {
  return !transmitters_[static_cast<size_t>(station)].blocks.empty();
}

int64_t RadioMedium::turnaround_ns(int station) const {
  return transmitters_[static_cast<size_t>(station)].turnaround_ns;
}

int64_t RadioMedium::byte_ns() const {
  return kBitsAByte * kSecond / config_.baud;
}

double RadioMedium::Utilisation() const {
  const int64_t busy_ns = busy_ns_ + (on_air_ > 0 ? now_ns_ - busy_since_ns_ : 0);
  return now_ns_ > 0 ? static_cast<double>(busy_ns) / static_cast<double>(now_ns_) : 0;
}

int64_t RadioMedium::EventTimeOf(const Transmitter& transmitter) const {
  if (transmitter.blocks.empty()) {
    return kNever;
  }
  if (!transmitter.on_air) {
    return transmitter.start_ns;
  }
  return transmitter.start_ns +
         static_cast<int64_t>(transmitter.byte + 1) * kBitsAByte * kSecond / config_.baud;
}

// Whether the station is on the air now and will be in the next instant.
bool RadioMedium::GoesOn(const Transmitter& transmitter) const {
  return transmitter.keyed ||
         (transmitter.on_air &&
          (EventTimeOf(transmitter) > now_ns_ || transmitter.blocks.size() > 1 ||
           transmitter.byte + 1 < transmitter.blocks.front().bytes.size()));
}

void RadioMedium::BeginBlock(Transmitter* transmitter, int64_t start_ns) {
  transmitter->start_ns = start_ns;
  transmitter->byte_start_ns = start_ns;
  transmitter->byte = 0;
  transmitter->block_collides = false;
}

void RadioMedium::GoOnAir(size_t number) {
  if (!transmitters_[number].keyed) {
    Radiate(number);
  }
  transmitters_[number].on_air = true;
  MeetOthers(number);
  StartBlock(number);
}

// From now on others' bytes are mangled, and the channel is in use.
void RadioMedium::Radiate(size_t number) {
  for (size_t i = 0; i < transmitters_.size(); ++i) {
    Transmitter& other = transmitters_[i];
    // A byte of another station that ends at this instant is over before this station begins.
    if (i != number && other.on_air && EventTimeOf(other) > now_ns_) {
      other.met[number] = true;
    }
  }
  ShowCarrier(number, true);
  if (on_air_++ == 0) {
    busy_since_ns_ = now_ns_;
  }
}

void RadioMedium::FallSilent(size_t number) {
  ShowCarrier(number, false);
  transmitters_[number].deaf_until_ns = now_ns_;
  if (--on_air_ == 0) {
    busy_ns_ += now_ns_ - busy_since_ns_;
  }
}

// A byte begins: the stations with which it overlaps from the start.
void RadioMedium::MeetOthers(size_t number) {
  for (size_t i = 0; i < transmitters_.size(); ++i) {
    transmitters_[number].met[i] = i != number && GoesOn(transmitters_[i]);
  }
}

void RadioMedium::ShowCarrier(size_t number, bool on) {
  edges_.push_back({now_ns_ + config_.propagation_ns + config_.carrier_delay_ns, number, on});
}

void RadioMedium::StartBlock(size_t number) {
  ++counters_.blocks;
  Block& block = transmitters_[number].blocks.front();
  block.lost_for.resize(transmitters_.size());
  for (size_t i = 0; i < transmitters_.size(); ++i) {
    if (i != number && Happens(config_.block_loss)) {
      block.lost_for[i] = true;
      ++counters_.lost_blocks;
    }
  }
}

void RadioMedium::EndByte(size_t number) {
  Transmitter& transmitter = transmitters_[number];
  const Block& block = transmitter.blocks.front();
  const bool collides =
      std::find(transmitter.met.begin(), transmitter.met.end(), true) != transmitter.met.end();
  const uint8_t byte = block.bytes[transmitter.byte];
  ++counters_.bytes;
  counters_.airtime_ns += now_ns_ - transmitter.byte_start_ns;
  if (collides) {
    ++counters_.collided_bytes;
    transmitter.block_collides = true;
  }
  arrivals_.push_back({transmitter.byte_start_ns + config_.propagation_ns,
                       now_ns_ + config_.propagation_ns, number, byte,
                       collides ? Mangle(byte) : byte, transmitter.met, block.lost_for});
  ++transmitter.byte;
  transmitter.byte_start_ns = now_ns_;
  if (transmitter.byte < block.bytes.size()) {
    MeetOthers(number);
    return;
  }
  counters_.collided_blocks += transmitter.block_collides ? 1 : 0;
  transmitter.blocks.pop_front();
  if (!transmitter.blocks.empty()) {
    BeginBlock(&transmitter, now_ns_);
    StartBlock(number);
    MeetOthers(number);
    return;
  }
  transmitter.on_air = false;
  if (!transmitter.keyed) {
    FallSilent(number);
  }
  transmitter.station->OnTransmitted(now_ns_);
}

void RadioMedium::Deliver(const Arrival& arrival) {
  // The set of senders is determined before any station can react to the byte.
  std::vector<size_t> listeners;
  for (size_t i = 0; i < transmitters_.size(); ++i) {
    const Transmitter& listener = transmitters_[i];
    const bool deaf =
        !listener.blocks.empty() || listener.keyed || listener.deaf_until_ns > arrival.begin_ns;
    const bool lost = i < arrival.lost_for.size() && arrival.lost_for[i];
    if (Hears(i, arrival.from) && !deaf && !lost) {
      listeners.push_back(i);
    }
  }
  for (const size_t i : listeners) {
    const uint8_t byte = Collides(arrival, i) ? arrival.mangled : arrival.byte;
    const uint8_t heard = Damaged(byte, arrival.from, i);
    transmitters_[i].station->OnByte(heard, now_ns_);
  }
}

bool RadioMedium::Hears(size_t listener, size_t speaker) const {
  return listener != speaker && !transmitters_[listener].hidden[speaker];
}

bool RadioMedium::Collides(const Arrival& arrival, size_t listener) const {
  for (size_t other = 0; other < arrival.met.size(); ++other) {
    if (arrival.met[other] && Hears(listener, other)) {
      return true;
    }
  }
  return false;
}

uint8_t RadioMedium::Damaged(uint8_t byte, size_t from, size_t listener) {
  uint8_t heard = byte;
  if (HappensInBursts(&transmitters_[listener].in_burst)) {
    heard = Mangle(heard);
  }
  if (config_.path_error &&
      Happens(config_.path_error(static_cast<int>(from), static_cast<int>(listener), now_ns_))) {
    heard = Mangle(byte);
  }
  for (unsigned bit = 0; bit < 8 && config_.bit_error > 0; ++bit) {
    if (Happens(config_.bit_error)) {
      heard = static_cast<uint8_t>(heard ^ (1u << bit));
    }
  }
  counters_.damaged_bytes += heard != byte ? 1 : 0;
  return heard;
}

// byte_error, as a chain of two states: within a burst, every byte is damaged.
bool RadioMedium::HappensInBursts(bool* in_burst) {
  if (config_.burst_bytes <= 1 || config_.byte_error <= 0) {
    return Happens(config_.byte_error);
  }
  const double begins = config_.byte_error / (config_.burst_bytes * (1 - config_.byte_error));
  *in_burst = Happens(*in_burst ? 1 - 1 / config_.burst_bytes : begins);
  return *in_burst;
}

// Draws random numbers only for enabled kinds of damage, so that enabling one does not change the
// sequence of the other.
bool RadioMedium::Happens(double probability) {
  if (probability <= 0) {
    return false;
  }
  return static_cast<double>(random_() >> 11) * 0x1p-53 < probability;
}

uint8_t RadioMedium::Mangle(uint8_t byte) {
  return static_cast<uint8_t>(byte ^ (1 + random_() % 255));
}

}  // namespace pheromone::sim
