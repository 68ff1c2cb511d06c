#include "server/operators/web/connection_pace.h"

#include <algorithm>

#include <boost/asio/ip/address.hpp>

namespace pheromone::web {

std::optional<ConnectionPace::Duration> ConnectionPace::Next(const std::string& client, Time now) {
  Time* const next = Find(client, now);
  const Time due = std::max(*next, now);
  const Duration wait = due - now - limits_.interval * (limits_.burst - 1);
  if (wait > limits_.longest_wait) {
    return std::nullopt;
  }
  *next = due + limits_.interval;
  return std::max(wait, Duration::zero());
}

ConnectionPace::Time* ConnectionPace::Find(const std::string& client, Time now) {
  const auto found = next_.find(client);
  if (found != next_.end()) {
    return &found->second;
  }
  if (next_.size() >= limits_.clients) {
    std::erase_if(next_, [now](const auto& it) { return it.second <= now; });
  }
  return next_.size() < limits_.clients ? &next_[client] : &next_of_others_;
}

std::string NetworkOf(const std::string& address) {
  boost::system::error_code error;
  const auto parsed = boost::asio::ip::make_address(address, error);
  if (error || !parsed.is_v6() || parsed.to_v6().is_v4_mapped()) {
    return address;
  }
  const auto v6 = parsed.to_v6();
  if (v6.is_link_local()) {
    return address;
  }
  auto bytes = v6.to_bytes();
  std::fill(bytes.begin() + 8, bytes.end(), uint8_t{0});
  return boost::asio::ip::make_address_v6(bytes).to_string();
}

}  // namespace pheromone::web
