// One connection of the HTTP server: requests one after the other, until either side hangs up.
// Internal to this folder; server.h is what others use.
//
//   auto session = std::make_shared<Session<tcp>>(std::move(socket), false, handle, patience);
//   asio::co_spawn(session->executor(), session->Run(), ...);
//
// Everything runs on the socket's executor, a strand; Close may be called from any thread.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>

#include "server/web/http.h"
#include "server/web/server.h"

namespace pheromone::web {

/// What a parser's error is answered with; 0: with nothing, nobody is listening any more.
int StatusOf(const boost::beast::error_code& error);

using Message = boost::beast::http::request<boost::beast::http::string_body>;
using Answer = boost::beast::http::response<boost::beast::http::string_body>;

Request ToRequest(const Message& message, bool local);

/// Ready to be written. Of the answer to HEAD, the header alone is written.
Answer ToAnswer(Response response, unsigned version, bool keep_alive);

class SessionBase {
 public:
  SessionBase() = default;
  SessionBase(const SessionBase&) = delete;
  SessionBase& operator=(const SessionBase&) = delete;
  virtual ~SessionBase() = default;
  virtual void Close() = 0;
};

template <typename Protocol>
class Session final : public SessionBase, public std::enable_shared_from_this<Session<Protocol>> {
 public:
  Session(typename Protocol::socket socket, bool local, Server::Handle handle,
          std::chrono::milliseconds patience)
      : stream_(std::move(socket)),
        local_(local),
        handle_(std::move(handle)),
        patience_(patience) {}

  boost::asio::any_io_executor executor() { return stream_.get_executor(); }

  boost::asio::awaitable<void> Run() {
    const auto self = this->shared_from_this();
    while (co_await ServeOne()) {
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
    stream_.expires_after(patience_);
    co_await http::async_read_header(stream_, buffer_, parser, Into(&error));
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
    Answer answer =
        ToAnswer(handle_(ToRequest(message, local_)), message.version(), message.keep_alive());
    co_return co_await Write(&answer, message.method() == http::verb::head) &&
        message.keep_alive() && !closing_;
  }

  boost::asio::awaitable<bool> Write(Answer* answer, bool header_alone) {
    namespace http = boost::beast::http;
    boost::beast::error_code error;
    stream_.expires_after(patience_);
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
    stream_.expires_after(std::min<std::chrono::milliseconds>(patience_, kLinger));
    for (int i = 0; i < kMostReads && !error && !closing_; ++i) {
      co_await stream_.async_read_some(boost::asio::buffer(rest), Into(&error));
    }
    stream_.close();
  }

  static constexpr std::chrono::milliseconds kLinger{2'000};

  boost::beast::basic_stream<Protocol> stream_;
  const bool local_;
  const Server::Handle handle_;
  const std::chrono::milliseconds patience_;
  boost::beast::flat_buffer buffer_{kMaxHeaderBytes + kMaxBodyBytes};
  bool closing_ = false;
};

}  // namespace pheromone::web
