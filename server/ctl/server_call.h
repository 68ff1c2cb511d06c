// A question to a running server, and its answer: HTTP over the server's Unix socket.
//
//   const Reply reply = Call({.socket = "/run/pheromone/pheromoned/pheromoned.sock"}, "GET",
//   "/api/v1/status"); if (reply.exit_status != 0) { return reply.exit_status; }   // it was told
//   what is wrong Show(reply.body);
//
// What goes wrong is told on standard error, in words that say what to do; the exit status says
// which kind it is.
#pragma once

#include <string>
#include <string_view>

#include <boost/json/value.hpp>

namespace pheromone::ctl {

constexpr int kFailed = 1;    ///< the server, or the system, refused
constexpr int kUsage = 2;     ///< a mistake in the command line or a configuration
constexpr int kNoServer = 3;  ///< nobody answers there

/// Prints "pheromonectl: WORDS" to standard error and returns `exit_status`.
int Fail(int exit_status, const std::string& words);

/// Where the server is, and how its answers are shown.
struct ServerOptions {
  std::string socket;  ///< empty: DefaultSocket()
  bool json = false;   ///< as the server sent them
};

/// $PHEROMONE_SOCKET, or pheromoned.sock in the working directory if it is there, or
/// /run/pheromone/pheromoned/pheromoned.sock.
std::string DefaultSocket();

/// That of the service that the configuration /etc/pheromone/NAME.toml rules.
std::string SocketOf(const std::string& instance);

struct Reply {
  int exit_status = 0;
  std::string body;
};

/// Asks, and waits for the answer for at most half a minute.
Reply Call(const ServerOptions& options, std::string_view method, const std::string& target,
           const std::string& body = "");

/// The same for an answer in JSON: null unless the exit status is 0.
struct JsonReply {
  int exit_status = 0;
  boost::json::value value;
  std::string text;
};
JsonReply CallJson(const ServerOptions& options, std::string_view method, const std::string& target,
                   const std::string& body = "");

/// What may stand in a query: all but letters, digits and -._~ as %XX.
std::string Escape(std::string_view text);

}  // namespace pheromone::ctl
