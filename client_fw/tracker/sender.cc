#include "client_fw/tracker/sender.h"

#include <netdb.h>
#include <sys/socket.h>

#include <cerrno>
#include <memory>
#include <system_error>

namespace pheromone::tracker {

Result<Sender> Sender::Open(const Endpoint& server) {
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  const int error =
      getaddrinfo(server.address.c_str(), std::to_string(server.port).c_str(), &hints, &found);
  if (error != 0) {
    return Error{ToText(server) + ": " + gai_strerror(error)};
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> owner(found, &freeaddrinfo);
  Descriptor descriptor(socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!descriptor.valid() || connect(descriptor.get(), found->ai_addr, found->ai_addrlen) != 0) {
    return Error{ToText(server) + ": " + std::generic_category().message(errno)};
  }
  return Sender(std::move(descriptor), ToText(server));
}

Status Sender::Send(std::string_view datagram) {
  // An answer of the network to an earlier datagram is told once, and this one is not sent then.
  ssize_t sent = send(descriptor_.get(), datagram.data(), datagram.size(), 0);
  if (sent < 0 && errno == ECONNREFUSED) {
    sent = send(descriptor_.get(), datagram.data(), datagram.size(), 0);
    if (sent >= 0) {
      return Error{"nobody listens at " + name_ + ": expected a server with a [[tracker]] there"};
    }
  }
  return sent >= 0 ? Ok() : Status(Error{name_ + ": " + std::generic_category().message(errno)});
}

}  // namespace pheromone::tracker
