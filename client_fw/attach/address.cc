#include "client_fw/attach/address.h"

#include <arpa/inet.h>
#include <netdb.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <iterator>
#include <string_view>

namespace pheromone::attach {
namespace {

constexpr std::string_view kUdp = "udp:";
constexpr std::string_view kTcp = "tcp:";

// From 1 to 65535; 0 if it is not.
int PortOf(std::string_view text) {
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  const bool good = error == std::errc() && end == text.data() + text.size();
  return good && port >= 1 && port <= 65'535 ? port : 0;
}

Status Resolve(std::string_view host_and_port, Address* address) {
  const size_t colon = host_and_port.rfind(':');
  if (colon == std::string_view::npos || colon == 0) {
    return Error{address->text + ": expected HOST:PORT"};
  }
  std::string host(host_and_port.substr(0, colon));
  if (host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  } else if (host.find(':') != std::string::npos) {
    return Error{address->text + ": expected an IPv6 address in brackets, as [::1]:8101"};
  }
  const std::string port(host_and_port.substr(colon + 1));
  if (PortOf(port) == 0) {
    return Error{address->text + ": port \"" + port + "\", expected 1 to 65535"};
  }
  addrinfo wanted = {};
  wanted.ai_socktype = address->kind == Address::Kind::kUdp ? SOCK_DGRAM : SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(host.c_str(), port.c_str(), &wanted, &found); error != 0) {
    return Error{address->text + ": host \"" + host + "\": " + gai_strerror(error)};
  }
  std::memcpy(&address->socket, found->ai_addr, found->ai_addrlen);
  address->socket_size = found->ai_addrlen;
  freeaddrinfo(found);
  return Ok();
}

}  // namespace

Result<Address> ParseAddress(const std::string& text, uint32_t baud) {
  Address address;
  address.text = text;
  address.baud = baud;
  if (text.empty()) {
    return Error{"empty address, expected a serial port, HOST:PORT or udp:HOST:PORT"};
  }
  if (text.find("://") != std::string::npos) {
    return Error{text + ": expected a serial port, HOST:PORT or udp:HOST:PORT, without slashes"};
  }
  const bool is_path = text.find('/') != std::string::npos || text.find(':') == std::string::npos;
  if (is_path) {
    in_addr host = {};
    if (inet_pton(AF_INET, text.c_str(), &host) == 1) {
      return Error{text + ": no port, expected HOST:PORT, such as " + text + ":8101"};
    }
    return address;
  }
  std::string_view rest = text;
  address.kind = Address::Kind::kTcp;
  if (rest.starts_with(kUdp)) {
    address.kind = Address::Kind::kUdp;
    rest.remove_prefix(kUdp.size());
  } else if (rest.starts_with(kTcp)) {
    rest.remove_prefix(kTcp.size());
  }
  PHEROMONE_TRY_STATUS(Resolve(rest, &address));
  return address;
}

std::vector<uint32_t> PioneerRates(uint32_t first) {
  std::vector<uint32_t> rates = {first};
  std::ranges::copy_if(std::array{9600u, 38'400u, 19'200u, 115'200u, 57'600u},
                       std::back_inserter(rates), [&](uint32_t rate) { return rate != first; });
  return rates;
}

}  // namespace pheromone::attach
