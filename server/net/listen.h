// Listening on an Internet address: opening, and the words for it.
#pragma once

#include <cstdint>
#include <string>

#include <boost/asio/ip/address.hpp>
#include <boost/asio/socket_base.hpp>
#include <boost/system/error_code.hpp>

#include "server/base/result.h"

namespace pheromone {

/// ADDRESS:PORT of Asio's TCP and UDP endpoints; an IPv6 address in brackets.
template <typename Endpoint>
std::string ToText(const Endpoint& endpoint) {
  const std::string address = endpoint.address().to_string();
  return (endpoint.address().is_v6() ? "[" + address + "]" : address) + ":" +
         std::to_string(endpoint.port());
}

/// Opens a UDP socket or an acceptor on a numeric address; `prepare` sets its options before it is
/// bound. Returns where it listens, ADDRESS:PORT; after an error it is closed.
template <typename Socket, typename Prepare>
Result<std::string> Listen(const std::string& address, uint16_t port, Socket* socket,
                           const Prepare& prepare) {
  boost::system::error_code error;
  const typename Socket::endpoint_type endpoint(boost::asio::ip::make_address(address, error),
                                                port);
  if (!error) {
    socket->open(endpoint.protocol(), error);
  }
  if (!error) {
    prepare();
    socket->bind(endpoint, error);
  }
  constexpr int kQueue = boost::asio::socket_base::max_listen_connections;
  if constexpr (requires { socket->listen(kQueue, error); }) {
    if (!error) {
      socket->listen(kQueue, error);
    }
  }
  boost::system::error_code ignored;
  if (!error) {
    return ToText(socket->local_endpoint(ignored));
  }
  socket->close(ignored);
  return Error{"cannot listen on " + address + " port " + std::to_string(port) + ": " +
               error.message()};
}

}  // namespace pheromone
