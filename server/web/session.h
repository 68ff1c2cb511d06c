// One connection of the HTTP server: requests one after the other, until either side hangs up.
// Internal to this folder; server.h is what others use.
//
//   auto session = std::make_shared<Session<tcp>>(std::move(socket), traits, handle);
//   asio::co_spawn(session->executor(), session->Run(), ...);
//
// Everything runs on the socket's executor, a strand. Close, and what tells how idle the session
// is, may be called from any thread.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>

#include "server/web/http.h"
#include "server/web/pending_response.h"
#include "server/web/server.h"

namespace pheromone::web {

/// What a parser's error is answered with; 0: with nothing, nobody is listening any more.
int StatusOf(const boost::beast::error_code& error);

using Message = boost::beast::http::request<boost::beast::http::string_body>;
using Answer = boost::beast::http::response<boost::beast::http::string_body>;

/// What is wrong with the headers of a whole message: one that decides about access comes twice.
std::optional<Problem> ProblemOf(const Message& message);

Request ToRequest(const Message& message, bool local);

/// Ready to be written. Of the answer to HEAD, the header alone is written.
Answer ToAnswer(Response response, unsigned version, bool keep_alive);

class SessionBase {
 public:
  SessionBase() = default;
  SessionBase(const SessionBase&) = delete;
  SessionBase& operator=(const SessionBase&) = delete;
  virtual ~SessionBase() = default;

  /// Ends it. A request that has been handled over is answered before.
  virtual void Close() = 0;

  /// A number for the time since which it waits for a request, the greater the later; nothing while
  /// it is in the middle of one.
  std::optional<uint64_t> idle_since() const {
    const uint64_t since = idle_since_;
    return since > kClaimed ? std::optional(since) : std::nullopt;
  }

  /// Whether it still waits as `since` says; then it takes no further request, and can be closed.
  bool Claim(uint64_t since) { return idle_since_.compare_exchange_strong(since, kClaimed); }

 protected:
  /// False if it was claimed: there is no request any more.
  bool BeginRequest() {
    uint64_t since = idle_since_;
    return since > kClaimed && idle_since_.compare_exchange_strong(since, kBusy);
  }
  void EndRequest() { idle_since_ = NextTime(); }

 private:
  static constexpr uint64_t kBusy = 0;
  static constexpr uint64_t kClaimed = 1;

  static uint64_t NextTime() {
    static std::atomic<uint64_t> last{kClaimed};
    return ++last;
  }

  std::atomic<uint64_t> idle_since_{NextTime()};
};

/// What one session differs from others in.
struct SessionTraits {
  bool local = false;
  bool once = false;  ///< hangs up after the first answer
  std::chrono::milliseconds patience{0};
};

template <typename Protocol>
class Session final : public SessionBase, public std::enable_shared_from_this<Session<Protocol>> {
 public:
  Session(typename Protocol::socket socket, SessionTraits traits, Server::Handle handle)
      : stream_(std::move(socket)),
        answer_timer_(stream_.get_executor()),
        traits_(traits),
        handle_(std::move(handle)) {}

  boost::asio::any_io_executor executor() { return stream_.get_executor(); }

  boost::asio::awaitable<void> Run() {
    const auto self = this->shared_from_this();
    while (!closing_ && co_await ServeOne()) {
      EndRequest();
    }
    co_await HangUp();
  }

  void Close() override {
    boost::asio::post(stream_.get_executor(), [self = this->shared_from_this()] {
      self->closing_ = true;
      self->stream_.cancel();
    });
  }

 private:
  using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;

  static auto Into(boost::beast::error_code* error) {
    return boost::asio::redirect_error(boost::asio::use_awaitable, *error);
  }

