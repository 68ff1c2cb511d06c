#include "client_fw/swarm/channel_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pheromone::swarm {
namespace {

constexpr int64_t kSecond = 1'000'000'000;
constexpr int64_t kNsPerMs = 1'000'000;

uint8_t RoundedUpToMs(int64_t ns) {
  return static_cast<uint8_t>(std::clamp<int64_t>((ns + kNsPerMs - 1) / kNsPerMs, 1, 255));
}

double Seconds(int64_t ns) {
  return static_cast<double>(ns) / kSecond;
}

// Exchanges a second if each of n stations begins in any slot with probability p.
double Throughput(double p, int n, double slot_s, double exchange_s, double collision_s) {
  const double others_silent = std::pow(1 - p, n - 1);
  const double idle = others_silent * (1 - p);
  const double success = n * p * others_silent;
  return success / (idle * slot_s + success * exchange_s + (1 - idle - success) * collision_s);
}

}  // namespace

radio::Timing ChannelTiming::Server() const {
  radio::Timing timing;
  timing.byte = radio::ByteTime(baud);
  timing.turnaround = radio::Duration(turnaround_ns);
  timing.keyed = keyed;
  timing.lead = radio::Duration(lead_ns);
  timing.adapter = radio::Duration(adapter_ns);
  timing.processing = radio::Duration(server_delay_ns);
  return timing;
}

int64_t ChannelTiming::byte_ns() const {
  return radio::ByteTime(baud).count();
}

int64_t ChannelTiming::response_window_ns() const {
  return Server().ResponseWindow().count();
}

int64_t ChannelTiming::slot_ns() const {
  return turnaround_ns + (carrier_detect ? 0 : byte_ns());
}

engine::LinkSettings ChannelTiming::Link(std::string name) const {
  return {std::move(name), RoundedUpToMs(slot_ns()), RoundedUpToMs(response_window_ns())};
}

double ChannelTiming::PeakRate(const ExchangeSize& size) const {
  return 1 / Seconds((size.request + size.answer) * byte_ns() + turnaround_ns +
                     Server().KeyDelay().count());
}

double ChannelTiming::IdealRate(const ExchangeSize& size, int stations) const {
  const int64_t request_ns = turnaround_ns + size.request * byte_ns();
  const radio::Timing timing = Server();
  const int64_t begin_ns = std::max(server_delay_ns, timing.EarliestAnswer().count());
  const double exchange_s = Seconds(request_ns + adapter_ns + begin_ns + timing.KeyDelay().count() +
                                    size.answer * byte_ns());
  const double collision_s = Seconds(request_ns + response_window_ns());
  // S(p) rises to its maximum and falls: golden-section search.
  const double ratio = (std::sqrt(5.0) - 1) / 2;
  const auto rate = [&](double p) {
    return Throughput(p, stations, Seconds(slot_ns()), exchange_s, collision_s);
  };
  double low = 0;
  double high = 1;
  for (int i = 0; i < 80; ++i) {
    const double left = high - ratio * (high - low);
    const double right = low + ratio * (high - low);
    (rate(left) < rate(right) ? low : high) = rate(left) < rate(right) ? left : right;
  }
  return rate((low + high) / 2);
}

}  // namespace pheromone::swarm
