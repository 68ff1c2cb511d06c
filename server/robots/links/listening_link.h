// What links have in common that listen on an Internet address: they open their socket, and open it
// again with back-off when that failed.
//
// What a link overrides is called on the strand, but Prepare and OnListening also by Start.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>

#include "server/net/listen.h"
#include "server/robots/links/keep_running.h"
#include "server/robots/links/link.h"

namespace pheromone::links {

/// `Socket`: a UDP socket, or an acceptor.
template <typename Socket>
class ListeningLink : public Link {
 public:
  Status Start() final {
    Status listening = Listen();
    KeepRunning(
        strand_, [this] { return Run(); },
        [this](const Error& error) { ReportError(error, "the link continues"); });
    return listening;
  }

  void Stop() final {
    boost::asio::post(strand_, [this] {
      boost::system::error_code ignored;
      stopping_ = true;
      socket_.close(ignored);
      retry_.cancel();
      OnStop();
      record()->SetDown("stopped");
    });
  }

  void Send(std::vector<engine::Outgoing> messages) final {
    boost::asio::post(strand_, [this, messages = std::move(messages)] {
      for (const engine::Outgoing& outgoing : messages) {
        if (!IsTooLate(outgoing)) {
          Route(outgoing);
        }
      }
      Flush();
    });
  }

  void SetKeys(signing::Keys keys) final {
    boost::asio::post(strand_, [this, keys = std::move(keys)] { ApplyKeys(keys); });
  }

 protected:
  /// `protocol` for messages: "tcp".
  ListeningLink(boost::asio::io_context& io, const LinkConfig& config, LinkContext context,
                std::string protocol)
      : Link(config, std::move(context)),
        strand_(boost::asio::make_strand(io)),
        socket_(strand_),
        protocol_(std::move(protocol)),
        retry_(strand_),
        backoff_(this->context().backoff) {}

  /// Sets the socket's options, before it is bound.
  virtual void Prepare() = 0;
  /// It listens, again perhaps.
  virtual void OnListening() {}
  virtual void OnStop() {}
  /// Waits for what comes, and takes it. False: not now; it is tried again later.
  virtual boost::asio::awaitable<bool> Receive() = 0;
  /// Sends a message, or keeps it until Flush.
  virtual void Route(const engine::Outgoing& outgoing) = 0;
  virtual void Flush() {}

  const auto& strand() const { return strand_; }
  Socket& socket() { return socket_; }
  bool stopping() const { return stopping_; }
  /// Something came.
  void ResetBackoff() { backoff_.Reset(); }

 private:
  Status Listen() {
    const auto where = pheromone::Listen(config().listen, &socket_, [this] { Prepare(); });
    if (!where.ok()) {
      ReportFailure(where.error());
      return where.error();
    }
    OnListening();
    ReportUp(protocol_ + " " + where.value(), where.value());
    return Ok();
  }

  boost::asio::awaitable<void> Run() {
    while (!stopping_) {
      if (socket_.is_open() && co_await Receive()) {
        continue;
      }
      if (!stopping_) {  // not listening, or out of descriptors
        boost::system::error_code ignored;
        retry_.expires_after(backoff_.Next());
        record()->SetNextAttempt(retry_.expiry());
        co_await retry_.async_wait(
            boost::asio::redirect_error(boost::asio::use_awaitable, ignored));
      }
      if (!stopping_ && !socket_.is_open()) {
        static_cast<void>(Listen());
      }
    }
  }

  const boost::asio::strand<boost::asio::io_context::executor_type> strand_;
  Socket socket_;
  const std::string protocol_;
  boost::asio::steady_timer retry_;
  Backoff backoff_;
  bool stopping_ = false;
};

}  // namespace pheromone::links
