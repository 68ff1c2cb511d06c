// A connection of a client to a test's server, in plain bytes.
#pragma once

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace pheromone::web::testing {

// Blocking. What is waited for comes, or the test runs into its limit.
class RawClient {
 public:
  explicit RawClient(uint16_t port) : RawClient(Family{AF_INET}) { ConnectTo(port); }
  explicit RawClient(const std::string& path) : RawClient(Family{AF_UNIX}) { ConnectTo(path); }
  struct Family {
    int number;
  };
  // With a descriptor, and not connected yet.
  explicit RawClient(Family family) : socket_(socket(family.number, SOCK_STREAM, 0)) {}
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  ~RawClient() { close(socket_); }

  void ConnectTo(uint16_t port) const {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    Connect(reinterpret_cast<sockaddr*>(&address), sizeof address);
  }
  void ConnectTo(const std::string& path) const {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    Connect(reinterpret_cast<sockaddr*>(&address), sizeof address);
  }

  void Send(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t sent = send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) {
        return;  // the server has hung up
      }
      bytes.remove_prefix(static_cast<size_t>(sent));
    }
  }

  // All bytes until the server hangs up.
  std::string ReadAll() const {
    std::string all;
    char buffer[4096];
    for (ssize_t size = 0; (size = read(socket_, buffer, sizeof buffer)) > 0;) {
      all.append(buffer, static_cast<size_t>(size));
    }
    return all;
  }

  // Until `end` came in.
  std::string ReadUntil(std::string_view end) const {
    std::string all;
    char byte = 0;
    while (!all.ends_with(end) && read(socket_, &byte, 1) == 1) {
      all += byte;
    }
    return all;
  }

 private:
  void Connect(const sockaddr* address, size_t size) const {
    EXPECT_EQ(connect(socket_, address, static_cast<socklen_t>(size)), 0);
  }

  const int socket_;
};

}  // namespace pheromone::web::testing
