// One direction of a serial cable in virtual time: bytes put in come out a byte's time later, one
// after the other.
//
//   SerialLine line(9600);
//   line.Put(0xFA, now_ns);
//   while (const auto arrived = line.Get(now_ns)) { Use(arrived->byte, arrived->time_ns); }
//
// Times are int64_t nanoseconds and do not decrease from call to call. Nothing is lost, and any
// number of bytes waits. One thread.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>

namespace pheromone::sim {

class SerialLine {
 public:
  struct Arrival {
    uint8_t byte;
    int64_t time_ns;  ///< when its stop bit ended
  };

  /// 8N1: ten bits a byte.
  explicit SerialLine(int64_t baud) : byte_ns_(10'000'000'000 / baud) {}

  void Put(uint8_t byte, int64_t time_ns) {
    end_ns_ = std::max(end_ns_, time_ns) + byte_ns_;
    underway_.push_back({byte, end_ns_});
  }

  /// The next byte that has arrived by `time_ns`.
  std::optional<Arrival> Get(int64_t time_ns) {
    if (underway_.empty() || underway_.front().time_ns > time_ns) {
      return std::nullopt;
    }
    const Arrival arrival = underway_.front();
    underway_.pop_front();
    return arrival;
  }

 private:
  int64_t byte_ns_;
  int64_t end_ns_ = 0;  // of the last byte put in
  std::deque<Arrival> underway_;
};

}  // namespace pheromone::sim
