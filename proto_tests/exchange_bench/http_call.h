// An operator's request to pheromoned, over its Unix socket.
//
//   const HttpAnswer answer = Call(socket, "POST", "/api/v1/snapshot", "{}", 60s);
//   if (answer.status == 200) ...
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace pheromone::bench {

struct HttpAnswer {
  int status = 0;  ///< 0: no answer; then `body` says why
  std::string body;
  std::chrono::nanoseconds time{};  ///< from before the connection to the end of the answer
};

/// Any thread. Gives up after `patience`.
HttpAnswer Call(const std::string& socket_path, std::string_view method, std::string_view target,
                std::string_view body, std::chrono::milliseconds patience);

}  // namespace pheromone::bench
