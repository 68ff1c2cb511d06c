#include "server/robots/links/datagrams.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "server/base/descriptor.h"
#include "server/robots/links/testing/link_bench.h"

namespace pheromone::links {
namespace {

using testing::PingOf;
using testing::Wire;

PeerAddress Localhost(uint16_t port) {
  PeerAddress peer;
  auto* address = reinterpret_cast<sockaddr_in*>(&peer.socket_address);
  address->sin_family = AF_INET;
  address->sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address->sin_port = htons(port);
  peer.size = sizeof *address;
  return peer;
}

// Nothing can be sent to port 0.
TEST(DatagramWriter, TellsOfEachDatagramWhetherItWasSent) {
  const Descriptor socket_handle(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  DatagramWriter writer;
  const uint16_t ports[] = {9, 0, 9, 9, 0};
  std::vector<std::pair<std::vector<uint8_t>, bool>> expected;
  for (uint8_t i = 0; i < std::size(ports); ++i) {
    writer.Add(PingOf(3, i), Localhost(ports[i]));
    expected.emplace_back(Wire(PingOf(3, i)), ports[i] != 0);
  }
  std::vector<std::pair<std::vector<uint8_t>, bool>> told;
  const auto outcome =
      writer.Flush(socket_handle.get(), [&](std::span<const uint8_t> datagram, bool is_sent) {
        told.emplace_back(std::vector<uint8_t>(datagram.begin(), datagram.end()), is_sent);
      });
  EXPECT_EQ(told, expected);
  EXPECT_EQ(outcome.frames, 3u);
  EXPECT_EQ(outcome.undeliverable, 2u);
}

}  // namespace
}  // namespace pheromone::links
