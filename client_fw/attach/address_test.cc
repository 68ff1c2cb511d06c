#include "client_fw/attach/address.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>

#include <cstring>
#include <string>
#include <vector>

namespace pheromone::attach {
namespace {

uint16_t PortOf(const Address& address) {
  sockaddr_in socket = {};
  std::memcpy(&socket, &address.socket, sizeof socket);
  return ntohs(socket.sin_port);
}

TEST(ParseAddress, TakesPathsForSerialPorts) {
  // The last one is a name that udev gives.
  for (const char* const text : {"/dev/ttyUSB0", "radio-a.pty", "./a:1",
                                 "/dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0-port0"}) {
    const Result<Address> address = ParseAddress(text, 38'400);
    ASSERT_TRUE(address.ok()) << address.error();
    EXPECT_EQ(Address::Kind::kSerial, address.value().kind) << text;
    EXPECT_EQ(text, address.value().text);
    EXPECT_EQ(38'400u, address.value().baud);
  }
}

TEST(ParseAddress, ReadsHostsAndPorts) {
  const Result<Address> tcp = ParseAddress("127.0.0.1:8101", 9600);
  ASSERT_TRUE(tcp.ok()) << tcp.error();
  EXPECT_EQ(Address::Kind::kTcp, tcp.value().kind);
  EXPECT_EQ(AF_INET, tcp.value().socket.ss_family);
  EXPECT_EQ(8101, PortOf(tcp.value()));
  EXPECT_EQ(Address::Kind::kTcp, ParseAddress("tcp:127.0.0.1:1", 9600).value().kind);

  const Result<Address> udp = ParseAddress("udp:localhost:65535", 9600);
  ASSERT_TRUE(udp.ok()) << udp.error();
  EXPECT_EQ(Address::Kind::kUdp, udp.value().kind);
  EXPECT_EQ(65'535, PortOf(udp.value()));

  const Result<Address> six = ParseAddress("udp:[::1]:4951", 9600);
  ASSERT_TRUE(six.ok()) << six.error();
  EXPECT_EQ(AF_INET6, six.value().socket.ss_family);
}

TEST(ParseAddress, TellsWhatIsWrong) {
  const struct {
    const char* text;
    const char* told;
  } cases[] = {
      {"", "empty address"},
      {"udp://127.0.0.1:4951",
       "udp://127.0.0.1:4951: expected a serial port, HOST:PORT or "
       "udp:HOST:PORT, without slashes"},
      {"127.0.0.1", "127.0.0.1: no port, expected HOST:PORT"},
      {"127.0.0.1:", "port \"\", expected 1 to 65535"},
      {"127.0.0.1:0", "port \"0\", expected 1 to 65535"},
      {"127.0.0.1:65536", "port \"65536\", expected 1 to 65535"},
      {"127.0.0.1:http", "port \"http\", expected 1 to 65535"},
      {"127.0.0.1:80x", "port \"80x\", expected 1 to 65535"},
      {"127.0.0.1:-1", "port \"-1\", expected 1 to 65535"},
      {":8101", "expected HOST:PORT"},
      {"udp:localhost", "expected HOST:PORT"},
      {"::1:8101", "expected an IPv6 address in brackets"},
      {"256.256.256.256:1", "host \"256.256.256.256\""},
  };
  for (const auto& wrong : cases) {
    const Result<Address> address = ParseAddress(wrong.text, 9600);
    ASSERT_FALSE(address.ok()) << wrong.text;
    EXPECT_NE(std::string::npos, address.error().find(wrong.told))
        << wrong.text << ": " << address.error();
  }
}

TEST(PioneerRates, BeginWithTheOneThatIsGivenWhichNeedNotBeOneOfARIAs) {
  EXPECT_EQ(PioneerRates(9600), (std::vector<uint32_t>{9600, 38'400, 19'200, 115'200, 57'600}));
  EXPECT_EQ(PioneerRates(19'200), (std::vector<uint32_t>{19'200, 9600, 38'400, 115'200, 57'600}));
  EXPECT_EQ(PioneerRates(230'400),
            (std::vector<uint32_t>{230'400, 9600, 38'400, 19'200, 115'200, 57'600}));
}

}  // namespace
}  // namespace pheromone::attach
