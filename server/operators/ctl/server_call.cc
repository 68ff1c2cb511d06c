#include "server/operators/ctl/server_call.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <optional>
#include <system_error>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>

#include "server/base/escape.h"
#include "server/operators/ctl/server_socket.h"

namespace pheromone::ctl {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace json = boost::json;
using Local = asio::local::stream_protocol;

constexpr size_t kMaxBytes = size_t{256} << 20;
constexpr size_t kReadBytes = size_t{64} << 10;
constexpr int kBadRequest = 400;

struct Exchange {
  beast::error_code connecting;
  beast::error_code talking;
  Status trusted = Ok();
  int status = 0;
  std::string body;
  std::string raster;
};

// Whoever serves the socket is who listened: another file may have taken its place since it was
// chosen.
Status CheckServer(const ServerSocket& socket, int descriptor) {
  ucred server{};
  socklen_t size = sizeof server;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &server, &size) != 0) {
    return Error{socket.path + ": " + std::generic_category().message(errno)};
  }
  return CheckOwner(socket.path, "is served by", server.uid);
}

asio::awaitable<void> Talk(const ServerSocket& socket, http::request<http::string_body> request,
                           std::chrono::seconds patience, Exchange* exchange) {
  const auto into = [](beast::error_code* error) {
    return asio::redirect_error(asio::use_awaitable, *error);
  };
  beast::basic_stream<Local> stream(co_await asio::this_coro::executor);
  stream.expires_after(patience);
  co_await stream.async_connect(Local::endpoint(socket.path), into(&exchange->connecting));
  if (exchange->connecting) {
    co_return;
  }
  if (socket.is_found) {
    exchange->trusted = CheckServer(socket, stream.socket().native_handle());
    if (!exchange->trusted.ok()) {
      co_return;
    }
  }
  co_await http::async_write(stream, request, into(&exchange->talking));
  // A server that refuses early may have answered although not everything could be sent.
  beast::error_code reading;
  beast::flat_buffer buffer;
  buffer.reserve(kReadBytes);  // else Beast reads 512 bytes at a time
  http::response_parser<http::string_body> parser;
  parser.body_limit(kMaxBytes);
  co_await http::async_read(stream, buffer, parser, into(&reading));
  if (reading) {
    exchange->talking = exchange->talking ? exchange->talking : reading;
    co_return;
  }
  exchange->talking = {};
  exchange->status = static_cast<int>(parser.get().result_int());
  exchange->body = std::move(parser.get().body());
  exchange->raster = parser.get()["X-Raster"];
}

std::string Advice(const std::string& socket, const beast::error_code& error) {
  if (error == asio::error::access_denied) {
    return fmt::format(
        "{}: {}; the server may be used by members of its group, of the service: pheromone. Join "
        "it (sudo adduser $USER pheromone, then log in again), or use sudo",
        socket, error.message());
  }
  return fmt::format("no server at {}: {}", socket, error.message()) +
         "; start pheromoned, or name the socket of a running server with --socket";
}

// The text of a refusal. Each error of a configuration is a line; those after the first are
// indented, so that no server writes what looks like a line of its own.
std::string WordsOf(const Exchange& exchange) {
  beast::error_code error;
  const json::value body = json::parse(exchange.body, error);
  const json::object* object = error ? nullptr : body.if_object();
  const json::value* inner = object != nullptr ? object->if_contains("error") : nullptr;
  if (inner == nullptr || !inner->is_object()) {
    return fmt::format("the server answered with status {}", exchange.status);
  }
  const auto text = [&](std::string_view key) {
    const json::value* value = inner->get_object().if_contains(key);
    return value != nullptr && value->is_string() ? std::string(value->get_string())
                                                  : std::string();
  };
  std::string words = text("where");
  words += (words.empty() ? "" : ": ") + text("what");
  const std::string expected = text("expected");
  words += expected.empty() ? "" : ", expected " + expected;
  std::string lines;
  for (const char c : EscapeControls(words)) {
    lines += c;
    lines += c == '\n' ? "  " : "";
  }
  return lines;
}