  // Whether another request may follow.
  boost::asio::awaitable<bool> ServeOne() {
    namespace http = boost::beast::http;
    boost::beast::error_code error;
    Parser parser;
    parser.header_limit(static_cast<uint32_t>(kMaxHeaderBytes));
    parser.body_limit(kMaxBodyBytes);
    stream_.expires_after(traits_.patience);
    if (buffer_.size() == 0) {
      buffer_.commit(
          co_await stream_.async_read_some(buffer_.prepare(kMaxHeaderBytes), Into(&error)));
    }
    if (!BeginRequest()) {
      co_return false;
    }
    if (!error) {
      co_await http::async_read_header(stream_, buffer_, parser, Into(&error));
    }
    if (!error && parser.get()[http::field::expect] == "100-continue" && !closing_) {
      http::response<http::empty_body> go_on(http::status::continue_, parser.get().version());
      co_await http::async_write(stream_, go_on, Into(&error));
    }
    if (!error && !closing_) {
      co_await http::async_read(stream_, buffer_, parser, Into(&error));
    }
    if (closing_) {
      co_return false;
    }
    if (error) {
      if (const int status = StatusOf(error); status != 0) {
        Answer answer = ToAnswer(Refuse(status, {error.message(), "request",
                                                 "HTTP/1.1, a header of at most 8 KiB and a body "
                                                 "of at most 1 MiB"}),
                                 11, false);
        co_await Write(&answer, false);
      }
      co_return false;
    }
    const Message& message = parser.get();
    if (const auto problem = ProblemOf(message)) {
      Answer answer = ToAnswer(Refuse(400, *problem), message.version(), false);
      co_await Write(&answer, message.method() == http::verb::head);
      co_return false;
    }
    const bool keep_alive = message.keep_alive() && !traits_.once;
    Response response = co_await Ask(ToRequest(message, traits_.local));
    Answer answer = ToAnswer(std::move(response), message.version(), keep_alive);
    co_return co_await Write(&answer, message.method() == http::verb::head) && keep_alive &&
        !closing_;
  }

  boost::asio::awaitable<Response> Ask(Request request) {
    PendingResponse pending(stream_.get_executor(), [this] { answer_timer_.cancel(); });
    handle_(std::move(request), pending.MakeRespond());
    std::optional<Response> response = pending.Take();
    if (!response) {
      boost::beast::error_code error;
      answer_timer_.expires_after(traits_.patience);
      co_await answer_timer_.async_wait(Into(&error));
      response = pending.Take();
    }
    if (!response) {
      response = Refuse(504, {"the server has no answer yet; what was asked for may still be done",
                              "", "another look in a moment"});
    }
    co_return std::move(*response);
  }

  boost::asio::awaitable<bool> Write(Answer* answer, bool header_alone) {
    namespace http = boost::beast::http;
    boost::beast::error_code error;
    stream_.expires_after(traits_.patience);
    http::response_serializer<http::string_body> serializer(*answer);
    if (header_alone) {
      co_await http::async_write_header(stream_, serializer, Into(&error));
    } else {
      co_await http::async_write(stream_, serializer, Into(&error));
    }
    co_return !error;
  }

  // Closing with bytes unread would make the system throw away what we wrote last: what still comes
  // is read, for a while.
  boost::asio::awaitable<void> HangUp() {
    boost::beast::error_code error;
    stream_.socket().shutdown(Protocol::socket::shutdown_send, error);
    std::array<char, 4096> rest{};
    constexpr int kMostReads = 1024;
    stream_.expires_after(std::min<std::chrono::milliseconds>(traits_.patience, kLinger));
    for (int i = 0; i < kMostReads && !error && !closing_; ++i) {
      co_await stream_.async_read_some(boost::asio::buffer(rest), Into(&error));
    }
    stream_.close();
  }

  static constexpr std::chrono::milliseconds kLinger{2'000};

  boost::beast::basic_stream<Protocol> stream_;
  boost::asio::steady_timer answer_timer_;
  const SessionTraits traits_;
  const Server::Handle handle_;
  boost::beast::flat_buffer buffer_{kMaxHeaderBytes + kMaxBodyBytes};
  bool closing_ = false;
};

}  // namespace pheromone::web
