#include "proto_tests/exchange_bench/http_call.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

namespace pheromone::bench {
namespace {

using Clock = std::chrono::steady_clock;

// All that comes until the server hangs up; false at the deadline.
bool ReadAll(int handle, Clock::time_point deadline, std::string* text) {
  std::array<char, 65536> some{};
  while (true) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
    pollfd waiting{handle, POLLIN, 0};
    if (left.count() <= 0 || poll(&waiting, 1, static_cast<int>(left.count())) == 0) {
      return false;
    }
    const ssize_t size = read(handle, some.data(), some.size());
    if (size <= 0) {
      return true;
    }
    text->append(some.data(), static_cast<size_t>(size));
  }
}

HttpAnswer Ask(int handle, const std::string& path, const std::string& request,
               std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    return {0, path + " is too long for a socket"};
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  if (connect(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return {0, "cannot connect to " + path};
  }
  for (size_t sent = 0; sent < request.size();) {
    const ssize_t more = send(handle, request.data() + sent, request.size() - sent, MSG_NOSIGNAL);
    if (more <= 0) {
      break;  // refused before it was read; the answer says why
    }
    sent += static_cast<size_t>(more);
  }
  std::string text;
  if (!ReadAll(handle, deadline, &text)) {
    return {0, fmt::format("not finished after {} s", patience.count() / 1000)};
  }
  constexpr std::string_view kVersion = "HTTP/1.1 ";
  const size_t body = text.find("\r\n\r\n");
  if (text.rfind(kVersion, 0) != 0 || body == std::string::npos) {
    return {0, "the server hung up"};
  }
  return {std::atoi(text.c_str() + kVersion.size()), text.substr(body + 4)};
}

}  // namespace

HttpAnswer Call(const std::string& socket_path, std::string_view method, std::string_view target,
                std::string_view body, std::chrono::milliseconds patience) {
  const auto begin = Clock::now();
  const int handle = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  HttpAnswer answer = Ask(handle, socket_path,
                          fmt::format("{} {} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
                                      "Content-Length: {}\r\n\r\n{}",
                                      method, target, body.size(), body),
                          patience);
  close(handle);
  answer.time = Clock::now() - begin;
  return answer;
}

}  // namespace pheromone::bench
