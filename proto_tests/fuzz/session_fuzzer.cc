// What comes over one connection, in pieces: pipelined and half-sent requests, handshakes of
// WebSockets, and ends at any byte, for the real Session on a socket. Bit 0 of the first byte: over
// the Unix socket; bit 1: the client does not read; bit 2: the server stops in the middle. Each
// piece is its length in a byte, and itself. What comes back is a sequence of whole answers of
// HTTP, not more than there were requests, unless the connection was handed on; and when the client
// has ended, so has the session.
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/connect_pair.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/strand.hpp>
#include <boost/beast/http.hpp>

#include "proto_tests/fuzz/require.h"
#include "server/operators/web/api/api.h"
#include "server/operators/web/server.h"
#include "server/operators/web/session.h"
#include "server/operators/web/testing/fake_control.h"

namespace {

using pheromone::fuzz::Require;
using namespace pheromone::web;  // NOLINT(google-build-using-namespace)
namespace asio = boost::asio;
namespace http = boost::beast::http;
using Local = asio::local::stream_protocol;

constexpr char kToken[] = "0123456789abcdef";

// One connection, with both of its ends here.
class Bench {
 public:
  explicit Bench(uint8_t flags) : reads_((flags & 2) == 0) {
    Local::socket ours(asio::make_strand(io_));
    Local::socket theirs(io_);
    asio::local::connect_pair(ours, theirs);
    client_ = theirs.release();
    int bytes = 1 << 20;
    setsockopt(client_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    upgrades_["/"] = {.check =
                          [this](const Request& request) {
                            ++handshakes_;
                            return api_.CheckStream(request);
                          },
                      .take = [](const Upgrade& /*upgrade*/) {}};
    session_ = std::make_shared<Session>(
        Connection(Connection::Protocol::socket(std::move(ours))),
        SessionTraits{.local = (flags & 1) != 0,
                      .patience = std::chrono::hours(1),
                      .client = "192.0.2.7",
                      .long_answers = std::make_shared<LongAnswers>()},
        [this](Request request, const Respond& respond) {
          ++requests_;
          Require(request.client == "192.0.2.7");
          api_.Handle(std::move(request), respond);
        },
        &upgrades_);
    asio::co_spawn(session_->executor(), session_->Run(),
                   [this](const std::exception_ptr& failure) {
                     Require(failure == nullptr);
                     has_ended_ = true;
                   });
    io_.poll();
  }
  Bench(const Bench&) = delete;
  Bench& operator=(const Bench&) = delete;
  ~Bench() {
    close(client_);
    session_.reset();
    io_.restart();
    io_.poll();
  }

  void Send(std::string_view piece) {
    sent_ += piece;
    while (!piece.empty()) {
      const ssize_t sent = send(client_, piece.data(), piece.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent <= 0) {
        return;  // the session has hung up, or reads nothing more
      }
      piece.remove_prefix(static_cast<size_t>(sent));
      Turn();
      if (reads_) {
        Receive();
      }
    }
  }

  void Stop() {
    if (std::exchange(is_stopped_, true)) {
      return;
    }
    session_->Close();
    Turn();
  }

  // The client ends: what was sent is answered, and the session ends.
  void End() {
    shutdown(client_, SHUT_WR);
    for (size_t before = answers_.size() + 1; before != answers_.size();) {
      before = answers_.size();
      Turn();
      Receive();
    }
    close(std::exchange(client_, -1));
    Turn();
    Require(has_ended_);
  }

  void Check() const {
    std::string_view left = answers_;
    size_t answers = 0;
    while (!left.empty()) {
      http::response_parser<http::string_body> parser;
      parser.body_limit(uint64_t{64} << 20);
      parser.eager(true);
      // Of a HEAD only the length comes; nothing else lacks a body that it announces.
      boost::beast::error_code error;
      const size_t taken = parser.put(asio::buffer(left.data(), left.size()), error);
      if (error || !parser.is_done()) {
        break;
      }
      const unsigned status = parser.get().result_int();
      Require(status == 100 || (status >= 200 && status < 600));
      answers += status != 100 ? 1 : 0;
      left.remove_prefix(taken);
    }
    // One for each request and handshake, and a last one for what is neither.
    Require(answers <= requests_ + handshakes_ + 1);
    Require(answers_.empty() || answers_.starts_with("HTTP/1."));
    // Answers to HEAD announce a body that does not come, and who does not read loses the rest.
    Require(left.empty() || sent_.find("HEAD") != std::string::npos || !reads_ || is_stopped_);
  }

 private:
  void Turn() {
    io_.restart();
    io_.poll();
  }
  void Receive() {
    std::array<char, 65536> buffer{};
    for (ssize_t size = 0;
         (size = recv(client_, buffer.data(), buffer.size(), MSG_DONTWAIT)) > 0;) {
      answers_.append(buffer.data(), static_cast<size_t>(size));
      Turn();
    }
  }

  pheromone::web::testing::FakeControl control_;
  Api api_{&control_, {.token = kToken, .hosts = {"lab.local"}}};
  asio::io_context io_{1};
  Upgrades upgrades_;
  std::shared_ptr<Session> session_;
  int client_ = -1;
  size_t requests_ = 0;
  size_t handshakes_ = 0;
  const bool reads_;
  std::string sent_;
  bool is_stopped_ = false;
  bool has_ended_ = false;
  std::string answers_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const auto ignored = std::signal(SIGPIPE, SIG_IGN);
  (void)ignored;
  if (size == 0) {
    return 0;
  }
  const uint8_t flags = data[0];
  Bench bench(flags);
  std::string_view input(reinterpret_cast<const char*>(data) + 1, size - 1);
  const size_t half = input.size() / 2;
  while (!input.empty()) {
    const size_t length = static_cast<unsigned char>(input[0]);
    input.remove_prefix(1);
    const std::string_view piece = input.substr(0, length);
    bench.Send(piece);
    input.remove_prefix(piece.size());
    if ((flags & 4) != 0 && input.size() < half) {
      bench.Stop();
    }
  }
  bench.End();
  bench.Check();
  return 0;
}
