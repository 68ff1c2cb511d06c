// A request to a running server and its answer: HTTP over the server's Unix socket.
//
//   const Reply reply = Call({.socket = "pheromoned.sock"}, "GET", "/api/v1/status");
//   if (reply.exit_status != 0) { return reply.exit_status; }   // the error was reported
//   Show(reply.body);
//
// Errors are reported on standard error, with what to do about them; the exit status gives their
// kind.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include <boost/json/value.hpp>

#include "server/base/program.h"
#include "server/base/result.h"

namespace pheromone::ctl {

constexpr int kUsage = kWrongInput;
constexpr int kNoServer = 3;  ///< exit status: no server answers

/// Prints "pheromonectl: WORDS" to standard error and returns `exit_status`.
int Fail(int exit_status, const std::string& words);

/// The server's socket, and how its answers are shown.
struct ServerOptions {
  std::string socket;                 ///< empty: see ChooseSocket (server_socket.h)
  bool json = false;                  ///< as the server sent them
  std::chrono::seconds patience{30};  ///< until an answer has arrived whole
};

struct Reply {
  int exit_status = 0;
  std::string body;
  std::string error = {};   ///< unless the exit status is 0
  std::string raster = {};  ///< JSON: what the body is of, if it is a raster in .npy
};

/// Sends a request, and waits for the answer. Reports nothing.
Reply Ask(const ServerOptions& options, std::string_view method, const std::string& target,
          const std::string& body = "");

/// An answer's text as JSON. Error: it is not.
Result<boost::json::value> ParseAnswer(const std::string& text);

/// As Ask, for an answer in JSON.
Result<boost::json::value> AskJson(const ServerOptions& options, std::string_view method,
                                   const std::string& target, const std::string& body = "");

/// As Ask; an error is reported. A terminal is told which server a change goes to, once, unless the
/// command line names it.
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

/// Prints an answer as the server sent it, if that is wanted. True: so it was, or the call has
/// failed, and nothing more is to be shown.
bool IsDone(const ServerOptions& options, const JsonReply& reply);

}  // namespace pheromone::ctl
