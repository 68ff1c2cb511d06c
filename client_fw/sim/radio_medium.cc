#include "client_fw/sim/radio_medium.h"

#include <algorithm>
#include <cassert>

namespace pheromone::sim {
namespace {

constexpr int64_t kBitsAByte = 10;  // start, eight, stop
constexpr int64_t kSecond = 1'000'000'000;

}  // namespace

RadioMedium::RadioMedium(const RadioConfig& config) : config_(config), random_(config.seed) {
  assert(config.baud > 0 && config.turnaround_ns >= 0);
}

int RadioMedium::AddStation(Station* station) {
  transmitters_.emplace_back();
  transmitters_.back().station = station;
  return static_cast<int>(transmitters_.size()) - 1;
}

void RadioMedium::Transmit(int station, std::span<const uint8_t> bytes) {
  if (bytes.empty()) {
    return;
  }
  Transmitter& transmitter = transmitters_[static_cast<size_t>(station)];
  transmitter.blocks.push_back(Block{{bytes.begin(), bytes.end()}, {}});
  if (transmitter.blocks.size() == 1) {
    BeginBlock(&transmitter, now_ns_ + config_.turnaround_ns);
  }
}

void RadioMedium::AdvanceTo(int64_t time_ns) {
  assert(time_ns >= now_ns_);
  for (;;) {
    size_t next = transmitters_.size();
    int64_t earliest = kNever;
    for (size_t i = 0; i < transmitters_.size(); ++i) {
      if (EventTimeOf(transmitters_[i]) < earliest) {
        earliest = EventTimeOf(transmitters_[i]);
        next = i;
      }
    }
    if (earliest > time_ns) {
      now_ns_ = time_ns;
      return;
    }
    now_ns_ = earliest;
    if (transmitters_[next].on_air) {
      EndByte(next);
    } else {
      GoOnAir(next);
    }
  }
}

int64_t RadioMedium::NextEventTime() const {
  int64_t earliest = kNever;
  for (const Transmitter& transmitter : transmitters_) {
    earliest = std::min(earliest, EventTimeOf(transmitter));
  }
  return earliest;
}

bool RadioMedium::Busy(int station) const {
  return Sending(station) || (config_.carrier_detect && OthersOnAir(static_cast<size_t>(station)));
}

bool RadioMedium::Sending(int station) const {
  return !transmitters_[static_cast<size_t>(station)].blocks.empty();
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

void RadioMedium::BeginBlock(Transmitter* transmitter, int64_t start_ns) {
  transmitter->start_ns = start_ns;
  transmitter->byte_start_ns = start_ns;
  transmitter->byte = 0;
  transmitter->block_collides = false;
}

void RadioMedium::GoOnAir(size_t number) {
  Transmitter& transmitter = transmitters_[number];
  for (size_t i = 0; i < transmitters_.size(); ++i) {
    Transmitter& other = transmitters_[i];
    // A byte of another that ends at this very moment is over before this station begins.
    if (i != number && other.on_air && EventTimeOf(other) > now_ns_) {
      other.byte_collides = true;
    }
  }
  transmitter.byte_collides = OthersGoOn(number);
  transmitter.on_air = true;
  if (on_air_++ == 0) {
    busy_since_ns_ = now_ns_;
  }
  StartBlock(&transmitter);
}

// Whether another station is on the air now and will be in the next moment.
bool RadioMedium::OthersGoOn(size_t number) const {
  for (size_t i = 0; i < transmitters_.size(); ++i) {
    const Transmitter& other = transmitters_[i];
    if (i != number && other.on_air &&
        (EventTimeOf(other) > now_ns_ || other.blocks.size() > 1 ||
         other.byte + 1 < other.blocks.front().bytes.size())) {
      return true;
    }
  }
  return false;
}

void RadioMedium::StartBlock(Transmitter* transmitter) {
  ++counters_.blocks;
  Block& block = transmitter->blocks.front();
  block.lost_for.resize(transmitters_.size());
  for (size_t i = 0; i < transmitters_.size(); ++i) {
    if (&transmitters_[i] != transmitter && Happens(config_.block_loss)) {
      block.lost_for[i] = true;
      ++counters_.lost_blocks;
    }
  }
}

void RadioMedium::EndByte(size_t number) {
  Transmitter& transmitter = transmitters_[number];
  ++counters_.bytes;
  counters_.airtime_ns += now_ns_ - transmitter.byte_start_ns;
  const int64_t begin_ns = transmitter.byte_start_ns;
  const Block& block = transmitter.blocks.front();
  uint8_t byte = block.bytes[transmitter.byte];
  if (transmitter.byte_collides) {
    ++counters_.collided_bytes;
    transmitter.block_collides = true;
    byte = Mangle(byte);
  }
  const std::vector<bool> lost_for = block.lost_for;
  ++transmitter.byte;
  transmitter.byte_start_ns = now_ns_;
  bool finished = false;
  if (transmitter.byte == block.bytes.size()) {
    counters_.collided_blocks += transmitter.block_collides ? 1 : 0;
    transmitter.blocks.pop_front();
    if (transmitter.blocks.empty()) {
      finished = true;
      transmitter.on_air = false;
      transmitter.deaf_until_ns = now_ns_;
      if (--on_air_ == 0) {
        busy_ns_ += now_ns_ - busy_since_ns_;
      }
    } else {
      BeginBlock(&transmitter, now_ns_);
      StartBlock(&transmitter);
    }
  }
  transmitter.byte_collides = OthersGoOn(number);
  Station* const station = transmitter.station;
  Deliver(number, byte, begin_ns, lost_for);  // invalidates nothing: callbacks only add blocks
  if (finished) {
    station->OnTransmitted(now_ns_);
  }
}

void RadioMedium::Deliver(size_t from, uint8_t byte, int64_t begin_ns,
                          const std::vector<bool>& lost_for) {
  // Who was sending is settled before anybody can react to the byte.
  std::vector<size_t> listeners;
  for (size_t i = 0; i < transmitters_.size(); ++i) {
    const Transmitter& listener = transmitters_[i];
    const bool deaf = !listener.blocks.empty() || listener.deaf_until_ns > begin_ns;
    if (i != from && !deaf && !(i < lost_for.size() && lost_for[i])) {
      listeners.push_back(i);
    }
  }
  for (const size_t i : listeners) {
    uint8_t heard = byte;
    if (Happens(config_.byte_error)) {
      heard = Mangle(heard);
      ++counters_.damaged_bytes;
    }
    transmitters_[i].station->OnByte(heard, now_ns_);
  }
}

bool RadioMedium::OthersOnAir(size_t number) const {
  return on_air_ > (transmitters_[number].on_air ? 1 : 0);
}

// Draws only where there is something to draw, so that switching one kind of damage on leaves the
// other's sequence alone when it is off.
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
