// Admission control of a link: its list of client IDs and its limits of the request rate.
//
//   Admission admission({.clients = ..., .per_client_per_s = 20});
//   switch (admission.Judge(message.id, Clock::now())) { ... }
//
// A rate limit is a virtual schedule (the generic cell rate algorithm of ITU-T I.371): each request
// advances the expected time of the next one by 1/rate, and a request that arrives more than one
// second before its expected time is refused. This permits bursts of one second's worth and limits
// the sustained rate. Refused requests do not advance the schedule.
//
// Time is an argument. Not thread-safe.
#pragma once

#include <array>
#include <bitset>
#include <chrono>
#include <cstdint>

namespace pheromone::links {

struct AdmissionOptions {
  std::bitset<256> clients = std::bitset<256>().set();  ///< the IDs that are served
  uint32_t per_client_per_s = 0;                        ///< 0: no limit
  uint32_t per_link_per_s = 0;                          ///< 0: no limit
  bool operator==(const AdmissionOptions&) const = default;
};

class Admission {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  enum class Verdict { kWelcome, kTooMany, kNotAllowed };

  explicit Admission(const AdmissionOptions& options) : options_(options) {}

  /// Whether any limit is configured.
  bool open() const {
    return options_.clients.all() && options_.per_client_per_s == 0 && options_.per_link_per_s == 0;
  }

  bool Allows(uint8_t id) const { return options_.clients.test(id); }

  /// Judges a request and, if it is admitted, advances the schedule.
  Verdict Judge(uint8_t id, TimePoint now);

 private:
  const AdmissionOptions options_;
  std::array<TimePoint, 256> expected_{};  // by client ID
  TimePoint link_expected_{};
};

}  // namespace pheromone::links
