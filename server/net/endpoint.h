// An Internet address and a port, as the configuration and messages have them.
#pragma once

#include <cstdint>
#include <string>

namespace pheromone {

struct Endpoint {
  std::string address;  ///< numeric, IPv4 or IPv6 without brackets; empty: none
  uint16_t port = 0;    ///< to listen on: 0 lets the system choose
  bool operator==(const Endpoint&) const = default;
};

/// ADDRESS:PORT; an IPv6 address in brackets.
inline std::string ToText(const Endpoint& endpoint) {
  const bool is_v6 = endpoint.address.find(':') != std::string::npos;
  return (is_v6 ? "[" + endpoint.address + "]" : endpoint.address) + ":" +
         std::to_string(endpoint.port);
}

}  // namespace pheromone
