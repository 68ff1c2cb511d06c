// What the tests of TCP and UDP links share: a robot on the network.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>
#include <string>

#include "server/robots/links/testing/link_bench.h"

namespace pheromone::links::testing {

/// Of "127.0.0.1:1234" or "[::1]:1234".
inline uint16_t PortOf(const std::string& address) {
  return static_cast<uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
}

/// A robot with an address of its own, on a link that listens on 127.0.0.1. `kind`: SOCK_STREAM or
/// SOCK_DGRAM.
inline Peer ConnectFrom(uint32_t own_address, const Link& link, int kind) {
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl(own_address);
  sockaddr_in address = own;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(PortOf(link.address()));
  Descriptor handle(socket(AF_INET, kind | SOCK_CLOEXEC, 0));
  EXPECT_EQ(bind(handle.get(), reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
  EXPECT_EQ(connect(handle.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return Peer(std::move(handle));
}

/// The same from any.
inline Peer ConnectTo(const Link& link, int kind) {
  return ConnectFrom(INADDR_ANY, link, kind);
}

/// The same of one that listens on ::1.
inline Peer ConnectToIpv6(const Link& link, int kind) {
  sockaddr_in6 address{};
  address.sin6_family = AF_INET6;
  address.sin6_addr = in6addr_loopback;
  address.sin6_port = htons(PortOf(link.address()));
  Descriptor handle(socket(AF_INET6, kind | SOCK_CLOEXEC, 0));
  EXPECT_EQ(connect(handle.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  return Peer(std::move(handle));
}

}  // namespace pheromone::links::testing
