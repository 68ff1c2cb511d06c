// Listening on an Internet address: opening, and the words for it.
#pragma once

#include <optional>
#include <string>

#include <boost/asio/error.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/socket_base.hpp>
#include <boost/system/error_code.hpp>

#include "server/base/holders.h"
#include "server/base/result.h"
#include "server/net/endpoint.h"

namespace pheromone {

/// Opens a UDP socket or an acceptor on a numeric address; `prepare` sets its options before it is
/// bound. Returns where it listens, ADDRESS:PORT; after an error it is closed.
template <typename Socket, typename Prepare>
Result<std::string> Listen(const Endpoint& where, Socket* socket, const Prepare& prepare) {
  boost::system::error_code error;
  const typename Socket::endpoint_type endpoint(boost::asio::ip::make_address(where.address, error),
                                                where.port);
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
    const auto listens = socket->local_endpoint(ignored);
    return ToText(Endpoint{listens.address().to_string(), listens.port()});
  }
  socket->close(ignored);
  std::string why = error.message();
  if constexpr (requires { socket->listen(kQueue, error); }) {
    if (error == boost::asio::error::address_in_use) {
      const std::optional<int> holder = HolderOfPort(where.port);
      why += holder ? " by " + DescribeProcess(*holder) : "";
    }
  }
  return Error{"cannot listen on " + where.address + " port " + std::to_string(where.port) + ": " +
               why};
}

}  // namespace pheromone