void AnnounceChange(const ServerSocket& socket) {
  static bool announced = false;
  if (!announced && !socket.is_named && isatty(STDERR_FILENO) != 0) {
    std::error_code ignored;
    std::cerr << "pheromonectl: to the server at "
              << std::filesystem::absolute(socket.path, ignored).string() << '\n';
  }
  announced = true;
}

Reply AskAt(const ServerSocket& socket, std::chrono::seconds patience, std::string_view method,
            const std::string& target, const std::string& body) {
  if (socket.path.size() > 107) {
    return {kUsage, "", socket.path + ": too long for a Unix socket"};
  }
  http::request<http::string_body> request;
  request.method_string({method.data(), method.size()});
  request.target(target);
  request.set(http::field::host, "localhost");
  request.set(http::field::user_agent, "pheromonectl/" PHEROMONE_VERSION);
  if (method == "POST") {
    request.set(http::field::content_type, "application/json");
  }
  request.body() = body;
  request.keep_alive(false);
  request.prepare_payload();

  Exchange exchange;
  asio::io_context io;
  asio::co_spawn(io, Talk(socket, std::move(request), patience, &exchange), asio::detached);
  io.run();
  if (exchange.connecting) {
    return {kNoServer, "", Advice(socket.path, exchange.connecting)};
  }
  if (!exchange.trusted.ok()) {
    return {kNoServer, "", exchange.trusted.error()};
  }
  if (exchange.talking) {
    return {kNoServer, "",
            fmt::format("the server at {} does not answer: {}", socket.path,
                        exchange.talking.message())};
  }
  if (exchange.status != 200) {
    const int exit_status = exchange.status == kBadRequest ? kUsage : kFailed;
    return {exit_status, "", WordsOf(exchange)};
  }
  return {0, std::move(exchange.body), "", std::move(exchange.raster)};
}

}  // namespace

int Fail(int exit_status, const std::string& words) {
  return pheromone::Fail("pheromonectl", words, exit_status);
}

Reply Ask(const ServerOptions& options, std::string_view method, const std::string& target,
          const std::string& body) {
  const Result<ServerSocket> socket = ChooseSocket(options.socket);
  return socket.ok() ? AskAt(socket.value(), options.patience, method, target, body)
                     : Reply{kNoServer, "", socket.error()};
}

Result<json::value> ParseAnswer(const std::string& text) {
  beast::error_code malformed;
  json::value value = json::parse(text, malformed);
  if (malformed) {
    return Error{"the server's answer is not JSON: " + malformed.message()};
  }
  return value;
}

Result<json::value> AskJson(const ServerOptions& options, std::string_view method,
                            const std::string& target, const std::string& body) {
  const Reply reply = Ask(options, method, target, body);
  return reply.exit_status == 0 ? ParseAnswer(reply.body) : Error{reply.error};
}

Reply Call(const ServerOptions& options, std::string_view method, const std::string& target,
           const std::string& body) {
  const Result<ServerSocket> socket = ChooseSocket(options.socket);
  if (!socket.ok()) {
    return {Fail(kNoServer, socket.error()), "", socket.error()};
  }
  if (method != "GET") {
    AnnounceChange(socket.value());
  }
  Reply reply = AskAt(socket.value(), options.patience, method, target, body);
  if (reply.exit_status != 0) {
    Fail(reply.exit_status, reply.error);
  }
  return reply;
}

JsonReply CallJson(const ServerOptions& options, std::string_view method, const std::string& target,
                   const std::string& body) {
  Reply reply = Call(options, method, target, body);
  JsonReply answer{reply.exit_status, nullptr, std::move(reply.body)};
  if (answer.exit_status == 0) {
    Result<json::value> value = ParseAnswer(answer.text);
    if (value.ok()) {
      answer.value = std::move(value).value();
    } else {
      answer.exit_status = Fail(kFailed, value.error());
    }
  }
  return answer;
}

bool IsDone(const ServerOptions& options, const JsonReply& reply) {
  if (reply.exit_status == 0 && options.json) {
    fmt::print("{}", reply.text);
  }
  return reply.exit_status != 0 || options.json;
}

}  // namespace pheromone::ctl
