// What tests of networks need: sockets of this process that play the server.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string>

#include "client_fw/attach/address.h"
#include "server/base/descriptor.h"

namespace pheromone::attach {

inline constexpr int kPatienceMs = 10'000;

// Bound to `*port` of this machine, or to a free one if it is 0, which it is set to.
inline Descriptor Bound(int type, uint16_t* port) {
  Descriptor bound(socket(AF_INET, type, 0));
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(*port);
  socklen_t size = sizeof address;
  auto* const any = reinterpret_cast<sockaddr*>(&address);
  const int yes = 1;
  setsockopt(bound.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  EXPECT_EQ(0, bind(bound.get(), any, size));
  EXPECT_EQ(0, getsockname(bound.get(), any, &size));
  *port = ntohs(address.sin_port);
  return bound;
}

class TcpServer {
 public:
  explicit TcpServer(uint16_t port = 0) : port_(port), listener_(Bound(SOCK_STREAM, &port_)) {
    EXPECT_EQ(0, listen(listener_.get(), 1));
  }

  Descriptor Accept() { return Descriptor(accept(listener_.get(), nullptr, nullptr)); }
  uint16_t port() const { return port_; }

 private:
  uint16_t port_;
  Descriptor listener_;
};

inline Address At(const std::string& text) {
  Result<Address> address = ParseAddress(text, 9600);
  EXPECT_TRUE(address.ok());
  return address.value();
}

inline std::string ReadFrom(const Descriptor& descriptor) {
  pollfd waited = {descriptor.get(), POLLIN, 0};
  EXPECT_EQ(1, poll(&waited, 1, kPatienceMs));
  std::array<char, 256> buffer{};
  const ssize_t size = read(descriptor.get(), buffer.data(), buffer.size());
  return {buffer.data(), static_cast<size_t>(std::max<ssize_t>(size, 0))};
}

}  // namespace pheromone::attach
