// Text for the Internet addresses that links listen on.
#pragma once

#include <cstdint>
#include <string>

#include <boost/system/error_code.hpp>

namespace pheromone::links {

/// ADDRESS:PORT of Asio's TCP and UDP endpoints; an IPv6 address in brackets.
template <typename Endpoint>
std::string ToText(const Endpoint& endpoint) {
  const std::string address = endpoint.address().to_string();
  return (endpoint.address().is_v6() ? "[" + address + "]" : address) + ":" +
         std::to_string(endpoint.port());
}

inline std::string CannotListen(const std::string& address, uint16_t port,
                                const boost::system::error_code& error) {
  return "cannot listen on " + address + " port " + std::to_string(port) + ": " + error.message();
}

}  // namespace pheromone::links
