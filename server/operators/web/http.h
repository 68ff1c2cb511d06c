// Requests and responses as plain values, without sockets, streams or a library. The server
// (server.h) parses them from bytes; tests construct them directly.
//
//   Response response = api.Handle({.method = "GET", .target = "/api/v1/status"});
//
// All of this is functions of their arguments; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pheromone::web {

struct Request {
  std::string method;              ///< "GET"
  std::string target;              ///< as sent: "/api/v1/sense?x_m=1"
  bool local = false;              ///< over the Unix socket, which grants full access
  bool of_viewer = false;          ///< of a stream for viewers, which has shown its token
  bool encrypted = false;          ///< by this server: the pages it serves have origins with https
  std::string authorization = {};  ///< the headers of these names; empty: none
  std::string origin = {};
  std::string host = {};
  std::string fetch_site = {};    ///< Sec-Fetch-Site: of the page that asks; browsers tell
  std::string fetch_dest = {};    ///< Sec-Fetch-Dest: "document" where a link was followed
  std::string subprotocols = {};  ///< Sec-WebSocket-Protocol
  std::string accept_encoding = {};
  std::string if_none_match = {};
  std::string range = {};
  std::string if_range = {};
  std::string body = {};
  std::string client = {};  ///< who: the address, or over the Unix socket "uid 1000"
};

struct Response;

/// Answers a request: called once, from any thread. If it is destroyed uncalled, the answer is 503.
using Respond = std::function<void(Response)>;

/// A long body, read in portions while it is being sent.
class Content {
 public:
  Content() = default;
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;
  virtual ~Content() = default;

  /// Gives at most `count` bytes from `offset` on, as the body of a response with status 200; any
  /// other status, or no byte, ends the connection. Does not block; a caller waits for the response
  /// before the next call.
  virtual void Read(uint64_t offset, size_t count, Respond respond) = 0;
  /// What it holds while it exists; 0 of what is read from a file.
  virtual uint64_t bytes_in_memory() const { return 0; }
};

struct Response {
  int status = 200;
  std::string content_type = "application/json";
  std::string body = {};
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::shared_ptr<Content> content = nullptr;  ///< instead of `body`, if not null:
  uint64_t content_offset = 0;                 ///< these bytes of it
  uint64_t content_bytes = 0;
};

/// An error, for people and for programs.
struct Problem {
  std::string what;      ///< "found the string \"far\""
  std::string where;     ///< the key, parameter or header; empty: the request as a whole
  std::string expected;  ///< "a number from -1000 to 1000"
};

/// {"error": {"what": ..., "where": ..., "expected": ...}}, with an end of line.
Response Refuse(int status, const Problem& problem);

/// The parts of a target, percent-decoded.
struct Target {
  std::string path;
  std::vector<std::pair<std::string, std::string>> query;  ///< in the order of the target
};

/// Nothing if the target is invalid: it does not begin with '/', or a percent sign is not followed
/// by two hexadecimal digits.
std::optional<Target> ParseTarget(std::string_view target);

}  // namespace pheromone::web
