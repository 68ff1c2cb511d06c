// By which names the server may be asked.

#include "server/operators/web/host.h"

#include <gtest/gtest.h>

namespace pheromone::web {
namespace {

TEST(HostTest, AddressesLocalhostAndNoHostAtAllMeanThisServer) {
  for (const char* host :
       {"", "localhost", "localhost:8377", "LocalHost", "127.0.0.1", "127.0.0.1:8377",
        "192.168.7.1:80", "[::1]", "[::1]:8377", "[fe80::1]:80", "[::ffff:10.0.0.1]:1"}) {
    EXPECT_TRUE(MeansThisServer(host, {})) << host;
  }
}

TEST(HostTest, OtherNamesDoNotHoweverTheyLook) {
  for (const char* host : {"evil.example",
                           "evil.example:8377",
                           "localhost.evil.example",
                           "evil.example:localhost",
                           "127.0.0.1.evil.example",
                           "127.0.0.1.",
                           "127.0.0",
                           "2130706433",
                           "0x7f.1",
                           "::1",
                           "[::1",
                           "::1]",
                           "[evil.example]",
                           "[127.0.0.1]",
                           "[]",
                           ":8377",
                           "localhost:",
                           "localhost:80:80",
                           "localhost:8a",
                           "localhost ",
                           " localhost",
                           "localhost@evil.example",
                           "lab"}) {
    const bool port_left_out = std::string(host) == "localhost:";  // RFC 3986 lets it be empty
    EXPECT_EQ(MeansThisServer(host, {"lab.local"}), port_left_out) << host;
  }
}

TEST(HostTest, ConfiguredNamesDoWhateverTheirCaseAndPort) {
  const std::vector<std::string> names = {"lab.local", "robots"};
  for (const char* host : {"lab.local", "LAB.local:8377", "robots", "robots:1"}) {
    EXPECT_TRUE(MeansThisServer(host, names)) << host;
  }
  for (const char* host : {"lab", "local", "xlab.local", "lab.local.evil.example"}) {
    EXPECT_FALSE(MeansThisServer(host, names)) << host;
  }
}

}  // namespace
}  // namespace pheromone::web
